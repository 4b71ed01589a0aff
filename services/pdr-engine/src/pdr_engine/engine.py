"""The pdr-engine's core: inertial batches of a soldier's boots in, foot steps and foot poses out."""

from collections import Counter
from collections.abc import Iterable

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.figures import Figures
from bootprint.messages import ImuBatch
from bootprint.topics import Identity
from pdr_engine.boot import NS_PER_S, Boot
from pdr_engine.config import PdrConfig

SUBJECTS = ("imu",)


class EngineCore:
    """One soldier's boots. Outputs depend on the messages alone; `tick` only tells figures what time it is.

    ``origin`` is the realm's: with it, steps tell magnetic azimuths from true north.
    """

    def __init__(self, config: PdrConfig, identity: Identity, origin: Origin | None = None) -> None:
        self._boots = {
            place: Boot(config.foot, identity.address("imu", place), config.pose_interval_s, origin)
            for place in config.feet
        }
        self._silent_after_ns = round(config.silent_after_s * NS_PER_S)
        self._now_ns: int | None = None
        self._counters: Counter[str] = Counter(other_places=0)

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        """Take a batch of a boot in; batches of other places are counted and left to others."""
        boot = self._boots.get(envelope.address.source)
        if boot is None or not isinstance(envelope.message, ImuBatch):
            self._counters["other_places"] += 1
            return []
        return list(boot.handle(envelope.message))

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        """Note the time: silence shows in the figures."""
        self._now_ns = now_ns
        return []

    def close(self) -> Iterable[Envelope]:
        """The end: what still waited for later samples."""
        return [envelope for boot in self._boots.values() for envelope in boot.close()]

    def figures(self) -> Figures:
        """Counts and rates per place; degraded when a boot is silent, or its sensors contradict each other."""
        counters = dict(self._counters)
        gauges = {}
        for place, boot in self._boots.items():
            counters |= {f"{place}_{name}": value for name, value in boot.counters().items()}
            gauges[f"{place}_rate_hz"] = boot.rate_hz
        silent = [place for place, boot in self._boots.items() if self._is_silent(boot)]
        wrong = [place for place, boot in self._boots.items() if boot.contradicts_itself]
        notes = [f"silent: {', '.join(silent)}"] if silent else []
        notes += [f"axes or units contradict each other: {', '.join(wrong)}"] if wrong else []
        return Figures("degraded" if notes else "ok", counters=counters, gauges=gauges, note="; ".join(notes))

    def _is_silent(self, boot: Boot) -> bool:
        if self._now_ns is None or boot.newest_ns is None:
            return False
        return self._now_ns - boot.newest_ns > self._silent_after_ns
