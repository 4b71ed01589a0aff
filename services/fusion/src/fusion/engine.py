"""The fusion core: inputs put in order, events to the estimator, a `Position` at every multiple of 0.2 s.

What comes too late to be put in order follows one rule a kind, and is counted:

- a **FootStep** still happened: it is composed at once, onto what the foot has become meanwhile;
- a **Fix** is a person's word: it is taken at once, the less sure by what may have been walked since;
- a **FootPose** or **GnssFix** is dropped: the next one comes soon.

A position at t is published when everything up to t + ``lookahead_s`` has been taken in, so that it lies between
two foot poses instead of up to a tenth of a second behind. So it depends on the messages alone, not on when ticks
come.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Origin
from bootprint.figures import Figures
from bootprint.messages import Fix, FootPose, FootStep, GnssFix, Message
from bootprint.topics import Address, Identity
from fusion.config import FusionConfig
from fusion.estimator import Estimator
from fusion.output import Publisher, horizontal_sigma_m
from fusion.reorder import Arrival, Promise, ReorderBuffer, Waiting

SUBJECTS = ("foot_step", "foot_pose", "gnss", "fix")  # at one time in this order: a step before its own poses
SOURCE = "fusion"
_LONGEST_LEAP_NS = 60 * NS_PER_S  # after a longer hole in time the positions between are not made up


class FusionCore:
    """One soldier's fusion; pure: the same messages give the same positions."""

    def __init__(self, config: FusionConfig, identity: Identity, origin: Origin) -> None:
        self.counters: Counter[str] = Counter()
        self.estimator = Estimator(config, origin, self.counters)
        self._config = config
        self._address = identity.address("position", SOURCE)
        self._publisher = Publisher(origin, config.floor_height_m)
        self._buffer = _buffer(config)
        self._period_ns = round(NS_PER_S / config.rate_hz)
        self._lookahead_ns = round(config.lookahead_s * NS_PER_S)
        self._stance_delay_ns = round(config.stance_delay_s * NS_PER_S)
        self._next_ns: int | None = None  # the next position's time
        self._apply: dict[str, Callable[[str, Message], None]] = {
            "foot_step": self._step,
            "foot_pose": self._pose,
            "gnss": self._gnss,
            "fix": self._fix,
        }

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        """Take a message of this soldier in; the positions that have become due."""
        address, message = envelope.address, envelope.message
        if address.subject not in self._apply or not self._is_known(address):
            self.counters["unknown_sources"] += 1
            return []
        self.counters[f"{address.subject}_messages"] += 1
        source = _source(address.subject, address.source)
        arrival = self._buffer.push(source, message, self._promise(address, message))
        if arrival is Arrival.LATE:
            self._late(source, message)
        elif arrival is not Arrival.QUEUED:
            self.counters[arrival.value] += 1
        return list(self._drain())

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        """Event time is ``now_ns``: positions that silent boots have held back for long enough."""
        self._buffer.advance(now_ns)
        return list(self._drain())

    def close(self) -> Iterable[Envelope]:
        """Nothing more will come: what is still held back."""
        self._buffer.flush()
        return [*self._drain(), *self._due(self._buffer.low_ns)]

    def figures(self) -> Figures:
        """Counters, and how sure the position is now."""
        gauges = {
            "waiting": float(len(self._buffer)),
            "gnss_nis": self.estimator.satellites.normalised_squared,
        }
        if self._next_ns is None:
            return Figures("starting", dict(self.counters), gauges, "no input yet")
        estimate = self.estimator.estimate(self._next_ns - self._period_ns)
        gauges["sigma_m"] = horizontal_sigma_m(estimate.covariance)
        degraded = estimate.mode in ("unplaced", "coasting", "lost")
        return Figures("degraded" if degraded else "ok", dict(self.counters), gauges, estimate.mode)

    # --- in ----------------------------------------------------------------------------------------------------

    def _is_known(self, address: Address) -> bool:
        return not address.subject.startswith("foot_") or address.source in self._config.feet

    def _promise(self, address: Address, message: Message) -> Promise | None:
        """A pose tells that no step earlier than itself is still to come, but for the stance detector's delay."""
        if not isinstance(message, FootPose):
            return None
        until_ns = message.time_ns - self._stance_delay_ns
        return Promise(_source("foot_step", address.source), message.step_sequence, until_ns)

    def _late(self, source: str, message: Message) -> None:
        _, subject, name = source.split("/", 2)
        self.counters[f"late_{subject}"] += 1
        if subject == "foot_step":
            self._step(name, message)
        elif isinstance(message, Fix):
            self.estimator.fix(message, late_s=(self._buffer.low_ns - message.time_ns) / NS_PER_S)

    def _step(self, name: str, message: Message) -> None:
        if isinstance(message, FootStep):
            self.estimator.step(name, message)

    def _pose(self, name: str, message: Message) -> None:
        if isinstance(message, FootPose):
            self.estimator.pose(name, message)

    def _gnss(self, name: str, message: Message) -> None:
        if isinstance(message, GnssFix):
            self.estimator.gnss(name, message)

    def _fix(self, _: str, message: Message) -> None:
        if isinstance(message, Fix):
            self.estimator.fix(message)

    # --- out ---------------------------------------------------------------------------------------------------

    def _drain(self) -> Iterator[Envelope]:
        """Take in what is in order now; positions as they become due between."""
        for waiting in self._buffer.release():
            yield from self._due(waiting.time_ns - self._lookahead_ns)
            self._take(waiting)
        yield from self._due(self._buffer.low_ns - self._lookahead_ns)

    def _take(self, waiting: Waiting) -> None:
        if self._next_ns is None:
            self.estimator.begin(waiting.time_ns)
            self._next_ns = -(-waiting.time_ns // self._period_ns) * self._period_ns
        _, subject, name = waiting.source.split("/", 2)
        self._apply[subject](name, waiting.message)

    def _due(self, before_ns: int) -> Iterator[Envelope]:
        """The positions of all grid times before ``before_ns``."""
        if self._next_ns is None:
            return
        if before_ns - self._next_ns > _LONGEST_LEAP_NS:
            self._next_ns = (before_ns - _LONGEST_LEAP_NS) // self._period_ns * self._period_ns
            self.counters["leaps"] += 1
        while self._next_ns < before_ns:
            estimate = self.estimator.estimate(self._next_ns)
            yield Envelope(self._address, self._publisher.position(self._next_ns, estimate))
            self._next_ns += self._period_ns


def _source(subject: str, name: str) -> str:
    """How a source is called in the reorder buffer, which sorts by it where times are equal."""
    return f"{SUBJECTS.index(subject)}/{subject}/{name}"


def _buffer(config: FusionConfig) -> ReorderBuffer:
    """The reorder buffer: the feet drive time, receivers are waited for."""
    feet = {_source(subject, place) for subject in ("foot_step", "foot_pose") for place in config.feet}
    receivers = {_source("gnss", source) for source in config.gnss_sources}
    return ReorderBuffer(
        window_ns=round(config.reorder_window_s * NS_PER_S),
        drivers=frozenset(feet),
        expected=frozenset(feet | receivers),
        patience_ns=round(config.silence.patience_s * NS_PER_S),
    )
