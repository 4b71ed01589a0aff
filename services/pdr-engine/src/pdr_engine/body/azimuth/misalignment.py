"""METHODS B4: the constant angle between the azimuth that unit and compass tell and the one that is walked.

A single fix errs too much to tell a direction. Three in a row, each weighed by its stated accuracy, give a *virtual
position*, and the steps up to those fixes the same for the walked track. From one virtual position to another,
straight on, satellites and steps each tell an azimuth; the angle between them is a scalar Kalman state.
"""

import math
from collections import deque
from dataclasses import dataclass

FIXES = 3
WORST_ACCURACY_M = 10.0
LEAST_DISTANCE_M = 15.0
LONGEST_S = 60.0
STRAIGHT = 0.95  # net distance over the steps' sum
STEPS_SIGMA_RAD = 0.1  # of the steps' own direction over a stretch
PRIOR_SIGMA_RAD = 0.5
WALK_RAD_PER_STRETCH = 0.02  # units slip, hands shift
FRESH_S = 15.0
_GATE = 3.0
_NS = 1e-9


@dataclass(frozen=True, slots=True)
class _Virtual:
    """Centroids of fixes and of the walked track, m; ``path_m`` walked until then; ``sigma_m`` of the fixes'."""

    time_ns: int
    fixed_m: tuple[float, float]
    walked_m: tuple[float, float]
    path_m: float
    sigma_m: float


@dataclass(frozen=True, slots=True)
class _Fix:
    time_ns: int
    fixed_m: tuple[float, float]
    walked_m: tuple[float, float]
    path_m: float
    accuracy_m: float


class Misalignment:
    """Follows the angle, clockwise, that has to be added to what unit and compass tell."""

    def __init__(self) -> None:
        self.angle_rad = 0.0
        self._variance = PRIOR_SIGMA_RAD**2
        self._walked = (0.0, 0.0)
        self._path_m = 0.0
        self._fixes: deque[_Fix] = deque(maxlen=FIXES)
        self._anchor: _Virtual | None = None
        self._azimuth: tuple[int, float] | None = None
        self.stretches = 0

    def sigma_at(self, time_ns: int, drift_rad_s: float) -> float:
        """One sigma of the angle so long after the last stretch, for an azimuth that drifts."""
        since_s = 0.0 if self._azimuth is None else (time_ns - self._azimuth[0]) * _NS
        return math.hypot(math.sqrt(self._variance), drift_rad_s * since_s)

    def satellite_azimuth(self, time_ns: int) -> float | None:
        """What the newest stretch between virtual positions told, while it is fresh."""
        if self._azimuth is None or (time_ns - self._azimuth[0]) * _NS > FRESH_S:
            return None
        return self._azimuth[1]

    def walk(self, length_m: float, azimuth_rad: float) -> None:
        """Another step by what unit and compass tell, without this angle."""
        east, north = self._walked
        self._walked = (east + length_m * math.sin(azimuth_rad), north + length_m * math.cos(azimuth_rad))
        self._path_m += length_m

    def fix(self, time_ns: int, east_m: float, north_m: float, accuracy_m: float) -> None:
        """A satellite fix in a local frame; bad ones are passed over."""
        if accuracy_m > WORST_ACCURACY_M:
            return
        accuracy = max(accuracy_m, 1.0)
        self._fixes.append(_Fix(time_ns, (east_m, north_m), self._walked, self._path_m, accuracy))
        if len(self._fixes) < FIXES:
            return
        here = _centroid(list(self._fixes))
        if self._anchor is None or (here.time_ns - self._anchor.time_ns) * _NS > LONGEST_S:
            self._anchor = here
        elif _distance(here.fixed_m, self._anchor.fixed_m) >= LEAST_DISTANCE_M:
            self._learn(self._anchor, here)
            self._anchor = here
            self._fixes.clear()

    def _learn(self, start: _Virtual, end: _Virtual) -> None:
        walked = _distance(end.walked_m, start.walked_m)
        path = end.path_m - start.path_m
        if path < 0.5 * LEAST_DISTANCE_M or walked < STRAIGHT * path:
            return
        told, satellites = _azimuth(start.walked_m, end.walked_m), _azimuth(start.fixed_m, end.fixed_m)
        distance = _distance(end.fixed_m, start.fixed_m)
        noise = (start.sigma_m**2 + end.sigma_m**2) / distance**2 + STEPS_SIGMA_RAD**2
        self._variance += WALK_RAD_PER_STRETCH**2
        innovation = math.remainder(satellites - told - self.angle_rad, math.tau)
        total = max(self._variance + noise, (innovation / _GATE) ** 2)
        gain = self._variance / total
        self.angle_rad = math.remainder(self.angle_rad + gain * innovation, math.tau)
        self._variance *= 1.0 - gain
        self._azimuth = (end.time_ns, satellites % math.tau)
        self.stretches += 1


def _centroid(fixes: list[_Fix]) -> _Virtual:
    weights = [fix.accuracy_m**-2 for fix in fixes]
    total = sum(weights)

    def mean(values: list[float]) -> float:
        return sum(w * value for w, value in zip(weights, values, strict=True)) / total

    return _Virtual(
        time_ns=fixes[-1].time_ns,
        fixed_m=(mean([fix.fixed_m[0] for fix in fixes]), mean([fix.fixed_m[1] for fix in fixes])),
        walked_m=(mean([fix.walked_m[0] for fix in fixes]), mean([fix.walked_m[1] for fix in fixes])),
        path_m=mean([fix.path_m for fix in fixes]),
        # Errors of fixes a second apart are much the same: the centroid is hardly better than one of them.
        sigma_m=1.0 / math.sqrt(total / len(fixes)),
    )


def _distance(a: tuple[float, float], b: tuple[float, float]) -> float:
    return math.hypot(a[0] - b[0], a[1] - b[1])


def _azimuth(start: tuple[float, float], end: tuple[float, float]) -> float:
    return math.atan2(end[0] - start[0], end[1] - start[1])
