"""The ``[hub.tak]`` section: which TAK network the command post shares its picture with, and how.

.. code-block:: toml

    [hub.tak]
    url = "udp://239.2.3.1:6969"            # a mesh; or tcp://server:8087, tls://server:8089
    team = "Cyan"
"""

from dataclasses import dataclass
from typing import Annotated, Final, Literal
from urllib.parse import urlsplit

import msgspec

from bootprint.config import Config
from bootprint.errors import ConfigError

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
Team = Literal[
    "White",
    "Yellow",
    "Orange",
    "Magenta",
    "Red",
    "Maroon",
    "Purple",
    "Dark Blue",
    "Blue",
    "Cyan",
    "Teal",
    "Green",
    "Dark Green",
    "Brown",
]
_PORTS: Final = {"udp": 6969, "tcp": 8087, "tls": 8089}


class TakSettings(Config, frozen=True):
    """Where to, in which form, how often; ``ca``, ``cert`` and ``key`` are PEM files beside the configuration.

    A soldier's new report goes out at most every ``least_interval_s``, and every ``refresh_s`` without one. With
    ``receive`` others' units appear as foreign tracks and markers as observations; with ``tell_squad`` markers also
    go to the squad by radio, as far as its budget allows, and with ``tell_friends`` friends near our people as
    observations: the nearest first, one each ``friends_every_s`` at most.
    """

    url: str = "udp://239.2.3.1:6969"
    protocol: Literal["xml", "protobuf"] = "xml"
    team: Team = "Cyan"
    least_interval_s: Positive = 2.0
    refresh_s: Positive = 15.0
    receive: bool = True
    tell_squad: bool = False
    tell_friends: bool = False
    friends_within_m: Positive = 1000.0
    friends_every_s: Positive = 30.0
    interface: str = ""
    ca: str = ""
    cert: str = ""
    key: str = ""
    server_name: str = ""


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A url taken apart."""

    scheme: str
    host: str
    port: int


def endpoint_of(settings: TakSettings, where: str) -> Endpoint:
    """Where to connect; ConfigError if the url is none, or does not fit the other keys."""
    try:
        parts = urlsplit(settings.url)
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
        parts = urlsplit("")
    if parts.scheme not in _PORTS or not host:
        raise ConfigError(
            f"{where}.url {settings.url!r} must be like udp://239.2.3.1:6969, tcp://host or tls://host"
        )
    if settings.protocol == "protobuf" and parts.scheme != "udp":
        raise ConfigError(
            f'{where}.protocol: "protobuf" is spoken over udp only; want "xml" with {parts.scheme}'
        )
    if bool(settings.cert) != bool(settings.key):
        raise ConfigError(f"{where}: cert and key belong together; want both or neither")
    return Endpoint(parts.scheme, host, port or _PORTS[parts.scheme])
