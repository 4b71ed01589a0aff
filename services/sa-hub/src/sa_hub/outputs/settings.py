"""The ``[hub.mavlink_out]`` and ``[hub.nmea]`` sections: who else gets positions, and in which form.

.. code-block:: toml

    [hub.mavlink_out]                       # a command post's: everybody, for a ground station
    to = ["127.0.0.1:14550"]

    [hub.nmea]                              # any hub's: its own soldier's place
    to = ["udp:127.0.0.1:10110", "tcp:127.0.0.1:10110", "pty:state/nmea"]
"""

from typing import Annotated, Literal

import msgspec

from bootprint.config import Config
from bootprint.errors import ConfigError

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
Address = tuple[str, int]


class MavlinkOutSettings(Config, frozen=True):
    """``geoid_undulation_m``: the geoid's height above the ellipsoid here, for heights above mean sea level."""

    to: tuple[str, ...] = ("127.0.0.1:14550",)
    interval_s: Positive = 1.0
    geoid_undulation_m: float = 0.0


class NmeaSettings(Config, frozen=True):
    """``to``: ``udp:host:port``, ``tcp:host:port`` (serves who connects) or ``pty:file`` (a link to a terminal).

    Without ``geoid_undulation_m`` heights stay away: NMEA knows only those above mean sea level.
    """

    to: tuple[str, ...] = ("udp:127.0.0.1:10110",)
    interval_s: Positive = 1.0
    talker: Literal["GN", "GP", "IN"] = "GN"
    geoid_undulation_m: float | None = None


def address_of(text: str, where: str) -> Address:
    """``host:port`` taken apart; ConfigError if it is none."""
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or not 0 <= int(port) <= 65535:
        raise ConfigError(f"{where}: {text!r} must be host:port, e.g. 127.0.0.1:14550")
    return host, int(port)
