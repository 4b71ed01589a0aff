"""How height is won: on the level, a slope, stairs or in a lift, from air pressure and steps (METHODS A8).

A hidden Markov model on ticks of half a second. Stairs give a riser at every step (16 to 20 cm, the source's 1 m in
five steps), slopes less, lifts and escalators height without steps; what pressure does on the level is weather.
"""

from typing import Literal

import numpy as np

from pdr_engine.body.movement.classes import Climb
from pdr_engine.body.pieces import FloatArray

Way = Literal["level", "slope", "stairs", "lift"]
TICK_S = 0.5
RISER_M, RISER_SPREAD_M = 0.168, 0.022  # Swiss norm 16.25 to 19.6 cm, public stairs 15 to 17; and miscounts
_STATES: tuple[tuple[Way, int], ...] = (
    ("level", 0),
    ("slope", 1),
    ("slope", -1),
    ("stairs", 1),
    ("stairs", -1),
    ("lift", 1),
    ("lift", -1),
)
_LEVEL_M_S = 0.035  # what weather does in a few seconds
_DRAUGHT_SHARE, _DRAUGHT_M_S = 0.1, 0.1
_SLOPE_M, _SLOPE_SPREAD_M = (
    0.065,
    0.03,
)  # of rise a step: slopes of 5 to 14 %; who climbs less is on the level
_LANDING_SHARE = 0.15  # of the time on stairs with a landing or an end in the window
_LIFT_SLOWEST_M_S, _LIFT_FASTEST_M_S = 0.2, 3.0
_WALKING_HZ = 0.6
_LIFT_WALKING = 0.02  # who walks is hardly in a lift
_ANYTHING = 1e-4  # the likelihood of what nobody thought of
_BEGIN: dict[Way, float] = {"slope": 0.003, "stairs": 0.012, "lift": 0.006}  # each way, a tick
_END: dict[Way, float] = {"slope": 0.02, "stairs": 0.03, "lift": 0.04}
_BEGIN_LATE = 0.03  # the first steps of stairs look like a slope
_OTHER = 0.0003  # from any way to any other without the level between


def _changes() -> FloatArray:
    """Probabilities (7, 7) from row to column in a tick."""
    matrix = np.full((len(_STATES), len(_STATES)), _OTHER)
    for row, (way, _) in enumerate(_STATES[1:], start=1):
        matrix[0, row], matrix[row, 0] = _BEGIN[way], _END[way]
    for sign in (1, -1):
        matrix[_STATES.index(("slope", sign)), _STATES.index(("stairs", sign))] = _BEGIN_LATE
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, 1.0 - matrix.sum(axis=1))
    return matrix


_CHANGES = _changes()


class ClimbFilter:
    """Which way it is, tick by tick."""

    def __init__(self) -> None:
        self._shares = _CHANGES[0].copy()

    def update(self, climb_m_s: float, sigma_m_s: float, cadence_hz: float) -> None:
        """Take a tick in: the rate of climb around it with its sigma, and steps a second."""
        posterior = (self._shares @ _CHANGES) * _likelihood(climb_m_s, sigma_m_s, cadence_hz)
        self._shares = posterior / posterior.sum()

    @property
    def probability(self) -> dict[Way, float]:
        """Of each way, up and down together."""
        shares: dict[Way, float] = {"level": 0.0, "slope": 0.0, "stairs": 0.0, "lift": 0.0}
        for (way, _), share in zip(_STATES, self._shares.tolist(), strict=True):
            shares[way] += share
        return shares

    @property
    def way(self) -> Way:
        """The likeliest."""
        shares = self.probability
        return max(shares, key=lambda way: shares[way])

    @property
    def up(self) -> bool:
        """Whether it goes up rather than down."""
        return float(self._shares @ np.array([sign for _, sign in _STATES])) > 0.0

    @property
    def climb(self) -> Climb:
        """For the movement class."""
        return Climb(self.probability["stairs"], self.up)


def _likelihood(climb_m_s: float, sigma_m_s: float, cadence_hz: float) -> FloatArray:
    """Of a rate of climb in each state (7,), at this cadence; densities over m/s."""
    level = (1.0 - _DRAUGHT_SHARE) * _gauss(climb_m_s, np.hypot(_LEVEL_M_S, sigma_m_s))
    level += _DRAUGHT_SHARE * _gauss(climb_m_s, _DRAUGHT_M_S)
    densities = [level]
    for way, sign in _STATES[1:]:
        densities.append(_climbing(way, sign * climb_m_s, sigma_m_s, cadence_hz))
    return np.array(densities) + _ANYTHING


def _climbing(way: Way, climb_m_s: float, sigma_m_s: float, cadence_hz: float) -> float:
    """Density of a rate of climb on a way that rises."""
    walking = cadence_hz > _WALKING_HZ
    if way == "lift":
        return _lift(climb_m_s, sigma_m_s) * (_LIFT_WALKING if walking else 1.0)
    if not walking:
        return 0.0
    if way == "stairs":
        full = RISER_M * cadence_hz
        partly = float(0.0 < climb_m_s < full) / full
        whole = _gauss(climb_m_s - full, np.hypot(RISER_SPREAD_M * cadence_hz, sigma_m_s))
        return (1.0 - _LANDING_SHARE) * whole + _LANDING_SHARE * partly
    return _gauss(climb_m_s - _SLOPE_M * cadence_hz, np.hypot(_SLOPE_SPREAD_M * cadence_hz, sigma_m_s))


def _lift(climb_m_s: float, sigma_m_s: float) -> float:
    """Even between a slow and a fast lift's speed, and falling off beyond."""
    missing = max(_LIFT_SLOWEST_M_S - climb_m_s, climb_m_s - _LIFT_FASTEST_M_S, 0.0)
    even = 1.0 / (_LIFT_FASTEST_M_S - _LIFT_SLOWEST_M_S)
    return float(even * np.exp(-0.5 * (missing / np.hypot(sigma_m_s, 0.05)) ** 2))


def _gauss(miss: float, sigma: float) -> float:
    return float(np.exp(-0.5 * (miss / sigma) ** 2) / (np.sqrt(2.0 * np.pi) * sigma))
