"""Makes a link of the kind that its profile says; each kind's libraries are loaded only where it is used."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bootprint.keys.credentials import Credentials
from sa_hub.radio.link_profile import LinkProfile
from sa_hub.radio.links import Link


@dataclass(frozen=True)
class Surroundings:
    """What a link may need of its computer: realm, number and certificate at a shared router, folder and event
    time for files."""

    realm: str
    number: int
    folder: Path
    now_ns: Callable[[], int]
    credentials: Credentials | None = None


def open_link(profile: LinkProfile, on_frame: Callable[[bytes], None], around: Surroundings) -> Link:
    """A link, not started yet; ConfigError if its addresses or files cannot be used."""
    match profile.kind:
        case "udp":
            from sa_hub.radio.links.udp import UdpLink

            return UdpLink(profile, on_frame)
        case "serial":
            from sa_hub.radio.links.serial_line import SerialLink

            return SerialLink(profile, on_frame)
        case "zenoh":
            from sa_hub.radio.links.zenoh_key import ZenohLink

            return ZenohLink(profile, on_frame, around.realm, around.number, around.credentials)
        case "file":
            from sa_hub.radio.links.file_line import FileLink

            return FileLink(profile, on_frame, around.folder, around.now_ns)
