"""The torso's motion: over the feet, bouncing once a step, swaying and twisting once a stride, shaken by the heels.

Its frame is forward, left, up at belt height. The antero-posterior surge is that of an inverted pendulum: it is
slowest over the standing foot and fastest between the feet, so walking forward the forward acceleration peaks
before the vertical one, walking backward after it (METHODS A3 tells the two apart by this).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from proving_ground.people.attitude import along_heading, attitude_of
from proving_ground.people.legs import FloatArray
from proving_ground.people.smooth import SmoothCurve, Tremble, ring

# Harmonics beside the fundamental, by order, as shares of its amplitude: a trunk's shaking is no sine. Chosen to
# give the bands of chest-xsens. Of bounce and surge by the step; of sway, twist and roll by the stride (odd ones,
# since left mirrors right).
_BOUNCE = ((1, 1.0), (2, 0.18), (3, 0.07))
_SURGE = ((1, 1.0), (2, 0.22), (3, 0.06))
_SWAY = ((1, 1.0), (3, 0.09), (5, 0.045))
_TWIST = ((1, 1.0), (5, 0.09), (7, 0.03))
_NOD = ((1, 0.15), (2, 0.12), (3, 0.04))  # pitch, of the twist
_ROLL = ((1, 0.4), (5, 0.08), (7, 0.03))  # of the twist
_STRIKE_TURN_RAD_M = np.array([10.0, -4.0, 16.0])  # yaw, pitch, roll: rad/s² a m/s² of strike
_STRIKE_PHASE, _STRIKE_HZ, _STRIKE_DECAY_S, _STRIKE_ONSET_S = 0.47, 11.0, 0.045, 0.030
_STRIKE_AHEAD = -0.5  # the heel's push back, of its push up
_SWAY_RAD = 0.004


class TorsoKnot(NamedTuple):
    """What the torso does at a time; between knots everything goes smoothly.

    Ground below the person (m, ENU), yaw, steps made (`phase`, odd while the right foot stands), height above the
    ground, lean, way ahead of the feet; amplitudes of `TorsoHabit`; the surge in m along both axes. ``step_s``
    is how long a step takes. ``moving``: position, yaw and phase pass the knot with even rate instead of resting;
    ``ride_m_s``: with this velocity (a lift).
    """

    time_s: float
    east_m: float
    north_m: float
    up_m: float
    yaw_rad: float
    phase: float
    height_m: float
    lean_rad: float
    ahead_m: float
    bounce_m: float = 0.0
    surge_forward_m: float = 0.0
    surge_left_m: float = 0.0
    sway_m: float = 0.0
    twist_rad: float = 0.0
    strike_m_s2: float = 0.0
    step_s: float = 0.5
    moving: bool = False
    ride_m_s: tuple[float, float, float] | None = None


_RATED = 5  # east, north, up, yaw, phase: what passes a moving knot with a rate


def curve_of(knots: list[TorsoKnot]) -> SmoothCurve:
    """All columns through the knots; a single knot lasts for ever."""
    time_s = np.array([knot.time_s for knot in knots])
    values = np.array([knot[1:-2] for knot in knots], dtype=np.float64)
    rates = np.zeros_like(values)
    inner = slice(1, -1)
    slope = (values[2:, :_RATED] - values[:-2, :_RATED]) / (time_s[2:] - time_s[:-2])[:, None]
    moving = np.array([knot.moving for knot in knots])[inner, None]
    rates[inner, :_RATED] = np.where(moving, slope, 0.0)
    for rate, knot in zip(rates, knots, strict=True):
        if knot.ride_m_s is not None:
            rate[:3] = knot.ride_m_s
    return SmoothCurve(time_s, values, rates)


@dataclass(frozen=True)
class TorsoMotion:
    """The belt of a person; head and camera ride on it."""

    curve: SmoothCurve
    tremble: Tremble

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Place (n, 3) in ENU metres and attitude (torso to ENU) at these times (n,)."""
        time_s = np.asarray(time_s, dtype=np.float64)
        columns = self.curve(time_s)
        yaw, phase, height, lean, ahead, bounce, forward, left, sway, twist, strike, step_s = columns[:, 3:].T
        step, stride = 2.0 * np.pi * phase, np.pi * phase
        shock = strike * _shock(phase, step_s)
        aside = np.where(
            np.mod(np.floor(phase - _STRIKE_PHASE), 2.0) == 0.0, 0.5, -0.5
        )  # of the foot that landed
        tremble = self.tremble(time_s)
        body = np.column_stack(
            [
                ahead - forward * _wave(np.sin, step, _SURGE) + _STRIKE_AHEAD * shock,
                sway * _wave(np.cos, stride, _SWAY) - left * _wave(np.sin, step, _SURGE) + aside * shock,
                height + bounce * _wave(np.cos, step, _BOUNCE) + shock,
            ]
        )
        place = columns[:, :3] + along_heading(yaw, body + tremble[:, :3])
        euler = np.column_stack(
            [
                yaw + twist * _wave(np.sin, stride, _TWIST),
                lean + twist * _wave(np.cos, step, _NOD),
                twist * _wave(np.cos, stride, _ROLL),
            ]
        )
        euler += shock[:, None] * _STRIKE_TURN_RAD_M * np.column_stack([aside, np.ones_like(aside), aside])
        return place, attitude_of(euler + tremble[:, 3:])

    def ground_m(self, time_s: FloatArray) -> FloatArray:
        """Height of the ground under the person (n,)."""
        return self.curve(time_s)[:, 2]


def _wave(
    base: Callable[[FloatArray], FloatArray], turn: FloatArray, harmonics: tuple[tuple[int, float], ...]
) -> FloatArray:
    """A sum of harmonics of a sine or cosine."""
    return np.asarray(sum(share * base(order * turn) for order, share in harmonics))


def _shock(phase: FloatArray, step_s: FloatArray) -> FloatArray:
    """Shift by a landing of 1 m/s², m: a ring that starts softly and has gone before the next."""
    share = np.mod(phase - _STRIKE_PHASE, 1.0)
    since = share * step_s
    fade = (1.0 - share**2) ** 3
    return np.asarray(fade * ring(since, _STRIKE_HZ, _STRIKE_ONSET_S, _STRIKE_DECAY_S))


def fresh_sway(sway_m: float, rng: np.random.Generator) -> Tremble:
    """How one standing torso sways: ``sway_m`` fore and aft, less aside, hardly up; fractions of a degree."""
    return Tremble(
        np.array([sway_m, 0.6 * sway_m, 0.1 * sway_m, _SWAY_RAD, 0.7 * _SWAY_RAD, 0.7 * _SWAY_RAD]), rng
    )
