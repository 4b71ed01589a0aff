"""How height is won: on the level, a slope, stairs or in a lift, from air pressure and steps (METHODS A8).

Interacting multiple models (Blom and Bar-Shalom 1988) on ticks of half a second: for each way to go a scalar Kalman
filter of the height. Stairs give a riser at every step (16 to 20 cm, the source's 1 m in five steps), slopes less,
lifts and escalators height without steps; what pressure does on the level is weather, and a draught passes. What
came later tells what the way was (fixed-lag smoothing).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from pdr_engine.body.movement.classes import Climb
from pdr_engine.body.pieces import FloatArray

Way = Literal["level", "slope", "stairs", "lift"]
TICK_S = 0.5
RISER_M = 0.168  # Swiss norm 16.25 to 19.6 cm, public stairs 15 to 17


class _Model(NamedTuple):
    """``rise_m`` and its sigma: a step where ``walks``, else a tick. ``begin``, ``end``: probability a tick.

    ``noise_m``: of pressure, beside the barometer's own.
    """

    way: Way
    rise_m: float
    sigma_m: float
    walks: bool
    begin: float
    end: float
    noise_m: float = 0.0


_LEVEL_SIGMA_M = 0.018  # a tick: what weather does in seconds
_UPWARD = (
    _Model("slope", 0.065, 0.030, True, 0.003, 0.02),  # of 5 to 14 %; who climbs less is on the level
    _Model("stairs", RISER_M, 0.022, True, 0.008, 0.03),  # sigma: risers, and miscounts
    _Model("stairs", 0.5 * RISER_M, 0.06, True, 0.008, 0.3),  # begin, end or landing within the tick
    _Model("lift", 0.55, 0.4, False, 0.006, 0.04),  # 0.2 to 3 m/s
)
_MODELS = (
    _Model("level", 0.0, _LEVEL_SIGMA_M, False, 0.0, 0.0),
    _Model("level", 0.0, _LEVEL_SIGMA_M, False, 0.01, 0.5, noise_m=0.5),  # doors and gusts
    *_UPWARD,
    *(model._replace(rise_m=-model.rise_m) for model in _UPWARD),
)
_SLOPE, _STAIRS, _EDGE = 0, 1, 2  # in `_UPWARD`
_FIRST, _SIDES = 2, len(_UPWARD)  # of the models upward, and how many each way
_BEGIN_LATE = 0.03  # the first steps of stairs look like a slope
_EDGE_TO_STAIRS, _STAIRS_TO_EDGE = 0.5, 0.06
_OTHER = 0.0003  # from any way to any other without the level between
_WALKING_HZ = 0.6
_STANDING_WHERE_WALKED, _WALKING_IN_LIFT = 1e-4, 0.02
_ANYTHING = 1e-4  # the likelihood of what nobody thought of


def _changes() -> FloatArray:
    """Probabilities (m, m) from row to column in a tick."""
    matrix = np.full((len(_MODELS), len(_MODELS)), _OTHER)
    for row, model in enumerate(_MODELS[1:], start=1):
        matrix[0, row], matrix[row, 0] = model.begin, model.end
    for first in (_FIRST, _FIRST + _SIDES):
        slope, stairs, edge = first + _SLOPE, first + _STAIRS, first + _EDGE
        matrix[slope, stairs] = _BEGIN_LATE
        matrix[edge, stairs], matrix[stairs, edge] = _EDGE_TO_STAIRS, _STAIRS_TO_EDGE
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, 1.0 - matrix.sum(axis=1))
    return matrix


_CHANGES = _changes()
_RISE_M, _SIGMA_M, _NOISE_M = (
    np.array([getattr(model, name) for model in _MODELS]) for name in ("rise_m", "sigma_m", "noise_m")
)
_WALKS = np.array([model.walks for model in _MODELS])
_IS_LIFT = np.array([model.way == "lift" for model in _MODELS])
_SIGN = np.sign(_RISE_M)
_BY_RISERS = np.array([model.way in ("level", "stairs") for model in _MODELS])
_IS_EDGE = np.array([model.way == "stairs" and abs(model.rise_m) < RISER_M for model in _MODELS])
_ON_STAIRS = np.array([float(model.way == "stairs") for model in _MODELS])
# Half of an edge's ticks lie on a landing, the others begin or end a flight anywhere within.
_RISERS, _RISERS_SQUARED = (
    np.where(_IS_EDGE, 1.0 / 4.0, _ON_STAIRS),
    np.where(_IS_EDGE, 1.0 / 6.0, _ON_STAIRS),
)
_WAYS: tuple[Way, ...] = ("level", "slope", "stairs", "lift")
_OF_WAY = np.array([[float(model.way == way) for model in _MODELS] for way in _WAYS])


class Tick(NamedTuple):
    """Mean height by pressure over a tick (None without a sample), its sigma, and steps a second."""

    height_m: float | None
    sigma_m: float
    cadence_hz: float


@dataclass(frozen=True, slots=True)
class Belief:
    """Shares (m,) of the models, and of each the height and its variance."""

    shares: FloatArray
    height_m: FloatArray
    variance_m2: FloatArray

    @staticmethod
    def at(height_m: float, sigma_m: float) -> "Belief":
        """On the level, at this height."""
        return Belief(_CHANGES[0].copy(), np.full(len(_MODELS), height_m), np.full(len(_MODELS), sigma_m**2))

    @property
    def probability(self) -> dict[Way, float]:
        """Of each way, up and down together."""
        return dict(zip(_WAYS, (_OF_WAY @ self.shares).tolist(), strict=True))

    @property
    def way(self) -> Way:
        """The likeliest."""
        shares = self.probability
        return max(shares, key=lambda way: shares[way])

    @property
    def up(self) -> bool:
        """Whether it goes up rather than down."""
        return float(self.shares @ _SIGN) > 0.0

    @property
    def risers_a_step(self) -> tuple[float, float]:
        """Mean, down negative, and variance, on stairs or the level: ends of flights and landings have fewer."""
        shares = self.shares * _BY_RISERS
        shares = shares / max(float(shares.sum()), _ANYTHING)
        mean = float(shares @ (_RISERS * _SIGN))
        return mean, float(shares @ _RISERS_SQUARED) - mean**2

    @property
    def climb(self) -> Climb:
        """For the movement class."""
        return Climb(self.probability["stairs"], self.up)


def advance(belief: Belief, tick: Tick) -> tuple[Belief, FloatArray]:
    """The belief a tick later, and the likelihood (m,) of what the tick showed under each model."""
    ahead = belief.shares @ _CHANGES
    mixing = _CHANGES * belief.shares[:, None] / ahead
    height = belief.height_m @ mixing
    spread = belief.variance_m2[:, None] + (belief.height_m[:, None] - height) ** 2
    steps = np.where(_WALKS, max(tick.cadence_hz, _WALKING_HZ) * TICK_S, 1.0)
    height = height + steps * _RISE_M
    variance = (mixing * spread).sum(axis=0) + (steps * _SIGMA_M) ** 2
    likelihood = _by_walking(tick.cadence_hz > _WALKING_HZ)
    if tick.height_m is not None:
        total = variance + tick.sigma_m**2 + _NOISE_M**2
        miss = tick.height_m - height
        likelihood = likelihood * np.exp(-0.5 * miss**2 / total) / np.sqrt(2.0 * np.pi * total) + _ANYTHING
        gain = variance / total
        height, variance = height + gain * miss, (1.0 - gain) * variance
    shares = ahead * likelihood
    return Belief(shares / shares.sum(), height, variance), likelihood


def _by_walking(walking: bool) -> FloatArray:
    """Nobody climbs stairs without steps; who walks is hardly in a lift."""
    if walking:
        return np.where(_IS_LIFT, _WALKING_IN_LIFT, 1.0)
    return np.where(_WALKS, _STANDING_WHERE_WALKED, 1.0)


def smoothed(belief: Belief, likelihoods: Sequence[FloatArray]) -> Belief:
    """The belief as it is seen after the ticks that followed, of these likelihoods."""
    told = np.ones(len(_MODELS))
    for likelihood in reversed(likelihoods):
        told = _CHANGES @ (likelihood * told)
        told /= told.sum()
    shares = belief.shares * told
    return Belief(shares / shares.sum(), belief.height_m, belief.variance_m2)
