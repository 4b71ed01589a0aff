"""The ``[hub]`` section of computer.toml: this hub's role, its radio nets, and when it speaks.

.. code-block:: toml

    [hub]
    role = "squad_leader"

    [[hub.links]]
    name = "alpha-squad"            # the net: the same name on every computer on it
    bind = "0.0.0.0:6970"
    peers = ["10.1.0.255:6970"]     # unicast, broadcast or multicast
    rate_bits_per_s = 9600
    header_bytes = 28               # what the link adds to each frame on the air
    mtu_bytes = 250
"""

from typing import Annotated, Final, Literal

import msgspec

from bootprint.config import Config
from bootprint.errors import ConfigError
from bootprint.topics import check_part
from sa_hub.radio.budget import depth_bits

Role = Literal["soldier", "squad_leader", "command_post"]
Positive = Annotated[float, msgspec.Meta(gt=0.0)]
SMALLEST_MTU_BYTES: Final = 40
LONGEST_LOST_S: Final = 400.0
"""The age of a report ends at 403 s in a frame: older ones cannot be relayed."""


class LinkProfile(Config, frozen=True):
    """One radio net over UDP: its addresses (``host:port``), its rate, and what a datagram costs beside its bytes.

    ``threshold_m``: receivers' error beyond which a report is sent on this net; the hub's own if None.
    """

    name: str
    rate_bits_per_s: Annotated[int, msgspec.Meta(gt=0)]
    kind: Literal["udp"] = "udp"
    bind: str = "0.0.0.0:0"
    peers: tuple[str, ...] = ()
    interface: str = "0.0.0.0"
    header_bytes: Annotated[int, msgspec.Meta(ge=0, le=200)] = 28
    mtu_bytes: Annotated[int, msgspec.Meta(ge=SMALLEST_MTU_BYTES, le=60_000)] = 250
    threshold_m: Positive | None = None

    @property
    def copies(self) -> int:
        """How often each frame goes on the air: once for every peer."""
        return max(1, len(self.peers))

    def air_bytes(self, frame_bytes: int) -> int:
        """What a frame costs on the air, to all peers, the link's headers included."""
        return self.copies * (frame_bytes + self.header_bytes)


class HubSettings(Config, frozen=True):
    """What a hub is and when it speaks; times are event time."""

    role: Role = "soldier"
    links: tuple[LinkProfile, ...] = ()
    threshold_m: Positive = 5.0
    heartbeat_s: Positive = 30.0
    confirm_s: Positive = 3.0
    gather_s: Annotated[float, msgspec.Meta(ge=0.0)] = 1.0
    stale_s: Positive = 75.0
    lost_s: Annotated[float, msgspec.Meta(gt=0.0, le=LONGEST_LOST_S)] = 180.0
    own_stale_s: Positive = 3.0
    tag_bytes: Literal[8, 4] = 8
    group_key: str | None = None
    exercise: bool = False

    @property
    def relays(self) -> bool:
        """Whether this hub passes on what it hears."""
        return self.role != "soldier"


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
    depth = depth_bits(link.rate_bits_per_s)
    if depth < needed:
        raise ConfigError(
            f"{where}: at {link.rate_bits_per_s} bit/s no more than {depth} bits go in one burst, "
            f"a frame to {link.copies} peer(s) may need {needed}; "
            "want a higher rate_bits_per_s, fewer header_bytes or peers"
        )
