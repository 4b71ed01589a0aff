"""A heading that nobody has seen stays doubtful, and the position says what that doubt means."""

import math

import numpy as np
import pytest

from bootprint.messages import FootStep, upper_triangle
from fusion.config import Coupling, FeetConfig, FusionConfig
from fusion.engine import FusionCore
from fusion.filter import Measurement, StateFilter
from fusion.models import dual_foot
from fusion.models.dual_foot import Passing
from fusion.models.turned import on_the_arc, unturned
from fusion.state import FootBlock, Layout
from support.camera_walks import WalkingCamera
from support.foot_walks import EAST, NS, ORIGIN, T0, WHO, SimulatedWalk, in_time_order, rectangle
from support.foot_walks import LEFT as LEFT_BOOT
from support.foot_walks import RIGHT as RIGHT_BOOT

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


def turned_by(feet: StateFilter, blocks: tuple[FootBlock, ...]) -> np.ndarray:
    """How these answer to a turn of everything about the origin."""
    turned = np.zeros(feet.layout.size)
    for block in blocks:
        east, north, _ = feet.state[block.position]
        turned[block.all] = (-north, east, 0.0, 1.0)
    return turned


def begun_side_by_side() -> StateFilter:
    """Feet 0.2 m apart, 30 m from where both were turned by nobody knows what."""
    feet = StateFilter(LAYOUT)
    feet.state[LEFT.position], feet.state[RIGHT.position] = (30.0, 0.1, 0.0), (30.0, -0.1, 0.0)
    turned = turned_by(feet, LAYOUT.blocks)
    feet.covariance = NORTH_UNKNOWN_RAD**2 * np.outer(turned, turned)
    return feet


def turn_on_the_spot(steps: int, *, fixed_axes: bool) -> StateFilter:
    """Standing turns: each foot steps where it likes, within 0.3 m; after each the two are held to one place."""
    draw, feet = np.random.default_rng(5), begun_side_by_side()
    noise = np.diag(np.square([0.3, 0.3, 0.01, 0.05]))
    for number in range(steps):
        stepped = LAYOUT.blocks[number % 2]
        way = (*draw.normal(0.0, 0.3, 2), 0.0)
        step = FootStep(
            time_ns=T0 + (number + 1) * NS,
            sequence=number,
            start_time_ns=T0 + number * NS,
            displacement_m=(float(way[0]), float(way[1]), 0.0),
            heading_change_rad=float(draw.normal(0.5, 0.3)),
            covariance=upper_triangle(noise),
        )
        feet.propagate(stepped, step, noise)
        passing = Passing(LAYOUT.blocks[1 - number % 2], stepped, (0.0, 0.0, 0.0), 0.0)
        apart, jacobian = (
            dual_foot.difference(feet.state, passing),
            dual_foot.difference_jacobian(feet.state, passing),
        )
        heading = np.zeros(LAYOUT.size)
        heading[stepped.yaw] = 1.0
        seen = jacobian if fixed_axes else unturned(jacobian, apart, heading)
        feet.update(Measurement("held", -apart, seen, 0.09 * np.eye(3), relative=True))
    return feet


def test_standing_turns_tell_no_north() -> None:
    """A turn of everything leaves two places as far apart as they were, but not on the tangent."""
    assert common_yaw_sigma_rad(turn_on_the_spot(200, fixed_axes=False)) >= NORTH_UNKNOWN_RAD
    assert common_yaw_sigma_rad(turn_on_the_spot(200, fixed_axes=True)) < 0.5 * NORTH_UNKNOWN_RAD


def test_who_joins_or_is_put_elsewhere_turns_with_those_who_were_there() -> None:
    feet = begun_side_by_side()
    third = feet.extend("camera")
    feet.join(third, LEFT, np.array([31.0, 2.0, 1.6, 0.3]), np.zeros((4, 4)), alike=False)
    feet.displace([RIGHT], np.array([-3.0, 1.0, 0.0, 0.2]), third)
    turned = turned_by(feet, (LEFT, RIGHT, third))
    np.testing.assert_allclose(feet.covariance, np.outer(turned, turned), atol=1e-12)


@pytest.mark.parametrize("coupling", ["passing", "same_position"])
def test_two_feet_and_a_camera_that_see_each_other_alone_tell_no_north(coupling: Coupling) -> None:
    """The whole core, round a yard for a minute: passings, the camera's constraints; north has been forgotten."""
    boots = FeetConfig(coupling=coupling)
    core = FusionCore(FusionConfig(gnss_sources=(), start=EAST, boots=boots), WHO, ORIGIN)
    walk = SimulatedWalk(rectangle(10.0, 6.0), 60.0)
    camera = WalkingCamera().messages(walk)
    for item in in_time_order(*(walk.messages(foot) for foot in (LEFT_BOOT, RIGHT_BOOT)), camera):
        list(core.handle(item))
        boots_now = core.estimator.boots
        if core.counters["feet_joined"] and boots_now.filter.covariance[3, 3] < 0.5:
            boots_now.filter.widen_turned(
                [one.block for one in boots_now.everybody() if one.active], NORTH_UNKNOWN_RAD**2
            )
    assert core.counters["cameras_joined"] == core.counters["feet_joined"] == 1
    walkers = [one.block for one in boots_now.everybody()]
    sigmas = [math.sqrt(boots_now.filter.covariance[block.yaw, block.yaw]) for block in walkers]
    assert min(sigmas) >= 0.99 * NORTH_UNKNOWN_RAD


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
