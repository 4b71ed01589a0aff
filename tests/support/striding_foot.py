"""A foot that strides in ways of its own: aside, backward, up stairs, at a run, crawling. Exact kinematics."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from support.foot_streams import START_NS, Stream
from support.walking_foot import RATE_HZ, samples

HEEL = 0.35  # share of the swing at which the heel is highest


@dataclass(frozen=True)
class Stride:
    """``way_m``: ahead of the toes, left of them, up. ``heel_rad``: largest pitch, nose down.

    ``lean_rad``: pitch of the resting foot after the stride.
    """

    way_m: tuple[float, float, float] = (1.3, 0.0, 0.0)
    lift_m: float = 0.1
    heel_rad: float = 1.0
    lean_rad: float = 0.0
    swing_s: float = 0.6
    stance_s: float = 0.5


def striding(
    strides: Sequence[Stride], facing_rad: float = 0.3, rest_s: float = 2.0, seed: int = 0
) -> Stream:
    """Rest, the strides, rest. The toes point along ``facing_rad`` throughout."""
    duration_s = 2 * rest_s + sum(stride.swing_s + stride.stance_s for stride in strides)
    time_s = np.arange(0.0, duration_s, 1.0 / RATE_HZ)
    position, pitch = np.zeros((len(time_s), 3)), np.zeros(len(time_s))
    begin_s, lean_rad = rest_s, 0.0
    cosine, sine = np.cos(facing_rad), np.sin(facing_rad)
    for stride in strides:
        u = np.clip((time_s - begin_s) / stride.swing_s, 0.0, 1.0)
        smooth = 10 * u**3 - 15 * u**4 + 6 * u**5
        ahead, left, up = stride.way_m
        position += np.outer(smooth, [cosine * ahead - sine * left, sine * ahead + cosine * left, up])
        position[:, 2] += stride.lift_m * 64.0 * (u * (1 - u)) ** 3
        bump = (u / HEEL) ** 2 * ((1 - u) / (1 - HEEL)) ** (2 * (1 - HEEL) / HEEL)
        pitch += stride.heel_rad * bump + (stride.lean_rad - lean_rad) * smooth
        begin_s, lean_rad = begin_s + stride.swing_s + stride.stance_s, stride.lean_rad
    imu = samples(position, np.full(len(time_s), facing_rad), pitch, seed)
    return Stream(START_NS + np.round(time_s * 1e9).astype(np.int64), imu[:, :3], imu[:, 3:])
