"""Watches an exercise from outside: a bus client per computer, all of them emptied by one thread.

The observers are the umpire: they see every computer's bus, which no computer of the exercise does.
"""

import threading
from collections.abc import Collection, Mapping
from dataclasses import replace

import msgspec

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S, EventClock
from bootprint.geodesy import LocalFrame
from bootprint.messages import Mode, Position, Track
from bootprint.recording import Recorder
from bootprint.topics import VERSION
from bootprint.zenoh_bus import Inlet, ZenohBus, open_bus
from proving_ground.exercises.scoring.heard import WATCHED, Heard

_SENSED: tuple[Mode, ...] = ("gnss", "boots", "body", "camera")  # modes with a sensor behind the position
_INTERVAL_S = 0.02  # host time between two looks: what latencies are too long by, at the most
_FLUSH_LOOKS = 50


def in_umpires_time(track: Track, now_ns: int, jumps_s: Collection[float]) -> Track:
    """A report of somebody else by a hub whose clock may jump by so much: its ages stay, its clock's error goes.

    A hub tells reports in its own time. It went by the clock that makes its receipt the nearest to now.
    """
    if track.received_ns is None:
        return track
    ahead_s = (track.received_ns - now_ns) / NS_PER_S
    wrong_ns = round(min((0.0, *jumps_s), key=lambda jump_s: abs(ahead_s - jump_s)) * NS_PER_S)
    return msgspec.structs.replace(
        track, time_ns=track.time_ns - wrong_ns, received_ns=track.received_ns - wrong_ns
    )


class Observers:
    """Collect from every computer's bus (by its router) until closed; with a recorder, everything is recorded.

    ``jumps_s``: by how much an exercise sets clocks of hubs wrong, by computer.
    """

    def __init__(
        self,
        routers: Mapping[str, str],
        realm: str,
        clock: EventClock,
        frame: LocalFrame,
        recorder: Recorder | None = None,
        jumps_s: Mapping[str, Collection[float]] | None = None,
    ) -> None:
        self._clock = clock
        self._frame = frame
        self._recorder = recorder
        self._jumps_s = jumps_s or {}
        self._lock = threading.Lock()
        self._heard = {computer: Heard() for computer in routers}
        self._buses: dict[str, ZenohBus] = {}
        self._inlets: list[tuple[str, Inlet]] = []
        self._recorded: list[Inlet] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="observers", daemon=True)
        for computer, router in routers.items():
            self._open(computer, router, f"{realm}/{VERSION}")
        self._thread.start()

    def _open(self, computer: str, router: str, root: str) -> None:
        bus = self._buses[computer] = open_bus(router)
        for subject in WATCHED:
            self._inlets.append((computer, bus.open_inlet(f"{root}/*/*/{subject}/*")))
        if self._recorder is not None:
            self._recorded.append(bus.open_inlet(f"{root}/**"))

    def _run(self) -> None:
        looks = 0
        while not self._stop.wait(_INTERVAL_S):
            looks += 1
            self._look()
            if self._recorder is not None and looks % _FLUSH_LOOKS == 0:
                self._recorder.flush()

    def _look(self) -> None:
        now_ns = self._clock.now_ns()
        for computer, inlet in self._inlets:
            for envelope in inlet.take():
                self._take(computer, envelope, now_ns)
        if self._recorder is not None:
            for inlet in self._recorded:
                for envelope in inlet.take():
                    self._recorder.write(envelope, now_ns)

    def _take(self, computer: str, envelope: Envelope, now_ns: int) -> None:
        message = envelope.message
        if isinstance(message, Track) and message.soldier != computer and computer in self._jumps_s:
            message = in_umpires_time(message, now_ns, self._jumps_s[computer])
            envelope = replace(envelope, message=message)
        arrived_ns = now_ns
        if isinstance(message, Track) and message.received_ns is not None:
            arrived_ns = message.received_ns  # when the hub had it, not when we looked
        with self._lock:
            heard = self._heard[computer]
            is_own = heard.take(envelope, arrived_ns, self._frame)
            if is_own and isinstance(message, Track) and message.mode in _SENSED:
                latency_s = self._clock.host_seconds_since(message.time_ns)
                heard.latencies += [] if latency_s is None else [(message.time_ns, latency_s)]

    def alive(self, computer: str) -> set[str]:
        """Names of the services that run on a computer, by what they say of their health."""
        with self._lock:
            return self._heard[computer].alive()

    def forget(self, computer: str, service: str) -> None:
        """A service was killed, or will be started again: it is not alive until it says so."""
        with self._lock:
            self._heard[computer].health.pop(service, None)

    def newest_tracks(self, computer: str) -> dict[str, Track]:
        """The newest track of every soldier known on a computer."""
        with self._lock:
            return dict(self._heard[computer].newest)

    def newest_position(self, computer: str) -> Position | None:
        """The newest fused position on a computer."""
        with self._lock:
            positions = self._heard[computer].positions
            return positions[-1] if positions else None

    def heard(self) -> dict[str, Heard]:
        """All that has been heard, by computer; to be read when the exercise is over (`close`)."""
        with self._lock:
            return dict(self._heard)

    def close(self) -> None:
        """Take in what waits, then stop watching; safe to call twice."""
        if self._stop.is_set():
            return
        self._stop.set()
        self._thread.join()
        self._look()
        for bus in self._buses.values():
            bus.close()
