"""Hubs and radio nets in event time: positions in, frames over emulated nets, everybody's picture out; no sockets.

Radio decisions fall on the hubs' grid of 0.1 s. Between two steps positions and frames come in the order of their
times; what comes at one time comes in the order of the roster. So the outcome is a function of the lines alone.
"""

import hashlib
import heapq
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Member
from bootprint.geodesy import LocalFrame
from bootprint.messages import Fix, Position
from bootprint.recording import Recorder
from proving_ground.exercises.event_time.line import Line, back_after_ns, killed_by
from proving_ground.exercises.exercise import Exercise
from proving_ground.exercises.processes.emulated_radio import Air
from proving_ground.exercises.processes.exercise_files import hub_settings
from proving_ground.exercises.scoring.heard import Heard
from sa_hub.assembly import build_hub
from sa_hub.hub import STEP_NS, HubCore
from sa_hub.radio.counters import MemoryCounters

# Nothing secret passes here, and the same exercise shall give the same frames.
_GROUP_KEY: Final = hashlib.sha256(b"exercise in one process").digest()
_POSITION, _FRAME = 0, 1


@dataclass(order=True)
class _Arrival:
    """Something that reaches a hub between two steps."""

    at_ns: int
    kind: int
    order: int
    deliver: Callable[[], None] = field(compare=False)


class Watcher(Protocol):
    """Looks on while hubs are played, and sets the pace."""

    def before(self, now_ns: int) -> bool:
        """A step is about to be done; False ends the play."""

    def kept(self, computer: str, envelopes: list[Envelope]) -> None:
        """What a computer's hub has said."""


class RadioPlay:
    """All computers' hubs of an exercise from ``start_ns`` to ``end_ns``; `run` once."""

    def __init__(
        self,
        exercise: Exercise,
        lines: Mapping[str, Line],
        start_ns: int,
        end_ns: int,
        recorder: Recorder | None = None,
        watcher: Watcher | None = None,
    ) -> None:
        self._watcher = watcher
        self._exercise = exercise
        self._start_ns = start_ns
        self._end_ns = end_ns
        self._frame = LocalFrame(exercise.origin)
        self._recorder = recorder
        self._epochs = dict.fromkeys(exercise.computers, 0)
        self._hubs: dict[str, HubCore | None] = {name: self._build(name) for name in exercise.computers}
        self._identities = {name: exercise.identity(name) for name in exercise.computers}
        self._airs = {
            net.profile.name: Air(
                net.profile, net.members, exercise.silences_s(net), 0.0, exercise.partings(net)
            )
            for net in exercise.nets
        }
        self.heard = {name: self._heard(lines.get(name)) for name in exercise.computers}
        self._positions = _by_time(lines, exercise.computers)
        self._clock_jumps = [fault for fault in exercise.faults if fault.kind == "clock_jump"]
        self._changes = sorted(self._hub_changes())

    @property
    def airs(self) -> Mapping[str, Air]:
        """The nets by name, with what they carried."""
        return self._airs

    def _heard(self, line: Line | None) -> Heard:
        heard = Heard()
        if line is not None:
            heard.positions.extend(position for _, position in line.positions)
            heard.steps.update(line.steps)
        return heard

    def _build(self, computer: str) -> HubCore:
        """A fresh hub; one that comes back counts in a new epoch, so that no nonce comes twice."""
        self._epochs[computer] += 1
        epoch = self._epochs[computer]
        realm = self._exercise.realm
        return build_hub(
            realm,
            realm.member(computer),
            hub_settings(self._exercise, computer),
            _GROUP_KEY,
            lambda _net: MemoryCounters(epoch),
        )

    def _hub_changes(self) -> Iterator[tuple[int, str, bool]]:
        """(time, computer, hub runs from then on) of hubs that are killed."""
        for fault in self._exercise.faults:
            if "sa-hub" in killed_by(fault):
                at_ns = self._start_ns + round(fault.at_s * NS_PER_S)
                yield at_ns, fault.target, False
                yield at_ns + back_after_ns(fault), fault.target, True

    def run(self, on_progress: Callable[[float], None] = lambda _share: None) -> None:
        """Play it; ``on_progress`` is told the share that is done, now and then."""
        position = next(self._positions, None)
        steps = range(self._start_ns, self._end_ns + 1, STEP_NS)
        for index, now_ns in enumerate(steps):
            if self._watcher is not None and not self._watcher.before(now_ns):
                return
            waiting: list[_Arrival] = self._frames_until(now_ns)
            while position is not None and position[0] <= now_ns:
                waiting.append(self._position_arrival(*position))
                position = next(self._positions, None)
            for arrival in sorted(waiting):
                arrival.deliver()
            self._step(now_ns)
            if index % 100 == 0:
                on_progress(index / len(steps))
        on_progress(1.0)

    def hand(self, computer: str, envelope: Envelope, at_ns: int) -> list[Envelope]:
        """A message on a computer's own bus, from outside the exercise; what its hub says to it."""
        hub = self._hubs[computer]
        return [] if hub is None else self._keep(computer, hub.handle(envelope), at_ns)

    def place(self, computer: str, fix: Fix, member: Member, at_ns: int) -> list[Envelope]:
        """A person says on a computer where somebody else is."""
        hub = self._hubs[computer]
        return [] if hub is None else self._keep(computer, hub.place(fix, member), at_ns)

    def _position_arrival(self, at_ns: int, order: int, computer: str, position: Position) -> _Arrival:
        def deliver() -> None:
            hub = self._hubs[computer]
            if hub is not None:
                address = self._identities[computer].address("position", "fusion")
                self._keep(computer, hub.handle(Envelope(address, position)), at_ns)

        return _Arrival(at_ns, _POSITION, order, deliver)

    def _frames_until(self, now_ns: int) -> list[_Arrival]:
        arrivals: list[_Arrival] = []
        for net, air in self._airs.items():
            for delivery in air.arrived(self._seconds(now_ns)):
                at_ns = self._start_ns + round(delivery.due_s * NS_PER_S)
                deliver = self._hearing(net, delivery.member, delivery.datagram, at_ns)
                arrivals.append(_Arrival(at_ns, _FRAME, len(arrivals), deliver))
        return arrivals

    def _hearing(self, net: str, computer: str, datagram: bytes, at_ns: int) -> Callable[[], None]:
        def deliver() -> None:
            hub = self._hubs[computer]
            if hub is not None:
                self._keep(computer, hub.receive(net, datagram, self._clock_ns(computer, at_ns)), at_ns)

        return deliver

    def _step(self, now_ns: int) -> None:
        while self._changes and self._changes[0][0] <= now_ns:
            _, computer, runs = self._changes.pop(0)
            self._hubs[computer] = self._build(computer) if runs else None
        for computer, hub in self._hubs.items():
            if hub is None:
                continue
            self._keep(computer, hub.tick(self._clock_ns(computer, now_ns)), now_ns)
            for frame in hub.take_frames():
                self._airs[frame.link].transmit(computer, frame.data, self._seconds(now_ns))

    def _seconds(self, now_ns: int) -> float:
        return (now_ns - self._start_ns) / NS_PER_S

    def _clock_ns(self, computer: str, now_ns: int) -> int:
        """What a computer takes for the time."""
        true_ns = now_ns
        for fault in self._clock_jumps:
            if fault.target == computer and fault.at_s <= self._seconds(true_ns) < fault.until_s:
                now_ns += round(float(fault.details["jump_s"]) * NS_PER_S)
        return now_ns

    def _keep(self, computer: str, outputs: Iterable[Envelope], at_ns: int) -> list[Envelope]:
        heard, envelopes = self.heard[computer], list(outputs)
        for envelope in envelopes:
            heard.take(envelope, at_ns, self._frame)
            if self._recorder is not None:
                self._recorder.write(envelope, at_ns)
        if self._watcher is not None and envelopes:
            self._watcher.kept(computer, envelopes)
        return envelopes


def _by_time(lines: Mapping[str, Line], computers: Sequence[str]) -> Iterator[tuple[int, int, str, Position]]:
    """(time out, order, computer, position) of all lines."""

    def of(order: int, computer: str) -> Iterator[tuple[int, int, str, Position]]:
        return ((at_ns, order, computer, position) for at_ns, position in lines[computer].positions)

    streams = [of(order, computer) for order, computer in enumerate(computers) if computer in lines]
    return heapq.merge(*streams, key=lambda item: item[:2])
