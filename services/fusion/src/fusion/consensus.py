"""Which peers' ranges fit together, and with where one believes to be; and where they alone say that one is.

Peers may be lost, lie, or be seen through a mirror. So the place that fits all is sought (Gauss-Newton), and while
the squares that are left are more than errors explain (chi-square), the peer without which they become least is
left out: Baarda's data snooping. What is left counts only if it is more than half of all.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fusion.chi_square import chi_square_quantile
from fusion.filter import invert_spd
from fusion.peers import Sight
from fusion.state import Array

_UP_SIGMA_M = 1.0  # between two soldiers on one floor as their fusions have it
_STEPS = 8
_SURROUND_RAD = tuple(index * math.pi / 4.0 for index in range(8))
_NEAR_M = 0.5  # nearer to a peer a direction towards it means nothing
_SETTLED_M = 1e-3
_AS_GOOD = 9.0  # squares more: three sigma


@dataclass(frozen=True, slots=True)
class Line:
    """A sight linearised at a place: ``residual_m`` more than predicted; ``toward`` (2,) = ∂distance/∂place."""

    residual_m: float
    toward: Array
    variance_m2: float


@dataclass(frozen=True, slots=True)
class Located:
    """Where ranges say that one is (2,) m, and its covariance (2, 2), whatever peers' errors have in common."""

    place: Array
    covariance: Array
    squares: float


def line(sight: Sight, here: Array) -> Line:
    """The sight as seen from ``here`` (3,) m; its variance holds the range's and the peer's."""
    way = here - sight.place
    distance_m = max(float(np.linalg.norm(way)), _NEAR_M)
    toward = way[:2] / distance_m
    level = float(toward @ toward)
    variance = sight.distance_sigma_m**2 + level * sight.place_sigma_m**2
    variance += max(0.0, 1.0 - level) * _UP_SIGMA_M**2
    return Line(sight.distance_m - distance_m, toward, variance)


def bend_m2(toward: Array, spread: Array, distance_m: float) -> float:
    """Mean square of what a range's line errs by, if places scatter by ``spread`` (2, 2) m²: e²/(2d) across it."""
    across = np.array([-toward[1], toward[0]])
    variance = float(across @ spread @ across)
    return 3.0 * variance**2 / (4.0 * max(distance_m, _NEAR_M) ** 2)


def agreeing(
    sights: Sequence[Sight], here: Array, spread: Array, probability: float
) -> tuple[list[Sight], list[Sight]]:
    """Those that fit together and with ``here`` (3,) give or take ``spread`` (2, 2), and those left out.

    None of them fit if no more than half would be left.
    """
    kept = list(sights)
    squares = _fit(kept, here, spread)[1]
    while kept and squares > chi_square_quantile(probability, len(kept)):
        without = [_fit([*kept[:index], *kept[index + 1 :]], here, spread)[1] for index in range(len(kept))]
        squares = min(without)
        del kept[without.index(squares)]
    if 2 * len(kept) <= len(sights):
        kept = []
    return kept, [sight for sight in sights if sight not in kept]


def _fit(sights: Sequence[Sight], here: Array, spread: Array | None) -> tuple[Array, float, Array]:
    """The place (3,) that fits best, its weighted squares, and the normal matrix (2, 2).

    ``spread``: how sure ``here`` is; None if it is a guess only, to begin from.
    """
    prior = np.zeros((2, 2)) if spread is None else invert_spd(spread)
    place = here.copy()
    normal = prior + 1e-9 * np.eye(2)
    for _ in range(_STEPS):
        lines = [line(sight, place) for sight in sights]
        normal = prior + sum((_information(one) for one in lines), 1e-9 * np.eye(2))
        pull = prior @ (here - place)[:2]
        for one in lines:
            pull = pull + one.toward * one.residual_m / one.variance_m2
        step = np.linalg.solve(normal, pull)
        place[:2] += step
        if float(np.hypot(*step)) < _SETTLED_M:
            break
    away = (place - here)[:2]
    squares = float(away @ prior @ away)
    squares += sum(one.residual_m**2 / one.variance_m2 for one in (line(sight, place) for sight in sights))
    return place, squares, normal


def _information(one: Line) -> Array:
    return np.outer(one.toward, one.toward) / one.variance_m2


def located(sights: Sequence[Sight], up_m: float, probability: float) -> Located | None:
    """Where ranges to three peers or more alone say that one is; None if they do not tell.

    What peers' errors have in common moves the place by itself, so the worst peer's variance is added.
    """
    kept = list(sights)
    while len(kept) >= 3:
        best = _best_start(kept, up_m)
        if best.squares <= chi_square_quantile(probability, max(1, len(kept) - 2)):
            return best if 2 * len(kept) > len(sights) else None
        without = [
            _best_start([*kept[:index], *kept[index + 1 :]], up_m).squares for index in range(len(kept))
        ]
        del kept[without.index(min(without))]
    return None


def _best_start(sights: Sequence[Sight], up_m: float) -> Located:
    """Sought from several sides of the nearest peer: squares of ranges have more than one minimum."""
    nearest = min(sights, key=lambda sight: sight.distance_m)
    found = []
    for side in _SURROUND_RAD:
        start = nearest.place + nearest.distance_m * np.array([math.cos(side), math.sin(side), 0.0])
        start[2] = up_m
        found.append(_fit(sights, start, None))
    place, squares, normal = min(found, key=lambda fit: fit[1])
    common = max(sight.place_sigma_m for sight in sights) ** 2
    covariance = invert_spd(normal) + common * np.eye(2) + _rivals(place, squares, found)
    return Located(place[:2], covariance, squares)


def _rivals(place: Array, squares: float, found: Sequence[tuple[Array, float, Array]]) -> Array:
    """What other places that fit as well add to the doubt (2, 2): peers on a line do not tell the sides apart."""
    apart = [(other - place)[:2] for other, other_squares, _ in found if other_squares < squares + _AS_GOOD]
    return max((np.outer(way, way) for way in apart), key=lambda one: float(np.trace(one)))
