"""The event log: what befell soldiers, pictures and radio, in the order of time."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from bootprint.clock import NS_PER_S
from bootprint.messages import Mode, Position
from proving_ground.exercises.exercise import Exercise
from proving_ground.exercises.scoring.heard import Heard, ReportLog

_SETTLED_S = 3.0  # a mode that lasts no longer is no event
_WORDS: dict[Mode, str] = {
    "unplaced": "does not know where it is",
    "gnss": "has satellites",
    "boots": "goes by boots alone",
    "body": "goes by the body's unit",
    "camera": "goes by the camera",
    "coasting": "hears no sensor",
    "lost": "is lost",
}


@dataclass(frozen=True, order=True)
class Event:
    """Something that happened ``time_s`` into the exercise."""

    time_s: float
    who: str
    what: str


def event_log(
    exercise: Exercise, heard: Mapping[str, Heard], start_ns: int, lost_s: float, duration_s: float
) -> list[Event]:
    """Everything worth telling, by time."""
    events = list(_of_radio(exercise))
    for soldier in exercise.soldiers:
        events += _of_modes(soldier.id, heard[soldier.id].positions, start_ns)
        log = heard[exercise.command_post].reports.get(soldier.id)
        if soldier.id != exercise.command_post:
            events += _of_picture(exercise.command_post, soldier.id, log, start_ns, lost_s, duration_s)
    return sorted(event for event in events if event.time_s <= duration_s)


def _of_radio(exercise: Exercise) -> Iterator[Event]:
    for fault in exercise.faults:
        words = " ".join(str(value) for name, value in sorted(fault.details.items()) if name != "for_s")
        yield Event(fault.at_s, fault.target, f"fault: {fault.kind.replace('_', ' ')} {words}".strip())
        if fault.until_s < exercise.duration_s:
            yield Event(fault.until_s, fault.target, f"fault over: {fault.kind.replace('_', ' ')}")
    for net in exercise.nets:
        for begin_s, end_s in net.outages_s:
            yield Event(begin_s, net.profile.name, "the net is down")
            yield Event(end_s, net.profile.name, "the net is up again")


def _of_modes(soldier: str, positions: Sequence[Position], start_ns: int) -> Iterator[Event]:
    """Changes of mode that last."""
    spans: list[tuple[float, Mode]] = []
    for position in sorted(positions, key=lambda position: position.time_ns):
        if not spans or spans[-1][1] != position.mode:
            spans.append(((position.time_ns - start_ns) / NS_PER_S, position.mode))
    told: Mode | None = None
    for index, (begin_s, mode) in enumerate(spans):
        lasts = index + 1 == len(spans) or spans[index + 1][0] - begin_s >= _SETTLED_S
        if lasts and mode != told:
            yield Event(begin_s, soldier, _WORDS[mode])
            told = mode


def _of_picture(
    receiver: str, soldier: str, log: ReportLog | None, start_ns: int, lost_s: float, duration_s: float
) -> Iterator[Event]:
    """When a receiver first hears of a soldier, loses them, and has them back."""
    if log is None or not len(log):
        yield Event(0.0, receiver, f"never hears of {soldier}")
        return
    told = log.told(start_ns)
    yield Event(max(0.0, float(told.arrived_s[0])), receiver, f"first hears of {soldier}")
    arrivals = [*told.arrived_s[1:], None]
    for stamp_s, next_s in zip(told.stamp_s, arrivals, strict=True):
        gone_s = float(stamp_s) + lost_s
        if gone_s < (duration_s if next_s is None else float(next_s)):
            yield Event(gone_s, receiver, f"has lost {soldier}")
            if next_s is not None:
                yield Event(float(next_s), receiver, f"hears of {soldier} again")
