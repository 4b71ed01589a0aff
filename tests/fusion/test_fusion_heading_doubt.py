"""A heading that nobody has seen stays doubtful, and the position says what that doubt means."""

import math

import numpy as np
import pytest

from bootprint.messages import FootStep, upper_triangle
from fusion.filter import Measurement, StateFilter
from fusion.models import dual_foot
from fusion.models.dual_foot import Passing
from fusion.models.turned import on_the_arc
from fusion.state import Layout
from support.foot_walks import NS, T0

LAYOUT = Layout.of(("left_foot", "right_foot"))
LEFT, RIGHT = LAYOUT.blocks
NORTH_UNKNOWN_RAD = 1.0
STRIDE = (1.4, 0.0, 0.0)
STEP_SIGMA_M, PASSING_SIGMA_M = 0.15, 0.1


def walk_on_two_feet(strides: int, *, relative: bool) -> StateFilter:
    """Feet side by side, both turned by nobody knows what; every step errs, every passing corrects it."""
    draw = np.random.default_rng(3)
    feet = StateFilter(LAYOUT)
    feet.state[LEFT.position], feet.state[RIGHT.position] = (0.0, 0.1, 0.0), (0.0, -0.1, 0.0)
    turned = np.zeros(LAYOUT.size)  # how the state answers to a turn about the origin
    for foot in LAYOUT.blocks:
        east, north, _ = feet.state[foot.position]
        turned[foot.all] = (-north, east, 0.0, 1.0)
    feet.covariance = NORTH_UNKNOWN_RAD**2 * np.outer(turned, turned)
    noise = np.diag(np.square([STEP_SIGMA_M, STEP_SIGMA_M, 0.01, 0.02]))
    for stride in range(2 * strides):
        stepped, standing, side = ((RIGHT, LEFT, 1.0), (LEFT, RIGHT, -1.0))[stride % 2]
        length = STRIDE if stride else (0.7, 0.0, 0.0)
        told = tuple(np.array(length) + draw.normal(0.0, STEP_SIGMA_M, 3) * (1.0, 1.0, 0.0))
        step = FootStep(
            time_ns=T0 + (stride + 1) * NS,
            sequence=stride,
            start_time_ns=T0 + stride * NS,
            displacement_m=told,
            heading_change_rad=float(draw.normal(0.0, 0.02)),
            covariance=upper_triangle(noise),
        )
        feet.propagate(stepped, step, noise)
        passing = Passing(standing, stepped, step.displacement_m, step.heading_change_rad)
        residual = -dual_foot.abreast(feet.state, passing, side, LAYOUT.width)
        residual[1] += side * 0.2  # how far apart they walk
        feet.update(
            Measurement(
                "dual_foot",
                residual,
                dual_foot.abreast_jacobian(feet.state, passing, side, LAYOUT.width),
                PASSING_SIGMA_M**2 * np.eye(3),
                relative=relative,
            )
        )
    return feet


def common_yaw_sigma_rad(feet: StateFilter) -> float:
    both = np.zeros(LAYOUT.size)
    both[LEFT.yaw] = both[RIGHT.yaw] = 0.5
    return math.sqrt(both @ feet.covariance @ both)


def test_feet_that_only_see_each_other_never_learn_where_north_is() -> None:
    """What two feet know of each other is the same whichever way the pair is turned."""
    assert common_yaw_sigma_rad(walk_on_two_feet(100, relative=True)) >= NORTH_UNKNOWN_RAD
    told_wrong = common_yaw_sigma_rad(walk_on_two_feet(100, relative=False))
    assert told_wrong < 0.8 * NORTH_UNKNOWN_RAD  # what the plain filter makes itself believe in such a walk


@pytest.mark.parametrize("sigma_rad", [0.05, 0.5, 1.5, 4.0])
def test_an_unknown_heading_bends_the_tangent_to_an_arc(sigma_rad: float) -> None:
    """Against drawn headings: a body 30 m east and 10 m north of where its heading was last right."""
    turns = np.random.default_rng(1).normal(0.0, sigma_rad, 400_000)
    lever = np.array([30.0, 10.0])
    away = np.stack(
        [
            np.cos(turns) * lever[0] - np.sin(turns) * lever[1] - lever[0],
            np.sin(turns) * lever[0] + np.cos(turns) * lever[1] - lever[1],
        ]
    )
    own = np.diag([0.5, 0.2, 0.1])
    by_yaw = np.array([-lever[1], lever[0], 0.0])
    linear = own + sigma_rad**2 * np.outer(by_yaw, by_yaw)
    bent = on_the_arc(linear, sigma_rad**2 * by_yaw, sigma_rad**2)
    np.testing.assert_allclose((bent - own)[:2, :2], away @ away.T / turns.size, atol=0.01 * lever @ lever)
    np.testing.assert_allclose(bent[2], own[2])


def test_a_known_heading_bends_nothing() -> None:
    np.testing.assert_array_equal(on_the_arc(np.eye(3), np.zeros(3), 0.0), np.eye(3))
