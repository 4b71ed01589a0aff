"""The pdr-engine's core: inertial batches of a soldier's boots and body in, steps and foot poses out."""

from collections import Counter
from collections.abc import Callable, Iterable
from functools import cached_property, partial

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.figures import Figures
from bootprint.messages import GnssFix, ImuBatch, Pressure
from bootprint.topics import Identity
from pdr_engine.body.azimuth.deviation import Deviation
from pdr_engine.body.length.personal import Person
from pdr_engine.boot import Boot
from pdr_engine.config import PdrConfig
from pdr_engine.memory import Saved, is_of_now, newest_ns, owner_of
from pdr_engine.rate import NS_PER_S
from pdr_engine.trunk import Trunk

SUBJECTS = ("imu", "pressure", "gnss")
BODY = "body"


class EngineCore:
    """One soldier's boots and body-worn unit. Outputs depend on the messages alone; `tick` only tells
    figures what time it is.

    ``origin`` is the realm's: with it, steps tell magnetic azimuths from true north. ``saved`` is what an earlier
    engine left (`remembered`); it is gone on from if the first samples are of its time.
    """

    def __init__(
        self,
        config: PdrConfig,
        identity: Identity,
        origin: Origin | None = None,
        saved: Saved | None = None,
    ) -> None:
        self._config, self._identity = config, identity
        self._saved = saved  # until the first sample
        self._refusal: list[str] = []
        self._boots = {
            place: Boot(config.foot, identity.address("imu", place), config.pose_interval_s, origin)
            for place in config.feet
        }
        self._trunk = (
            Trunk(config.body, identity.address("imu", BODY), origin) if BODY in config.places else None
        )
        self._silent_after_ns = round(config.silent_after_s * NS_PER_S)
        self._now_ns: int | None = None
        self._counters: Counter[str] = Counter(other_places=0)

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        """Take a batch of a unit in; batches of other places are counted and left to others.

        Pressure and satellite fixes are the body-worn unit's, wherever they come from.
        """
        if self._trunk is not None and isinstance(envelope.message, Pressure):
            self._trunk.hear_pressure(envelope.message)
            return []
        if self._trunk is not None and isinstance(envelope.message, GnssFix):
            self._trunk.hear_fix(envelope.message)
            return []
        if self._saved is not None and isinstance(envelope.message, ImuBatch):
            self._go_on(self._saved, envelope.message.time_ns)
            self._saved = None
        unit = self._units.get(envelope.address.source)
        if unit is None or not isinstance(envelope.message, ImuBatch):
            self._counters["other_places"] += 1
            return []
        return list(unit.handle(envelope.message))

    def _go_on(self, saved: Saved, time_ns: int) -> None:
        """Go on from what was saved, if it is of now; a unit whose record is none begins anew alone."""
        if not is_of_now(saved, time_ns):
            self._refuse(f"it is {round((time_ns - saved.time_ns) / NS_PER_S)} s old")
            return
        for place, boot in saved.boots.items():
            self._unit_goes_on(partial(self._boots[place].go_on, boot))
        if self._trunk is not None and saved.trunk is not None:
            self._unit_goes_on(partial(self._trunk.go_on, saved.trunk))

    def _unit_goes_on(self, go_on: Callable[[], None]) -> None:
        try:
            go_on()
        except ValueError as error:
            self._refuse(str(error))
        else:
            self._counters["memory_gone_on_from"] += 1

    def _refuse(self, reason: str) -> None:
        self._counters["memory_refused"] += 1
        self._refusal.append(f"saved state not gone on from: {reason}")

    def remembered(self) -> Saved | None:
        """What a restart could go on from; None before the first sample."""
        if self._saved is not None:
            return None  # what an earlier engine left is still the newest
        told = {place: boot.remembered() for place, boot in self._boots.items()}
        boots = {place: boot for place, boot in told.items() if boot is not None}
        trunk = None if self._trunk is None else self._trunk.remembered()
        time_ns = newest_ns(boots, trunk)
        if time_ns is None:
            return None
        return Saved(owner=self._owner, time_ns=time_ns, boots=boots, trunk=trunk)

    @cached_property
    def _owner(self) -> str:
        return owner_of(self._config, self._identity)

    @property
    def _units(self) -> dict[str, Boot | Trunk]:
        return {**self._boots, **({} if self._trunk is None else {BODY: self._trunk})}

    @property
    def person(self) -> Person | None:
        """What is known of the person's step length, once satellites have told something; else None."""
        return None if self._trunk is None else self._trunk.person

    @property
    def deviations(self) -> tuple[Deviation, ...]:
        """Compass deviations by place, as far as they are mapped."""
        return () if self._trunk is None else self._trunk.deviations

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        """Note the time: silence shows in the figures."""
        self._now_ns = now_ns
        return []

    def close(self) -> Iterable[Envelope]:
        """The end: what still waited for later samples."""
        return [envelope for boot in self._boots.values() for envelope in boot.close()]

    def figures(self) -> Figures:
        """Counts and rates per place; degraded when a unit is silent, or a boot's sensors contradict each other."""
        counters = dict(self._counters)
        gauges = {}
        for place, unit in self._units.items():
            counters |= {f"{place}_{name}": value for name, value in unit.counters().items()}
            gauges[f"{place}_rate_hz"] = unit.rate_hz
        silent = [place for place, unit in self._units.items() if self._is_silent(unit)]
        wrong = [place for place, boot in self._boots.items() if boot.contradicts_itself]
        notes = [f"silent: {', '.join(silent)}"] if silent else []
        notes += [f"axes or units contradict each other: {', '.join(wrong)}"] if wrong else []
        note = "; ".join(notes + self._refusal)
        return Figures("degraded" if notes else "ok", counters=counters, gauges=gauges, note=note)

    def _is_silent(self, unit: Boot | Trunk) -> bool:
        if self._now_ns is None or unit.newest_ns is None:
            return False
        return self._now_ns - unit.newest_ns > self._silent_after_ns
