"""The fusion core: inputs put in order, events to the estimator, a `Position` at every multiple of 0.2 s.

What comes too late to be put in order follows one rule a kind, and is counted:

- a **FootStep** or **BodyStep** still happened: it is composed at once, onto what the foot has become meanwhile;
- a **Fix** is a person's word: it is taken at once, the less sure by what may have been walked since;
- a **GnssFix** is carried along by what the feet have walked since, if that is remembered, else dropped;
- a **FootPose**, **Pressure**, **Range** or **CameraMotion** is dropped: the next one comes soon.

A **Track** is of another's time and says how old it is: it is taken as it comes, past the order of the own inputs.

A position at t is published when everything up to t + ``lookahead_s`` has been taken in, so that it lies between
two foot poses instead of up to a tenth of a second behind. So it depends on the messages alone, not on when ticks
come. A ``patient`` core (replay as fast as possible) waits for everybody, whatever ticks say, to its close.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Origin
from bootprint.figures import Figures
from bootprint.messages import (
    BodyStep,
    CameraMotion,
    Fix,
    FootPose,
    FootStep,
    GnssFix,
    Message,
    Mode,
    Position,
    Pressure,
    Range,
    Track,
)
from bootprint.rooms import RoomMap
from bootprint.topics import Address, Identity
from fusion.config import FusionConfig
from fusion.estimator import Estimator
from fusion.feet_ranging import hold_feet, is_between_feet
from fusion.memory import Moment, Saved, age_in_words, go_on, is_of_now, remember
from fusion.output import Publisher, horizontal_sigma_m
from fusion.pulse import LivePulse, ReplayPulse
from fusion.reorder import Arrival, Promise, ReorderBuffer, Waiting
from fusion.rooms.aid import RoomAid
from fusion.rooms.survey import Survey, stood_at

SUBJECTS = (
    "foot_step",
    "foot_pose",
    "gnss",
    "fix",
    "pressure",
    "body_step",
    "camera_motion",
    "range",
    "track",
)  # at one time in this order: a step before its own poses
SOURCE = "fusion"
_STEADY = frozenset(
    {"gnss", "camera_motion", "pressure"}
)  # they keep a rhythm, and come too late if not waited for
_LONGEST_LEAP_NS = 60 * NS_PER_S  # after a longer hole in time the positions between are not made up


class FusionCore:
    """One soldier's fusion; pure: the same messages give the same positions."""

    def __init__(
        self,
        config: FusionConfig,
        identity: Identity,
        origin: Origin,
        *,
        patient: bool = False,
        saved: Saved | None = None,
        mapped: RoomMap | None = None,
    ) -> None:
        self.counters: Counter[str] = Counter()
        self.estimator = Estimator(config, origin, self.counters)
        self.survey = Survey(config.rooms, identity.soldier, mapped)
        self._rooms = RoomAid(config.rooms, config.floor_height_m, self.counters)
        self._config = config
        self._address = identity.address("position", SOURCE)
        self._publisher = Publisher(origin, config.floor_height_m)
        self._buffer = _buffer(config, patient)
        self._period_ns = round(NS_PER_S / config.rate_hz)
        self._lookahead_ns = round(config.lookahead_s * NS_PER_S)
        self._stance_delay_ns = round(config.stance_delay_s * NS_PER_S)
        self._next_ns: int | None = None  # the next position's time
        self._saved = saved  # until the first message
        self._refusal = ""
        self._apply: dict[str, Callable[[str, Message], None]] = {
            "foot_step": self._step,
            "foot_pose": self._pose,
            "gnss": self._gnss,
            "fix": self._fix,
            "pressure": self._pressure,
            "body_step": self._body_step,
            "camera_motion": self._camera_motion,
            "range": self._range,
        }

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        """Take a message of this soldier in; the positions that have become due."""
        address, message = envelope.address, envelope.message
        if isinstance(message, Track):
            self.estimator.cooperation.track(message)
            return []
        if isinstance(message, RoomMap):
            self._hear_rooms(message)
            return []
        if address.subject not in self._apply or not self._is_known(address):
            self.counters["unknown_sources"] += 1
            return []
        self.counters[f"{address.subject}_messages"] += 1
        if self._is_had(address, message):
            self.counters["duplicate_steps"] += 1
            return []
        source = _source(address.subject, address.source)
        arrival = self._buffer.push(source, message, self._promise(address, message))
        if arrival is Arrival.LATE:
            self._late(source, message)
        elif arrival is not Arrival.QUEUED:
            self.counters[arrival.value] += 1
        if arrival is Arrival.IMPLAUSIBLE and address.subject == "gnss":
            self.estimator.satellites.note_stamp(usable=False)
        set_back_ns = self._buffer.set_back_ns
        return list(self._drain() if set_back_ns is None else self._follow_back(set_back_ns))

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
            "evicted": float(self._buffer.evicted),
            "gnss_nis": self.estimator.satellites.normalised_squared,
        }
        if self._next_ns is None:
            return Figures("starting", dict(self.counters), gauges, "no input yet")
        estimate = self.estimator.estimate(self._next_ns - self._period_ns)
        gauges["sigma_m"] = horizontal_sigma_m(estimate.covariance)
        complaints = self._complaints(estimate.mode)
        degraded = bool(complaints) or estimate.mode in ("unplaced", "coasting", "lost")
        note = "; ".join((estimate.mode, *complaints))
        return Figures("degraded" if degraded else "ok", dict(self.counters), gauges, note)

    def _complaints(self, mode: Mode) -> list[str]:
        """What somebody should look after, in words."""
        words = [self._refusal] if self._refusal else []
        if self.estimator.satellites.is_mistimed:
            words.append("most satellite fixes are stamped too late or too far ahead")
        if mode == "unplaced" and self.counters["start_refused"]:
            words.append("joined a walk under way: start not taken, waiting for satellites or a fix")
        return words

    # --- in ----------------------------------------------------------------------------------------------------

    def _hear_rooms(self, rooms: RoomMap) -> None:
        """Another's map; one's own comes back from the bus."""
        if rooms.soldier != self._address.soldier:
            self.counters["rooms_messages"] += 1
            self._rooms.hear(rooms)

    def _is_known(self, address: Address) -> bool:
        return not address.subject.startswith("foot_") or address.source in self._config.feet

    def _is_had(self, address: Address, message: Message) -> bool:
        """Whether this is a step that was taken before, perhaps by the process before this one."""
        if not address.subject.startswith(("foot_", "camera_")):
            return False
        if self._saved is not None:
            self._go_on(self._saved, message.time_ns)
            self._saved = None
        return isinstance(message, FootStep) and self.estimator.boots.has_had(address.source, message)

    def _go_on(self, saved: Saved, time_ns: int) -> None:
        """Go on from what was saved, if it is of now."""
        if not is_of_now(saved, time_ns, self._config):
            self.counters["memory_refused"] += 1
            self._refusal = f"saved state not gone on from: it is {age_in_words(saved, time_ns)}"
            return
        self.estimator.begin(saved.time_ns)
        go_on(self.estimator, saved)
        self._next_ns, self._publisher.sequence = saved.next_ns, saved.sequence
        self.counters["memory_gone_on_from"] += 1

    def _promise(self, address: Address, message: Message) -> Promise | None:
        """A pose tells that no step earlier than itself is still to come, but for the stance detector's delay."""
        if not isinstance(message, FootPose):
            return None
        until_ns = message.time_ns - self._stance_delay_ns
        return Promise(_source("foot_step", address.source), message.step_sequence, until_ns)

    def _late(self, source: str, message: Message) -> None:
        _, subject, name = source.split("/", 2)
        self.counters[f"late_{subject}"] += 1
        late_s = (self._buffer.low_ns - message.time_ns) / NS_PER_S
        if subject in ("foot_step", "body_step"):
            self._apply[subject](name, message)
        elif isinstance(message, Fix):
            self.estimator.fix(message, late_s)
        elif isinstance(message, GnssFix):
            self.estimator.gnss(name, message, late_s)

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

    def _pressure(self, _: str, message: Message) -> None:
        if isinstance(message, Pressure):
            self.estimator.pressure(message)

    def _body_step(self, _: str, message: Message) -> None:
        if isinstance(message, BodyStep):
            self.estimator.body_step(message)

    def _camera_motion(self, name: str, message: Message) -> None:
        if isinstance(message, CameraMotion):
            self.estimator.camera_motion(name, message)
            if self.estimator.sight is not None and self._config.rooms.map:
                self.survey.see(self.estimator.sight)

    def _range(self, _: str, message: Message) -> None:
        if not isinstance(message, Range):
            return
        if is_between_feet(message, self._address.soldier):
            hold_feet(self.estimator.boots, message, self._config, self.counters)
        elif self._config.peers.use:
            self.estimator.range(message)

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

    def remembered(self) -> Saved | None:
        """What a restart could go on from; None before the soldier is placed."""
        if self._next_ns is None:
            return None
        moment = Moment(self._buffer.low_ns, self._next_ns, self._publisher.sequence)
        return remember(self.estimator, self._config, self._address.soldier, moment)

    def _due(self, before_ns: int) -> Iterator[Envelope]:
        """The positions of all grid times before ``before_ns``."""
        if self._next_ns is None:
            return
        if before_ns - self._next_ns > _LONGEST_LEAP_NS:
            self._next_ns = (before_ns - _LONGEST_LEAP_NS) // self._period_ns * self._period_ns
            self.counters["leaps"] += 1
        while self._next_ns < before_ns:
            time_ns = self._next_ns
            self._next_ns += self._period_ns  # first, so that no error can hold time at this position
            position = self._publisher.position(time_ns, self.estimator.estimate(time_ns))
            yield Envelope(self._address, position)
            yield from self._map_rooms(position)

    def _map_rooms(self, position: Position) -> Iterator[Envelope]:
        """Draw the map of rooms on, tell it when it is due; others' maps hold the walk."""
        rooms = self._config.rooms
        if rooms.map:
            self.survey.walk(stood_at(position, self._config.floor_height_m, rooms))
            drawn = self.survey.due(position.time_ns)
            if drawn is not None:
                self.counters["rooms_told"] += 1
                self.counters["rooms_full"] = int(self.survey.full)
                yield Envelope(self._address.with_subject("rooms"), drawn)
        if rooms.use:
            self.estimator.held_by(lambda boots: self._rooms.hold(boots, position))

    def _follow_back(self, time_ns: int) -> Iterator[Envelope]:
        """The boots' clock has been set back: finish the old time, and go on with everything in the new."""
        self.counters["clock_set_back"] += 1
        self._buffer.flush()
        yield from self._drain()
        self.estimator.shift(self._buffer.restart(time_ns))
        self._next_ns = None
        yield from self._drain()


def _source(subject: str, name: str) -> str:
    """How a source is called in the reorder buffer, which sorts by it where times are equal."""
    return f"{SUBJECTS.index(subject)}/{subject}/{name}"


def _buffer(config: FusionConfig, patient: bool) -> ReorderBuffer:
    """The reorder buffer: the feet drive time, receivers are waited for."""
    feet = frozenset(
        _source(subject, place) for subject in ("foot_step", "foot_pose") for place in config.feet
    )
    expected = feet | {_source("gnss", source) for source in config.gnss_sources}
    if patient:
        return ReorderBuffer(ReplayPulse(feet), expected, capacity=None)
    window_ns = round(config.reorder_window_s * NS_PER_S)
    pulse = LivePulse(feet, window_ns, round(config.silence.patience_s * NS_PER_S))
    return ReorderBuffer(pulse, expected, is_steady=lambda source: source.split("/")[1] in _STEADY)
