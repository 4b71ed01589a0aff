"""Watches an exercise from outside: one bus client per computer that keeps what the score needs.

The observer is the umpire: it sees every computer's bus, which no computer of the exercise does.
"""

import threading
from dataclasses import dataclass, field

from bootprint.bus import Envelope
from bootprint.clock import EventClock
from bootprint.messages import Health, LinkReport, Mode, Position, Track
from bootprint.topics import VERSION
from bootprint.zenoh_bus import ZenohBus, open_bus

_SENSED: tuple[Mode, ...] = ("gnss", "boots", "body", "camera")  # modes with a sensor behind the position
WATCHED = ("position", "track", "link", "health")


@dataclass
class Heard:
    """What one computer's bus has told so far.

    ``tracks`` holds (event time of arrival ns, track); ``latency_s`` is host time from a position's event time to
    its publication as the soldier's own track.
    """

    positions: list[Position] = field(default_factory=list)
    tracks: list[tuple[int, Track]] = field(default_factory=list)
    links: dict[str, LinkReport] = field(default_factory=dict)
    health: dict[str, Health] = field(default_factory=dict)
    latency_s: list[float] = field(default_factory=list)


class Observer:
    """Collects from one computer's bus until closed."""

    def __init__(self, computer: str, router: str, realm: str, clock: EventClock) -> None:
        self.computer = computer
        self._clock = clock
        self._lock = threading.Lock()
        self._heard = Heard()
        self._newest: dict[str, Track] = {}
        self._realm = realm
        self._bus: ZenohBus = open_bus(router)
        for subject in WATCHED:
            self._bus.subscribe(f"{realm}/{VERSION}/*/*/{subject}/*", self._take)

    def alive(self) -> set[str]:
        """Names of the services that hold their liveliness token on this computer."""
        return {key.rsplit("/", 1)[1] for key in self._bus.alive(f"{self._realm}/{VERSION}/*/*/health/*")}

    def _take(self, envelope: Envelope) -> None:
        with self._lock:
            match envelope.message:
                case Position() as position:
                    self._heard.positions.append(position)
                case Track() as track:
                    self._take_track(track)
                case LinkReport() as report:
                    self._heard.links[report.link] = report
                case Health() as health:
                    self._heard.health[health.service] = health

    def _take_track(self, track: Track) -> None:
        previous = self._newest.get(track.soldier)
        if previous is not None and track.time_ns <= previous.time_ns:
            return  # the same report published again, with a new state
        self._newest[track.soldier] = track
        self._heard.tracks.append((self._clock.now_ns(), track))
        latency_s = self._clock.host_seconds_since(track.time_ns)
        if track.soldier == self.computer and track.mode in _SENSED and latency_s is not None:
            self._heard.latency_s.append(latency_s)

    def newest_tracks(self) -> dict[str, Track]:
        """The newest track of every soldier known on this computer."""
        with self._lock:
            return dict(self._newest)

    def newest_position(self) -> Position | None:
        """The newest fused position on this computer."""
        with self._lock:
            return self._heard.positions[-1] if self._heard.positions else None

    def heard(self) -> Heard:
        """A copy of all that was heard."""
        with self._lock:
            heard = self._heard
            return Heard(
                list(heard.positions),
                list(heard.tracks),
                dict(heard.links),
                dict(heard.health),
                list(heard.latency_s),
            )

    def close(self) -> None:
        """Stop watching."""
        self._bus.close()
