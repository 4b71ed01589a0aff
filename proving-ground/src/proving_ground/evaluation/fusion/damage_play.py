"""One simulated walk of both boots through a live fusion, damaged on its way: what `damages` judges.

Messages go in the order in which they arrive, ticks every tenth of a second, and a service that dies in the middle
is back two seconds later with what it had saved and with the newest steps or samples told again, as on the bus.
"""

from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import convert
from bootprint.messages import FootStep, Position
from bootprint.topics import CACHED_SAMPLES, Address, Identity, Qos
from fusion.config import FusionConfig
from fusion.engine import FusionCore
from fusion.memory import SAVE_EVERY_NS, Saved
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from pdr_engine.memory import SAVE_EVERY_NS as SAVE_ENGINE_EVERY_NS
from pdr_engine.memory import Saved as SavedEngine
from proving_ground.evaluation.alignment import FloatArray
from proving_ground.evaluation.fusion.dual_walks import ORIGIN, DualWalk, dual_walk
from sensor_gateway.recordings.run import FEET, Run
from sensor_gateway.sources.run_messages import run_messages
from sensor_gateway.stamps import due_ns

BEGIN_NS = 1_780_000_000 * NS_PER_S
SEED = 301
BACK_S = 2.0  # a service that died is back after so long
WAY_M = [
    (0.0, 0.0),
    (0.0, 30.0),
    (20.0, 30.0),
    (20.0, 0.0),
    (0.0, 0.0),
    (0.0, 30.0),
    (20.0, 30.0),
    (20.0, 0.0),
]
_WHO = Identity("trial", "alpha", "a1")
_TICK_NS = NS_PER_S // 10
_CACHED = 64
_CHI2_95 = 5.991
_AFTER_START_S = 15.0  # until then nobody has walked


@dataclass(frozen=True, slots=True)
class Arrival:
    """A message, and when it reaches fusion (UTC ns)."""

    at_ns: int
    envelope: Envelope

    @property
    def is_foot(self) -> bool:
        """Whether it is a foot's."""
        return self.envelope.address.subject.startswith("foot_")

    def of(self, subject: str, source: str | None = None) -> bool:
        """Whether it is of this subject (and source)."""
        address = self.envelope.address
        return address.subject == subject and source in (None, address.source)


RunChange = Callable[[Run], Run]
StreamChange = Callable[[list[Arrival]], list[Arrival]]


@dataclass(frozen=True)
class Outcome:
    """Positions (rising times), their errors (n,) m in the plane, share inside 95 %, counts; ``seconds`` (n,)."""

    positions: Sequence[Position]
    seconds: FloatArray
    errors_m: FloatArray
    inside_95_pct: float
    counters: Counter[str] = field(default_factory=Counter)

    @property
    def p95_m(self) -> float:
        """Of the error in the plane."""
        return float(np.percentile(self.errors_m, 95))

    @property
    def end_m(self) -> float:
        """The last position's error."""
        return float(self.errors_m[-1])

    def sources(self, begin_s: float, end_s: float) -> set[str]:
        """Everything that was named as a source between these times."""
        return {source for one in self._between(begin_s, end_s) for source in one.sources}

    def rejected(self, begin_s: float, end_s: float) -> set[str]:
        """Everything that was named as rejected between these times."""
        return {source for one in self._between(begin_s, end_s) for source in one.rejected}

    def longest_silence_s(self) -> float:
        """Between two positions."""
        return float(np.diff(self.seconds).max())

    def _between(self, begin_s: float, end_s: float) -> list[Position]:
        return [
            one for one, time_s in zip(self.positions, self.seconds, strict=True) if begin_s <= time_s < end_s
        ]


@cache
def the_walk() -> DualWalk:
    """270 m twice round a yard of 30 m by 20 m, with a receiver that nothing disturbs."""
    return dual_walk(WAY_M, SEED, satellites=True)


def played(
    on_run: RunChange | None = None,
    on_stream: StreamChange | None = None,
    *,
    satellites: bool = False,
    fusion_dies_s: float | None = None,
    engine_dies_s: float | None = None,
    gateway_dies_s: float | None = None,
) -> Outcome:
    """The walk with these damages; the same for the same damages."""
    walk = the_walk()
    run = walk.run if satellites else replace(walk.run, gnss=None)
    arrivals = _arrivals(run if on_run is None else on_run(run), engine_dies_s, gateway_dies_s)
    if on_stream is not None:
        arrivals = sorted(on_stream(arrivals), key=lambda arrival: arrival.at_ns)
    player = _Player(walk, satellites=satellites)
    player.play(arrivals, fusion_dies_s)
    return _outcome(player, walk)


def _arrivals(run: Run, engine_dies_s: float | None, gateway_dies_s: float | None) -> list[Arrival]:
    """Everything that fusion listens to."""
    engine, arrivals = _Engine(engine_dies_s), list[Arrival]()
    for envelope in run_messages(run, _WHO, BEGIN_NS):
        at_ns = due_ns(envelope.message)
        if _is_dead(gateway_dies_s, at_ns):
            continue
        if envelope.address.subject == "gnss":
            arrivals.append(Arrival(at_ns, envelope))
        arrivals += [Arrival(at_ns, said) for said in engine.hear(envelope, at_ns)]
    return arrivals


def _is_dead(dies_s: float | None, at_ns: int) -> bool:
    return dies_s is not None and 0.0 <= (at_ns - BEGIN_NS) / NS_PER_S - dies_s < BACK_S


class _Engine:
    """A pdr-engine that may die: back, it goes on from what it had saved and is told the newest samples again."""

    def __init__(self, dies_s: float | None) -> None:
        self._dies_s = dies_s
        self._config = convert({"places": list(FEET)}, PdrConfig, where="trial")
        self._core: EngineCore | None = EngineCore(self._config, _WHO, ORIGIN)
        self._saved: SavedEngine | None = None
        self._saved_ns = BEGIN_NS
        self._again: dict[Address, deque[Envelope]] = {}

    def hear(self, envelope: Envelope, at_ns: int) -> list[Envelope]:
        """What it says to a message."""
        if envelope.address.subject == "imu":
            told = self._again.setdefault(envelope.address, deque(maxlen=CACHED_SAMPLES[Qos.RECENT]))
            told.append(envelope)
        if _is_dead(self._dies_s, at_ns):
            self._core = None
            return []
        if self._core is None:
            return self._come_back()
        if at_ns - self._saved_ns >= SAVE_ENGINE_EVERY_NS:
            self._saved, self._saved_ns = self._core.remembered(), at_ns
        return list(self._core.handle(envelope))

    def _come_back(self) -> list[Envelope]:
        core = self._core = EngineCore(self._config, _WHO, ORIGIN, saved=self._saved)
        return [said for told in self._again.values() for one in told for said in core.handle(one)]


class _Player:
    """A live fusion fed in the order of arrival."""

    def __init__(self, walk: DualWalk, *, satellites: bool) -> None:
        start = {"east_m": 0.0, "north_m": 0.0, "sigma_m": 0.1, "azimuth_deg": walk.azimuth_deg}
        sources = ["gnss"] if satellites else []
        settings = {"gnss_sources": sources, "start": start | {"azimuth_sigma_deg": 1.0}}
        self._config = convert(settings, FusionConfig, where="trial")
        self._core: FusionCore | None = FusionCore(self._config, _WHO, ORIGIN)
        self._saved: Saved | None = None
        self._cache: dict[Address, deque[Envelope]] = {}
        self.positions: list[Position] = []
        self.counters: Counter[str] = Counter()

    def play(self, arrivals: list[Arrival], dies_s: float | None) -> None:
        tick_ns = arrivals[0].at_ns
        for arrival in arrivals:
            while tick_ns <= arrival.at_ns:
                self._tick(tick_ns, dies_s)
                tick_ns += _TICK_NS
            self._take(arrival.envelope)
        self._tick(arrivals[-1].at_ns + NS_PER_S, None)
        if self._core is not None:
            self._keep(self._core.close())
            self.counters += self._core.counters

    def _take(self, envelope: Envelope) -> None:
        if isinstance(envelope.message, FootStep):
            self._cache.setdefault(envelope.address, deque(maxlen=_CACHED)).append(envelope)
        if self._core is not None:
            self._keep(self._core.handle(envelope))

    def _tick(self, now_ns: int, dies_s: float | None) -> None:
        since_s = -1.0 if dies_s is None else (now_ns - BEGIN_NS) / NS_PER_S - dies_s
        if self._core is not None and 0.0 <= since_s < BACK_S:
            self.counters += self._core.counters
            self._core = None
        if self._core is None:
            if since_s >= BACK_S:
                self._restart()
            return
        self._keep(self._core.tick(now_ns))
        if now_ns % SAVE_EVERY_NS < _TICK_NS:
            self._saved = self._core.remembered()

    def _restart(self) -> None:
        self._core = FusionCore(self._config, _WHO, ORIGIN, saved=self._saved)
        for address in sorted(self._cache):
            for envelope in list(self._cache[address]):
                self._keep(self._core.handle(envelope))

    def _keep(self, said: object) -> None:
        assert isinstance(said, list)
        self.positions += [one.message for one in said if isinstance(one.message, Position)]


def _outcome(player: _Player, walk: DualWalk) -> Outcome:
    truth = walk.run.truth["body"]
    last_s = float(truth.time_s[-1])
    told = {
        one.time_ns: one
        for one in player.positions
        if _AFTER_START_S <= (one.time_ns - BEGIN_NS) / NS_PER_S <= last_s
    }
    positions = [told[time_ns] for time_ns in sorted(told)]
    seconds = np.array([(one.time_ns - BEGIN_NS) / NS_PER_S for one in positions])
    true = np.column_stack([np.interp(seconds, truth.time_s, truth.position_m[:, axis]) for axis in (0, 1)])
    error = np.array([(one.east_m, one.north_m) for one in positions]) - true
    six = np.array([one.covariance_m2 for one in positions])
    covariance = six[:, [0, 1, 1, 3]].reshape(-1, 2, 2)
    squared = np.einsum("ki,kij,kj->k", error, np.linalg.inv(covariance), error)
    inside = 100.0 * float(np.mean(squared <= _CHI2_95))
    return Outcome(positions, seconds, np.linalg.norm(error, axis=1), inside, player.counters)
