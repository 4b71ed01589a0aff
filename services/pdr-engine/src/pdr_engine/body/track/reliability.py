"""How far the answer can be relied on: redundancy percentages and external reliability (METHODS A9, A10).

Redundancy is the share of the information that is checked by other information, by the PNM's tables 2 and 3; where
the tables know recent and long ago, it falls evenly between. External reliability is what the largest disturbance
that would have passed unnoticed does to the position (after Baarda 1968). Sources that say the same are compared
all the time; the one that the others contradict is rejected and reported.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

RECENT_S, LONG_S = 30.0, 120.0  # since the gyro's bias was updated: the source bridges two minutes at most
BAROMETER_S = 1800.0  # after which weather may have moved a barometer by metres
FIX_S = 5.0  # for which a fix counts as there
STEP_MODEL_M = 5000.0  # walked since the step model was calibrated, after which it counts no more
UNNOTICED_LEAST_RAD, UNNOTICED_MOST_RAD = math.radians(2.0), math.radians(10.0)
GATE_SIGMAS = 3.5  # beyond which a source is rejected


def azimuth_redundancy_pct(disturbed: bool, since_bias_update_s: float, gnss_azimuth: bool) -> float:
    """Table 2: 0, 25, 50 or 75 % and 25 % more with a satellite azimuth; falling while the bias update ages."""
    recent = 25.0 * _fading(since_bias_update_s, RECENT_S, LONG_S)
    return (0.0 if disturbed else 50.0) + recent + (25.0 if gnss_azimuth else 0.0)


def planimetry_redundancy_pct(
    satellites: bool, walked_since_calibration_m: float | None, azimuth_pct: float
) -> float:
    """Table 3: half for satellites; without, half as far as step model *and* azimuth can be relied on.

    ``walked_since_calibration_m``: None for a step model that never was calibrated.
    """
    model = 0.0
    if walked_since_calibration_m is not None:
        model = 50.0 * _fading(walked_since_calibration_m, 0.0, STEP_MODEL_M)
    return (50.0 if satellites else 0.0) + model * min(azimuth_pct / 50.0, 1.0)


def altimetry_redundancy_pct(satellites: bool, since_reference_s: float | None) -> float:
    """Table 3: half for satellites, half for a barometer, falling with the time since a known height."""
    barometer = 0.0 if since_reference_s is None else 50.0 * _fading(since_reference_s, 0.0, BAROMETER_S)
    return (50.0 if satellites else 0.0) + barometer


def unnoticed_rad(redundancy_pct: float) -> float:
    """The largest azimuth disturbance that would pass unnoticed: the less is checked, the larger (A9: 2 to 10°)."""
    share = min(max(redundancy_pct, 0.0), 100.0) / 100.0
    return UNNOTICED_MOST_RAD + share * (UNNOTICED_LEAST_RAD - UNNOTICED_MOST_RAD)


def _fading(age: float, whole: float, gone: float) -> float:
    """1 up to an age, 0 from another on, evenly between."""
    return min(max((gone - age) / (gone - whole), 0.0), 1.0)


class ExternalReliability:
    """Position error, m, that disturbances which nobody noticed may have made since the last absolute fix.

    An azimuth that is off by ε over steps of length l shifts the track by 2·l·sin(ε/2) a step, all to one side:
    shifts add up, and stay when the disturbance ends.
    """

    def __init__(self) -> None:
        self.planimetry_m = 0.0

    def step(self, length_m: float, redundancy_pct: float) -> float:
        """A step on; the effect so far."""
        self.planimetry_m += 2.0 * length_m * math.sin(0.5 * unnoticed_rad(redundancy_pct))
        return self.planimetry_m

    def fix(self, accuracy_m: float) -> None:
        """An absolute position bounds it."""
        self.planimetry_m = min(self.planimetry_m, accuracy_m)


@dataclass(frozen=True, slots=True)
class Reliability:
    """At a step: redundancy of azimuth, planimetry and altimetry, %, and external reliability, m."""

    azimuth_pct: float
    planimetry_pct: float
    altimetry_pct: float
    external_m: float


class Reliance:
    """Keeps the times that the tables ask for, from what the navigator sees."""

    def __init__(self, calibrated: bool) -> None:
        self._external = ExternalReliability()
        self._bias_ns: int | None = None
        self._fix_ns: int | None = None
        self._walked_m = 0.0 if calibrated else None

    def bias_updated(self, time_ns: int) -> None:
        """A clean compass, or standing still, has told the gyro's bias."""
        self._bias_ns = time_ns

    def calibrated(self) -> None:
        """Satellites have told the step model."""
        self._walked_m = 0.0

    def fix(self, time_ns: int, accuracy_m: float) -> None:
        """A satellite fix."""
        self._fix_ns = time_ns
        self._external.fix(accuracy_m)

    def step(
        self, time_ns: int, length_m: float, disturbed: bool, gnss_azimuth: bool, reference_ns: int | None
    ) -> Reliability:
        """A step on. ``reference_ns``: when a height last came from outside."""
        if self._walked_m is not None:
            self._walked_m += length_m
        since_bias_s = _since_s(time_ns, self._bias_ns)
        azimuth = azimuth_redundancy_pct(
            disturbed, math.inf if since_bias_s is None else since_bias_s, gnss_azimuth
        )
        fix_s = _since_s(time_ns, self._fix_ns)
        satellites = fix_s is not None and fix_s < FIX_S
        return Reliability(
            azimuth,
            planimetry_redundancy_pct(satellites, self._walked_m, azimuth),
            altimetry_redundancy_pct(satellites, _since_s(time_ns, reference_ns)),
            self._external.step(length_m, azimuth),
        )


def _since_s(time_ns: int, then_ns: int | None) -> float | None:
    return None if then_ns is None else max(0.0, (time_ns - then_ns) * 1e-9)


@dataclass(frozen=True, slots=True)
class Consensus:
    """What sources agree on: ``value`` with its ``sigma``, and the names of those ``rejected``."""

    value: float
    sigma: float
    rejected: tuple[str, ...]


def agreed(sources: Mapping[str, tuple[float, float]], circle: bool = False) -> Consensus | None:
    """The weighted mean of values with their sigmas, without those that the others contradict (A10); None of none.

    ``circle``: the values are angles, rad. Two that contradict each other cannot tell who errs: both stay, and the
    sigma is widened by what is between them. With three or more the one farthest off goes, one at a time.
    """
    kept, rejected = dict(sources), list[str]()
    while len(kept) > 2:
        worst = max(kept, key=lambda name: _contradiction(name, kept, circle))
        if _contradiction(worst, kept, circle) <= GATE_SIGMAS:
            break
        rejected.append(worst)
        del kept[worst]
    if not kept:
        return None
    value, sigma = _mean(kept, circle)
    spread = max(_contradiction(name, kept, circle) for name in kept) if len(kept) == 2 else 0.0
    return Consensus(value, sigma * max(1.0, spread), tuple(rejected))


def _contradiction(name: str, sources: Mapping[str, tuple[float, float]], circle: bool) -> float:
    """By how many sigmas a source is off the mean of the others."""
    others, sigma = _mean({key: one for key, one in sources.items() if key != name}, circle)
    apart = sources[name][0] - others
    return abs(math.remainder(apart, math.tau) if circle else apart) / math.hypot(sources[name][1], sigma)


def _mean(sources: Mapping[str, tuple[float, float]], circle: bool) -> tuple[float, float]:
    """Weighted by inverse variance; of angles around the surest one."""
    weights = {name: 1.0 / sigma**2 for name, (_, sigma) in sources.items()}
    total = sum(weights.values())
    centre = sources[max(weights, key=lambda name: weights[name])][0]
    apart = {
        name: math.remainder(value - centre, math.tau) if circle else value - centre
        for name, (value, _) in sources.items()
    }
    mean = centre + sum(weights[name] * apart[name] for name in sources) / total
    return (math.remainder(mean, math.tau) if circle else mean), 1.0 / math.sqrt(total)
