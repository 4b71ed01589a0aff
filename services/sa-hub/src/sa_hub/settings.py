"""The ``[hub]`` section of computer.toml: this hub's role, its radio nets, and when it speaks.

.. code-block:: toml

    [hub]
    role = "squad_leader"

    [[hub.links]]
    name = "alpha-squad"            # the net: the same name on every computer on it
    profile = "vhf-9600"            # figures of a named radio; own keys override them
    bind = "0.0.0.0:6970"
    peers = ["10.1.0.255:6970"]     # unicast, broadcast or multicast
    rate_bits_per_s = 1200          # what this hub may spend
"""

from typing import Annotated, Final, Literal

import msgspec

from bootprint.clock import NS_PER_S
from bootprint.config import Config
from bootprint.display import Ages
from bootprint.errors import ConfigError
from bootprint.topics import check_part
from sa_hub.awareness.settings import WarningSettings
from sa_hub.history.settings import HistorySettings
from sa_hub.outputs.settings import MavlinkOutSettings, NmeaSettings
from sa_hub.page.settings import PageSettings
from sa_hub.radio.link_profile import SMALLEST_MTU_BYTES
from sa_hub.radio.link_profile import LinkProfile as LinkProfile
from sa_hub.tak.settings import TakSettings

Role = Literal["soldier", "squad_leader", "command_post"]
Positive = Annotated[float, msgspec.Meta(gt=0.0)]
LONGEST_LOST_S: Final = 400.0
"""The age of a report ends at 403 s in a frame: older ones cannot be relayed."""


class HubSettings(Config, frozen=True):
    """What a hub is and when it speaks; times are event time."""

    role: Role = "soldier"
    links: tuple[LinkProfile, ...] = ()
    threshold_m: Positive = 5.0
    heartbeat_s: Positive = 30.0
    stale_s: Positive = 75.0
    lost_s: Annotated[float, msgspec.Meta(gt=0.0, le=LONGEST_LOST_S)] = 180.0
    own_stale_s: Positive = 3.0
    tag_bytes: Literal[8, 4] = 8
    group_key: str | None = None
    exercise: bool = False
    warnings: WarningSettings = WarningSettings()
    history: HistorySettings | None = None
    tak: TakSettings | None = None
    mavlink_out: MavlinkOutSettings | None = None
    nmea: NmeaSettings | None = None
    page: PageSettings | None = None

    @property
    def relays(self) -> bool:
        """Whether this hub passes on what it hears."""
        return self.role != "soldier"

    @property
    def ages(self) -> Ages:
        """From when on others are stale, and anybody is lost."""
        return Ages(round(self.stale_s * NS_PER_S), round(self.lost_s * NS_PER_S))

    @property
    def own_ages(self) -> Ages:
        """The same of the hub's own soldier."""
        return Ages(round(self.own_stale_s * NS_PER_S), round(self.lost_s * NS_PER_S))


def check_settings(settings: HubSettings, where: str) -> None:
    """ConfigError if values that are right alone do not fit together."""
    if not settings.heartbeat_s < settings.stale_s < settings.lost_s:
        raise ConfigError(
            f"{where}: want heartbeat_s < stale_s < lost_s, "
            f"got {settings.heartbeat_s:g}, {settings.stale_s:g}, {settings.lost_s:g}"
        )
    names = [link.name for link in settings.links]
    for link in settings.links:
        _check_link(link, f"{where}.links {link.name!r}")
        if names.count(link.name) > 1:
            raise ConfigError(f"{where}.links: {link.name!r} stands there twice; give each net its own name")


def _check_link(link: LinkProfile, where: str) -> None:
    try:
        check_part("name", link.name)
    except ValueError as error:
        raise ConfigError(f"{where}: {error}") from error
    needed = 8 * link.air_bytes(SMALLEST_MTU_BYTES)
    if link.depth_bits < needed:
        raise ConfigError(
            f"{where}: at {link.rate_bits_per_s} bit/s no more than {link.depth_bits} bits go in one burst, "
            f"a frame to {link.copies} peer(s) may need {needed}; "
            "want a higher rate_bits_per_s, fewer header_bytes or peers"
        )
