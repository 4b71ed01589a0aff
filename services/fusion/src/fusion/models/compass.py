"""What a boot's magnetometer says of its yaw: ``π/2 − azimuth = ψ + e``, where ``e`` lasts or belongs to the place.

Of the stated σ half the variance is what calibration left (a state, in units of that part of σ, learned while
satellites or the other foot tell the heading), half the iron of the place, another one some metres on.
"""

import math
from collections.abc import Callable

import numpy as np

from bootprint.geodesy import wrap_angle
from bootprint.messages import FootStep
from fusion.feet import Foot
from fusion.filter import Innovation, Measurement, StateFilter
from fusion.state import FootBlock

_ANOTHER_PLACE_M = 5.0
_LASTING = 0.5  # share of the variance


def measurement(
    state_filter: StateFilter, block: FootBlock, step: FootStep, gate_probability: float
) -> Measurement | None:
    """Of a foot whose newest step is this one, in ENU; None if its magnetometer could not be trusted."""
    if step.magnetic_azimuth_rad is None or not step.magnetic_azimuth_sigma_rad:
        return None
    state, left_over = state_filter.state, state_filter.layout.compass(block)
    lasting_rad = math.sqrt(_LASTING) * step.magnetic_azimuth_sigma_rad
    told_rad = 0.5 * math.pi - step.magnetic_azimuth_rad
    expected_rad = float(state[block.yaw]) + lasting_rad * float(state[left_over])
    jacobian = np.zeros((1, state.size))
    jacobian[0, block.yaw], jacobian[0, left_over] = 1.0, lasting_rad
    return Measurement(
        "compass",
        np.array([wrap_angle(told_rad - expected_rad)]),
        jacobian,
        np.array([[(1.0 - _LASTING) * step.magnetic_azimuth_sigma_rad**2]]),
        gate_probability=gate_probability,
        directs=True,
    )


def look(
    state_filter: StateFilter,
    foot: Foot,
    step: FootStep,
    gate_probability: float,
    correct: Callable[[Measurement], Innovation],
) -> None:
    """Correct a foot's yaw, once a place: iron there errs the same way again and again."""
    foot.since_compass_m += math.hypot(*step.displacement_m[:2])
    if foot.since_compass_m < _ANOTHER_PLACE_M:
        return
    told = measurement(state_filter, foot.block, step, gate_probability)
    if told is not None:
        foot.since_compass_m = 0.0
        correct(told)
