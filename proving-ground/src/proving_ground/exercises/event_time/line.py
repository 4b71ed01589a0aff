"""One soldier's line in event time: sensor messages through pdr-engine and fusion to positions, each with the time
at which it was out. The same cores as the processes', routed by the subjects they listen to; no bus, no wire.

Lines do not know of each other until the radio, so a pool may play them.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

from bootprint import wire
from bootprint.bus import Core, Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Origin
from bootprint.messages import FootStep, Position
from bootprint.topics import CACHED_SAMPLES, Address, Identity, Qos
from fusion.config import FusionConfig
from fusion.engine import SUBJECTS as FUSION_SUBJECTS
from fusion.engine import FusionCore
from fusion.memory import SAVE_EVERY_NS
from fusion.memory import Saved as SavedFusion
from pdr_engine.config import PdrConfig
from pdr_engine.engine import SUBJECTS as PDR_SUBJECTS
from pdr_engine.engine import EngineCore
from pdr_engine.memory import Saved as SavedEngine
from proving_ground.exercises.exercise import Fault
from sensor_gateway.recordings.run import Run
from sensor_gateway.sources.run_messages import run_messages
from sensor_gateway.stamps import due_ns

TICK_NS: Final = 100_000_000
RESTART_NS: Final = 2 * NS_PER_S
"""A process that was killed is back after so long, as its supervisor has it."""
SOLDIERS_SERVICES: Final = ("sensor-gateway", "pdr-engine", "fusion", "sa-hub")
_TOLD_AGAIN: Final = (Qos.ASSURED, Qos.RECENT)  # what a process that is started later is told, as by the bus
_SERVICES: Final = {"pdr-engine": PDR_SUBJECTS, "fusion": FUSION_SUBJECTS}


def killed_by(fault: Fault) -> tuple[str, ...]:
    """The services of its computer that a fault takes away."""
    if fault.kind == "power_cut":
        return SOLDIERS_SERVICES
    return (str(fault.details["process"]),) if fault.kind == "process_killed" else ()


def back_after_ns(fault: Fault) -> int:
    """After how long they are back."""
    return RESTART_NS if fault.kind == "process_killed" else round((fault.until_s - fault.at_s) * NS_PER_S)


@dataclass(frozen=True)
class LineJob:
    """Everything a line needs, for any process. ``kills`` are (UTC ns from, until; service) when one is gone."""

    identity: Identity
    origin: Origin
    run: Run
    pdr: PdrConfig
    fusion: FusionConfig
    start_ns: int
    end_ns: int
    kills: tuple[tuple[int, int, str], ...] = ()
    record: bool = False


@dataclass
class Line:
    """What a line put out: positions by the time (UTC ns) they were out, steps by place; to be recorded, all."""

    soldier: str
    positions: list[tuple[int, Position]] = field(default_factory=list)
    steps: dict[str, list[FootStep]] = field(default_factory=dict)
    recorded: list[tuple[str, bytes, int]] = field(default_factory=list)


def play_line(job: LineJob) -> Line:
    """Play a whole line; the same job gives the same line."""
    return _Player(job).play()


class _Player:
    """Sensor messages, ticks and kills in the order of event time."""

    def __init__(self, job: LineJob) -> None:
        self._job = job
        self._line = Line(job.identity.soldier)
        self._fusion_saved: SavedFusion | None = None  # what each has on its disk
        self._engine_saved: SavedEngine | None = None
        self._cores: dict[str, Core | None] = {name: self._build(name) for name in _SERVICES}
        self._cache: dict[Address, deque[Envelope]] = {}
        self._now_ns = job.start_ns
        self._next_tick_ns = job.start_ns
        self._schedule = deque(sorted(self._changes()))
        self._gateway_runs = True

    def _build(self, service: str) -> Core:
        job = self._job
        if service == "fusion":
            return FusionCore(job.fusion, job.identity, job.origin, saved=self._fusion_saved)
        return EngineCore(job.pdr, job.identity, job.origin, saved=self._engine_saved)

    def _changes(self) -> Iterator[tuple[int, str, bool]]:
        """(time, service, runs from then on)."""
        for begin_ns, end_ns, service in self._job.kills:
            yield begin_ns, service, False
            yield end_ns, service, True

    def play(self) -> Line:
        """All of it, until the exercise's end."""
        job = self._job
        for envelope in run_messages(job.run, job.identity, job.start_ns):
            due = due_ns(envelope.message)
            if due > job.end_ns:
                break
            self._advance(due)
            if self._gateway_runs:
                self._pass_on([envelope])
        self._advance(job.end_ns)
        return self._line

    def _advance(self, until_ns: int) -> None:
        """Ticks and changes until then."""
        while self._next_tick_ns <= until_ns:
            self._change(self._next_tick_ns)
            self._now_ns = max(self._now_ns, self._next_tick_ns)
            for core in self._cores.values():
                if core is not None:
                    self._pass_on(core.tick(self._next_tick_ns))
            self._save()
            self._next_tick_ns += TICK_NS
        self._change(until_ns)
        self._now_ns = max(self._now_ns, until_ns)

    def _save(self) -> None:
        if not self._job.kills or self._now_ns % SAVE_EVERY_NS >= TICK_NS:
            return
        fusion, engine = self._cores["fusion"], self._cores["pdr-engine"]
        if isinstance(fusion, FusionCore):
            self._fusion_saved = fusion.remembered() or self._fusion_saved
        if isinstance(engine, EngineCore):
            self._engine_saved = engine.remembered() or self._engine_saved

    def _change(self, until_ns: int) -> None:
        while self._schedule and self._schedule[0][0] <= until_ns:
            at_ns, service, runs = self._schedule.popleft()
            self._now_ns = max(self._now_ns, at_ns)
            if service == "sensor-gateway":
                self._gateway_runs = runs
            elif service in _SERVICES:
                self._cores[service] = self._build(service) if runs else None
                if runs:
                    self._tell_history(service)

    def _tell_history(self, service: str) -> None:
        """What a process that is started in the middle hears first: the events in the publishers' caches."""
        for address in sorted(self._cache):
            if address.subject in _SERVICES[service]:
                for envelope in list(self._cache[address]):
                    self._handle(service, envelope)

    def _pass_on(self, envelopes: Iterable[Envelope]) -> None:
        """To the sinks, and to every core that listens; what comes out of that likewise, first in first out."""
        waiting = deque(envelopes)
        while waiting:
            envelope = waiting.popleft()
            self._keep(envelope)
            for service, subjects in _SERVICES.items():
                core = self._cores[service]
                if core is not None and envelope.address.subject in subjects:
                    waiting.extend(core.handle(envelope))

    def _handle(self, service: str, envelope: Envelope) -> None:
        core = self._cores[service]
        if core is not None:
            self._pass_on(core.handle(envelope))

    def _keep(self, envelope: Envelope) -> None:
        address, message = envelope.address, envelope.message
        qos = address.topic.qos
        if self._job.kills and qos in _TOLD_AGAIN:
            self._cache.setdefault(address, deque(maxlen=CACHED_SAMPLES[qos])).append(envelope)
        if isinstance(message, Position):
            self._line.positions.append((self._now_ns, message))
        elif isinstance(message, FootStep):
            self._line.steps.setdefault(address.source, []).append(message)
        if self._job.record:
            self._line.recorded.append((address.key, wire.encode(message), self._now_ns))


def samples_of(jobs: Sequence[LineJob]) -> int:
    """How many inertial samples the jobs hold: what playing them costs."""
    return sum(len(imu.time_s) for job in jobs for imu in job.run.imus.values())
