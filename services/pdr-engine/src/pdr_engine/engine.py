"""The pdr-engine's core: inertial batches of a soldier's boots and body in, steps and foot poses out."""

from collections import Counter
from collections.abc import Iterable

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.figures import Figures
from bootprint.messages import GnssFix, ImuBatch, Pressure
from bootprint.topics import Identity
from pdr_engine.body.azimuth.deviation import Deviation
from pdr_engine.body.length.personal import Person
from pdr_engine.boot import Boot
from pdr_engine.config import PdrConfig
from pdr_engine.rate import NS_PER_S
from pdr_engine.trunk import Trunk

SUBJECTS = ("imu", "pressure", "gnss")
BODY = "body"


class EngineCore:
    """One soldier's boots and body-worn unit. Outputs depend on the messages alone; `tick` only tells
    figures what time it is.

    ``origin`` is the realm's: with it, steps tell magnetic azimuths from true north.
    """

    def __init__(self, config: PdrConfig, identity: Identity, origin: Origin | None = None) -> None:
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
        unit = self._units.get(envelope.address.source)
        if unit is None or not isinstance(envelope.message, ImuBatch):
            self._counters["other_places"] += 1
            return []
        return list(unit.handle(envelope.message))

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
        return Figures("degraded" if notes else "ok", counters=counters, gauges=gauges, note="; ".join(notes))

    def _is_silent(self, unit: Boot | Trunk) -> bool:
        if self._now_ns is None or unit.newest_ns is None:
            return False
        return self._now_ns - unit.newest_ns > self._silent_after_ns
