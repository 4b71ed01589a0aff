"""One soldier's fusion again and again: sensors and pdr-engine are played once, fusion with this or that left out.

So the cost of an experiment with fusion is fusion's alone, a few seconds for an exercise.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Origin
from bootprint.messages import Position
from bootprint.topics import Identity
from fusion.config import FusionConfig
from fusion.engine import SUBJECTS, FusionCore
from pdr_engine.engine import SUBJECTS as PDR_SUBJECTS
from pdr_engine.engine import EngineCore
from proving_ground.exercises.event_time.inprocess_play import line_job
from proving_ground.exercises.event_time.line import TICK_NS
from proving_ground.exercises.exercise import Exercise, Soldier
from proving_ground.exercises.scoring.score import Row, compare, soldier_row
from proving_ground.exercises.source import open_exercise
from sensor_gateway.sources.run_messages import run_messages
from sensor_gateway.stamps import due_ns

Keep = Callable[[Envelope, float], bool]
"""Whether fusion hears a message that is due so many seconds after the beginning."""


@dataclass(frozen=True)
class Heard:
    """What a soldier's fusion hears, (due UTC ns, message) in order, and what it is scored by."""

    exercise: Exercise
    soldier: Soldier
    identity: Identity
    origin: Origin
    config: FusionConfig
    messages: tuple[tuple[int, Envelope], ...]

    @property
    def begins_ns(self) -> int:
        """Time zero."""
        return self.exercise.begins_ns


def heard_by(scenario: str, seed: int, soldiers: int) -> Iterator[Heard]:
    """What the first soldiers of a scenario hear."""
    exercise = open_exercise(scenario, seed)
    yield from (heard_in(exercise, soldier) for soldier in exercise.soldiers[:soldiers])


def heard_in(exercise: Exercise, soldier: Soldier, duration_s: float | None = None) -> Heard:
    """What a soldier of an exercise hears in its first ``duration_s`` (all of it, if None)."""
    begins_ns = exercise.begins_ns
    end_ns = begins_ns + round((exercise.duration_s if duration_s is None else duration_s) * NS_PER_S)
    job = line_job(exercise, soldier, begins_ns, end_ns, False)
    engine = EngineCore(job.pdr, job.identity, job.origin)
    heard: list[tuple[int, Envelope]] = []
    for envelope in run_messages(job.run, job.identity, begins_ns):
        due = due_ns(envelope.message)
        if due > end_ns:
            break
        heard.extend((due, one) for one in (envelope, *_steps(engine, envelope)) if _is_for_fusion(one))
    return Heard(exercise, soldier, job.identity, job.origin, job.fusion, tuple(heard))


def _is_for_fusion(envelope: Envelope) -> bool:
    return envelope.address.subject in SUBJECTS


def _steps(engine: EngineCore, envelope: Envelope) -> list[Envelope]:
    return list(engine.handle(envelope)) if envelope.address.subject in PDR_SUBJECTS else []


def everything(_envelope: Envelope, _since_s: float) -> bool:
    """Leaves nothing out."""
    return True


def fused(heard: Heard, keep: Keep = everything, config: FusionConfig | None = None) -> list[Position]:
    """The positions of a fusion that hears what ``keep`` lets through."""
    said = said_by(FusionCore(config or heard.config, heard.identity, heard.origin), heard, keep)
    return [one.message for one in said if isinstance(one.message, Position)]


def said_by(core: FusionCore, heard: Heard, keep: Keep = everything) -> list[Envelope]:
    """All that a fusion says which is told what ``keep`` lets through, until it is closed."""
    out: list[Envelope] = []
    tick_ns = heard.begins_ns
    for due, envelope in heard.messages:
        while tick_ns <= due:
            out += core.tick(tick_ns)
            tick_ns += TICK_NS
        if keep(envelope, (due - heard.begins_ns) / NS_PER_S):
            out += core.handle(envelope)
    return [*out, *core.close()]


def scored(heard: Heard, positions: list[Position]) -> Row:
    """The soldier's figures, as an exercise has them."""
    compared = compare(heard.soldier, positions, heard.begins_ns)
    return soldier_row(heard.soldier, compared, heard.exercise)
