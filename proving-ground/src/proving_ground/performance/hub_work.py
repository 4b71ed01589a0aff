"""What a command post's hub does with what it hears, and the same reports as others send them, for comparison."""

import time
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.messages import Track
from proving_ground.performance.hub_company import COMPANY_NET, POST, START_NS, Company, HeardFrame, position

_TICK_NS: Final = NS_PER_S // 20
"""As often as a service looks at the time."""


@dataclass(frozen=True, slots=True)
class Work:
    """A hub's work: processor time, s, frames heard and sent, reports taken into the picture."""

    cpu_s: float
    heard: int
    sent: int
    reports: int


def keep_picture(company: Company, frames: Sequence[HeardFrame], duration_s: int) -> Work:
    """Everything a command post does in so many seconds of event time, what it publishes encoded, too."""
    hub = company.post()
    waiting = list(reversed(frames))
    sent = reports = 0
    begin_s = time.thread_time()
    for now_ns in range(START_NS, START_NS + duration_s * NS_PER_S, _TICK_NS):
        while waiting and waiting[-1].time_ns <= now_ns:
            reports += _published(hub.receive(COMPANY_NET, waiting.pop().data, now_ns))
        _published(hub.tick(now_ns))
        sent += len(hub.take_frames())
    return Work(time.thread_time() - begin_s, len(frames), sent, reports)


def merge(company: Company, frames: Sequence[HeardFrame]) -> Work:
    """Nothing but merging: frames opened, decoded, made tracks and encoded for the bus, one after the other."""
    hub = company.post()
    begin_s = time.thread_time()
    reports = sum(_published(hub.receive(COMPANY_NET, frame.data, frames[-1].time_ns)) for frame in frames)
    return Work(time.thread_time() - begin_s, len(frames), 0, reports)


def _published(outputs: Sequence[Envelope]) -> int:
    """Encode what a hub publishes; how many of it are tracks."""
    for envelope in outputs:
        wire.encode(envelope.message)
    return sum(isinstance(envelope.message, Track) for envelope in outputs)


def parse_cot(events: Sequence[str]) -> float:
    """Processor time, s, to take as many events of Cursor on Target (XML) into a picture: parsed, numbers read."""
    picture: dict[str, tuple[float, ...]] = {}
    begin_s = time.thread_time()
    for event in events:
        _take_cot(event, picture)
    return time.thread_time() - begin_s


def _take_cot(event: str, picture: dict[str, tuple[float, ...]]) -> None:
    root = ET.fromstring(event)
    point, track = root.find("point"), root.find("detail/track")
    if point is not None and track is not None:
        place = (float(point.attrib[name]) for name in ("lat", "lon", "hae", "ce"))
        motion = (float(track.attrib[name]) for name in ("course", "speed"))
        stamp_s = datetime.fromisoformat(root.attrib["time"]).timestamp()
        picture[root.attrib["uid"]] = (stamp_s, *place, *motion)


def cot_events(count: int) -> list[str]:
    """So many position events as a hand-held sends them (schema: MITRE MP090284, Cursor on Target)."""
    return [_cot_event(1 + index % 500, START_NS + index * NS_PER_S // 10) for index in range(count)]


def _cot_event(number: int, time_ns: int) -> str:
    place = position(number, time_ns)
    stamp = datetime.fromtimestamp(time_ns / NS_PER_S, UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")
    return (
        f'<event version="2.0" uid="ANDROID-{number:016x}" type="a-f-G-U-C" how="m-g" '
        f'time="{stamp}" start="{stamp}" stale="{stamp}">'
        f'<point lat="{place.latitude_deg:.7f}" lon="{place.longitude_deg:.7f}" hae="40.1" ce="3.0" le="9.9"/>'
        f'<detail><contact callsign="{POST} {number}" endpoint="*:-1:stcp"/>'
        '<__group name="Cyan" role="Team Member"/><status battery="81"/>'
        '<takv device="HANDHELD" platform="ATAK" os="30" version="4.5"/>'
        '<track course="123.4" speed="1.3"/></detail></event>'
    )
