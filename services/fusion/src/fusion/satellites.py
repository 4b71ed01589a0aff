"""Satellite fixes on their way in: what is a position at all, how sure it is, and what became of it."""

import math
from collections import Counter, deque
from dataclasses import dataclass, field, replace

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from bootprint.messages import GnssFix, Vector3
from fusion.config import GnssConfig
from fusion.filter import Innovation
from fusion.models import gnss

_JUDGED = 10  # fixes, for whether a receiver's stamps are of use


@dataclass(frozen=True, slots=True)
class SatellitePosition:
    """A fix as a place in ENU, one sigma per axis in m; ``since_s``: its receiver's last accepted one."""

    time_ns: int
    source: str
    enu: Vector3
    sigma_m: float
    up_sigma_m: float | None
    since_s: float


@dataclass
class Satellites:
    """Screens fixes and remembers per receiver when one was last accepted or rejected."""

    config: GnssConfig
    origin: Origin
    counters: Counter[str]
    accepted_ns: dict[str, int] = field(default_factory=dict)
    rejected_ns: dict[str, int] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)  # of the newest rejections
    normalised_squared: float = 0.0
    _stamps: deque[bool] = field(default_factory=lambda: deque(maxlen=_JUDGED))

    def __post_init__(self) -> None:
        self._frame = LocalFrame(self.origin)

    def screen(self, source: str, fix: GnssFix) -> SatellitePosition | None:
        """The fix as a position, or None (counted) if it holds none that can be believed."""
        if not gnss.has_position(fix) or fix.latitude_deg is None or fix.longitude_deg is None:
            return self._refused("gnss_without_position")
        sigma_m = gnss.horizontal_sigma_m(fix, self.config)
        if sigma_m is None:
            return self._refused("gnss_without_accuracy")
        height_m = self.origin.height_m if fix.height_m is None else fix.height_m
        enu = self._frame.to_enu(fix.latitude_deg, fix.longitude_deg, height_m)
        if not self.is_in_range(enu):
            return self._refused("gnss_out_of_range")
        up_sigma_m = gnss.vertical_sigma_m(fix, self.config)
        return SatellitePosition(fix.time_ns, source, enu, sigma_m, up_sigma_m, self._since_s(source, fix))

    def is_in_range(self, enu: Vector3) -> bool:
        """Whether a place is near enough to the realm's origin to be meant."""
        return math.hypot(*enu) <= 1000.0 * self.config.max_range_km  # not so if it is not a number

    def note_stamp(self, *, usable: bool) -> None:
        """A fix's stamp could be made use of, or could not: too far ahead, too late."""
        self._stamps.append(usable)

    @property
    def is_mistimed(self) -> bool:
        """Whether most of the last fixes had stamps of no use."""
        return len(self._stamps) >= _JUDGED // 2 and 2 * sum(self._stamps) < len(self._stamps)

    def late(self, position: SatellitePosition, moved: Vector3, late_s: float) -> SatellitePosition:
        """A late fix as one of now: carried along by what was walked since, and the less sure by the delay."""
        east, north, up = (at + by for at, by in zip(position.enu, moved, strict=True))
        added_m = self.config.late_sigma_m_s * late_s
        up_sigma_m = None if position.up_sigma_m is None else math.hypot(position.up_sigma_m, added_m)
        sigma_m = math.hypot(position.sigma_m, added_m)
        return replace(position, enu=(east, north, up), sigma_m=sigma_m, up_sigma_m=up_sigma_m)

    def shift(self, by_ns: int) -> None:
        """The clock has been set: what was remembered by the old one."""
        for remembered in (self.accepted_ns, self.rejected_ns):
            for source in remembered:
                remembered[source] += by_ns

    def _refused(self, why: str) -> SatellitePosition | None:
        self.counters[why] += 1
        return None

    def _since_s(self, source: str, fix: GnssFix) -> float:
        last_ns = self.accepted_ns.get(source)
        return math.inf if last_ns is None else (fix.time_ns - last_ns) / NS_PER_S

    def placed_by(self, position: SatellitePosition) -> None:
        """The fix was used to place an unplaced soldier."""
        self.accepted_ns[position.source] = position.time_ns
        self.counters["gnss_accepted"] += 1

    def judge(self, position: SatellitePosition, innovation: Innovation) -> None:
        """Remember the gate's verdict on a fix."""
        self.normalised_squared = innovation.normalised_squared
        self.reasons[position.source] = "innovation"
        (self.accepted_ns if innovation.accepted else self.rejected_ns)[position.source] = position.time_ns
        self.counters["gnss_accepted" if innovation.accepted else "gnss_rejected"] += 1

    def distrust(self, position: SatellitePosition) -> None:
        """The fix is of a receiver that is not believed."""
        self.rejected_ns[position.source] = position.time_ns
        self.reasons[position.source] = "spoofed"
        self.counters["gnss_not_believed"] += 1

    def fresh(self, now_ns: int) -> tuple[str, ...]:
        """Receivers a fix of which was accepted lately."""
        return tuple(sorted(source for source, at in self.accepted_ns.items() if self._is_fresh(at, now_ns)))

    def refused(self, now_ns: int) -> tuple[str, ...]:
        """Receivers whose newest verdict is a rejection of lately."""
        return tuple(
            sorted(
                source
                for source, at in self.rejected_ns.items()
                if self._is_fresh(at, now_ns) and at > self.accepted_ns.get(source, at - 1)
            )
        )

    def why_refused(self, now_ns: int) -> dict[str, str]:
        """The same with the reasons."""
        return {source: self.reasons[source] for source in self.refused(now_ns) if source in self.reasons}

    def silent_s(self, now_ns: int) -> float:
        """Seconds since any fix was accepted; infinite if none was."""
        return min(((now_ns - at) / NS_PER_S for at in self.accepted_ns.values()), default=np.inf)

    def _is_fresh(self, at_ns: int, now_ns: int) -> bool:
        return now_ns - at_ns <= self.config.fresh_s * NS_PER_S
