"""A camera in the company of everything else: feet that come back, the body's steps, saved state, other boots."""

import itertools
import math
from collections import Counter

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bootprint.bus import Envelope
from bootprint.messages import BodyStep, Position
from fusion.boots import Boots
from fusion.camera import Camera
from fusion.config import FusionConfig
from fusion.engine import FusionCore
from fusion.memory import objection
from fusion.shadows import Shadows
from fusion.smoother import Smoother
from fusion.state import Layout
from support.camera_walks import WalkingCamera
from support.foot_walks import (
    EAST,
    LEFT,
    NS,
    ORIGIN,
    RIGHT,
    T0,
    WHO,
    Path,
    SimulatedWalk,
    envelope,
    in_time_order,
    rectangle,
    straight,
)

DUAL = FusionConfig(gnss_sources=(), start=EAST)
ASKEW = Rotation.from_euler("ZYX", [0.3, 0.15, -0.08])
SILENT_S = (20.0, 42.0)  # 30 m
LOST_RAD = math.radians(60.0)


def walk_of(seconds: float = 75.0) -> SimulatedWalk:
    return SimulatedWalk(rectangle(40.0, 15.0), seconds)


def silent(walk: SimulatedWalk, from_s: float, until_s: float) -> list[Envelope]:
    """Both feet, but for some time."""
    return [
        one
        for foot in (LEFT, RIGHT)
        for one in walk.messages(foot)
        if not from_s * NS < one.message.time_ns - T0 < until_s * NS
    ]


def fed(core: FusionCore, *streams: list[Envelope]) -> list[Position]:
    """What the core says of these messages, from the placing on."""
    said = [message for item in in_time_order(*streams) for message in core.handle(item)]
    found = [one.message for one in said if isinstance(one.message, Position)]
    return [position for position in found if position.mode != "unplaced"]


def error(position: Position, walk: SimulatedWalk) -> np.ndarray:
    east, north, _ = walk.path(1.4 * min((position.time_ns - T0) / NS, walk.walk_s))
    return np.array([position.east_m - east, position.north_m - north])


def normalised_squared(position: Position, walk: SimulatedWalk) -> float:
    east, both, _, north, *_ = position.covariance_m2
    away = error(position, walk)
    return float(away @ np.linalg.solve(np.array([[east, both], [both, north]]), away))


def jumps_m(said: list[Position]) -> list[float]:
    places = [(position.east_m, position.north_m) for position in said]
    return [math.dist(*pair) for pair in itertools.pairwise(places)]


def body_steps(walk: SimulatedWalk) -> list[Envelope]:
    """A belt that makes every step a third too long."""
    out = []
    for number, end_s in enumerate(np.arange(0.6, walk.walk_s, 0.6)):
        (east, north), (to_east, to_north) = (walk.path(1.4 * at)[:2] for at in (end_s - 0.6, end_s))
        message = BodyStep(
            time_ns=T0 + round(end_s * NS),
            sequence=number,
            start_time_ns=T0 + round((end_s - 0.6) * NS),
            length_m=1.33 * math.hypot(to_east - east, to_north - north),
            length_sigma_m=0.05,
            azimuth_rad=math.atan2(to_east - east, to_north - north) % math.tau,
            azimuth_sigma_rad=0.1,
            motion="walking",
        )
        out.append(envelope("body_step", "body", message))
    return out


@pytest.mark.parametrize("with_body", [False, True])
def test_feet_that_come_back_are_not_where_they_fell_silent(*, with_body: bool) -> None:
    """Thirty metres and a corner by camera alone; a body that tells the same way is not counted beside it."""
    walk, core = walk_of(), FusionCore(DUAL, WHO, ORIGIN)
    body = body_steps(walk) if with_body else []
    said = fed(core, silent(walk, *SILENT_S), WalkingCamera(ASKEW).messages(walk), body)
    assert core.counters["feet_dropped"] >= 2
    assert core.counters["steps_by_body"] == 0
    assert said[-1].mode == "boots"
    assert said[-1].sources == ("left_foot", "right_foot")
    assert max(jumps_m(said)) < 1.0
    assert max(float(np.hypot(*error(position, walk))) for position in said) < 1.0
    assert max(normalised_squared(position, walk) for position in said) < 13.8  # 99.9 %


def test_both_in_the_dark_the_feet_go_on_from_where_the_camera_took_them() -> None:
    """The camera goes blind for good before the feet come back: without it they would stand 14 m behind."""
    walk, core = SimulatedWalk(straight(0.0), 60.0), FusionCore(DUAL, WHO, ORIGIN)
    said = fed(core, silent(walk, 20.0, 32.0), WalkingCamera(blind_s=(30.0, 99.0)).messages(walk))
    dark = next(position for position in said if position.mode == "coasting")
    back = next(p for p in said if p.mode == "boots" and p.time_ns > T0 + 33 * NS)
    assert np.hypot(*error(dark, walk)) < 2.0
    assert np.hypot(*error(back, walk)) < 4.0  # 2 s that nobody saw
    assert normalised_squared(back, walk) < 13.8


def tell_late(
    core: FusionCore,
    walk: SimulatedWalk,
    late_s: tuple[float, float],
    *,
    left_first: bool,
    lost_s: float | None = None,
) -> list[Position]:
    """Feet tell all of a time at its end, each its own or both in turn; the camera tells in time.

    At ``lost_s`` it is forgotten which way all are turned.
    """
    feet = [*walk.messages(LEFT), *walk.messages(RIGHT)]
    if not left_first:
        feet.sort(key=lambda one: one.message.time_ns)
    from_ns, until_ns = (T0 + round(at_s * NS) for at_s in late_s)
    heard = [
        (until_ns if from_ns < one.message.time_ns < until_ns else one.message.time_ns, one) for one in feet
    ]
    heard += [(one.message.time_ns, one) for one in WalkingCamera(ASKEW).messages(walk)]
    out: list[Envelope] = []
    for at, one in sorted(heard, key=lambda item: item[0]):
        if lost_s is not None and at > T0 + lost_s * NS:
            boots, lost_s = core.estimator.boots, None
            boots.filter.widen_turned([each.block for each in boots.everybody() if each.active], LOST_RAD**2)
        out += [*core.handle(one), *core.tick(at)]
    found = [one.message for one in out if isinstance(one.message, Position)]
    return [position for position in found if position.mode != "unplaced"]


@pytest.mark.parametrize("left_first", [False, True])
@pytest.mark.parametrize(
    ("path", "late_s"), [(straight(0.0), (40.0, 43.0)), (rectangle(9.0, 6.0), (30.0, 42.0))]
)
def test_feet_that_tell_late_of_their_silence_are_not_counted_beside_the_camera(
    path: Path, late_s: tuple[float, float], *, left_first: bool
) -> None:
    """At the end of their silence they tell all of it at once; round corners they turn as they did then."""
    walk, core = SimulatedWalk(path, 60.0), FusionCore(DUAL, WHO, ORIGIN)
    said = tell_late(core, walk, late_s, left_first=left_first)
    assert core.counters["late_foot_step"] > 0
    assert {position.mode for position in said} == {"boots", "camera"}
    assert max(jumps_m(said)) < 1.0
    assert said[-1].mode == "boots"
    assert float(np.hypot(*error(said[-1], walk))) < 1.0
    assert normalised_squared(said[-1], walk) < 13.8


def test_a_silence_that_is_told_late_tells_no_north() -> None:
    """Led by the camera, taken back and told by the feet: nobody knew which way all went, nor does afterwards."""
    core = FusionCore(DUAL, WHO, ORIGIN)
    tell_late(core, SimulatedWalk(rectangle(9.0, 6.0), 60.0), (30.0, 42.0), left_first=False, lost_s=25.0)
    boots = core.estimator.boots
    assert core.counters["late_foot_step"] > 0
    for one in boots.everybody():
        assert math.sqrt(boots.filter.covariance[one.block.yaw, one.block.yaw]) >= LOST_RAD


def test_the_saved_state_is_of_the_feet() -> None:
    walk, core = walk_of(), FusionCore(DUAL, WHO, ORIGIN)
    fed(core, silent(walk, 30.0, 99.0), WalkingCamera().messages(walk)[:290])
    saved = core.remembered()
    assert core.counters["cameras_joined"] == 1
    assert core.estimator.boots.filter.state.size == Layout.of(DUAL.feet).size + 4
    assert saved is not None
    assert objection(saved, WHO.soldier, DUAL) is None
    again = FusionCore(DUAL, WHO, ORIGIN, saved=saved)
    later = [one for one in silent(walk, -1.0, 30.0) if one.message.time_ns < T0 + 50 * NS]
    seen = [one for one in WalkingCamera().messages(walk, 30.0) if one.message.time_ns < T0 + 50 * NS]
    said = fed(again, later, seen)
    assert again.counters["memory_gone_on_from"] == 1
    assert again.counters["cameras_joined"] == 1
    assert np.hypot(*error(said[-1], walk)) < 4.0


def test_a_walk_that_a_camera_alone_has_is_not_saved() -> None:
    core = FusionCore(DUAL, WHO, ORIGIN)
    walk = walk_of(20.0)
    said = fed(core, WalkingCamera().messages(walk))
    assert said[-1].mode == "camera"
    assert core.remembered() is None


def test_feet_join_a_walk_that_a_camera_has_begun_and_take_it_over() -> None:
    walk, core = walk_of(), FusionCore(DUAL, WHO, ORIGIN)
    said = fed(core, silent(walk, -1.0, 20.0), WalkingCamera(ASKEW).messages(walk))
    assert core.counters["feet_joined"] == 2
    assert {position.mode for position in said} == {"camera", "boots"}
    assert core.estimator.boots.reference in core.estimator.boots.feet.values()
    assert max(jumps_m(said)) < 1.0
    assert np.hypot(*error(said[-1], walk)) < 1.2


def test_a_camera_follows_to_other_boots_and_joins_them() -> None:
    """Satellites were found out, and the boots set back to a shadow of before: the camera is not in these yet."""
    walk, counters = walk_of(), Counter[str]()
    boots, shadows = Boots(DUAL, counters), Shadows(1.0)
    camera = Camera(boots, DUAL, counters)
    for one in in_time_order(silent(walk, 99.0, 99.0), WalkingCamera().messages(walk)):
        name, message, time_s = one.address.source, one.message, (one.message.time_ns - T0) / NS
        if one.address.subject == "camera_motion":
            camera.take(name, message)
        else:
            (boots.step if one.address.subject == "foot_step" else boots.pose)(name, message)
        if (
            boots.reference is not None
            and counters["cameras_joined"] == 1
            and time_s > 30.0
            and not [*shadows]
        ):
            shadows.split_off(boots, counters, message.time_ns)
            boots = shadows.revived(next(iter(shadows)), counters)
            camera.follow(boots)
            assert boots.stand_in is None
    assert counters["cameras_joined"] == 2
    assert boots.stand_in is camera.foot
    assert camera.foot is not None
    assert len(boots.filter.layout.beside) == 1
    apart = boots.filter.state[camera.foot.block.position] - boots.place_at(
        T0 + 75 * NS, boots.heard_feet(T0 + 75 * NS)
    )
    assert np.hypot(*apart[:2]) < 0.6


def test_a_smoother_is_of_feet_and_a_camera_stays_out() -> None:
    walk, core = walk_of(30.0), FusionCore(DUAL, WHO, ORIGIN)
    smoother = Smoother(core.estimator.boots)
    fed(core, silent(walk, 99.0, 99.0), WalkingCamera().messages(walk))
    assert core.counters["cameras_joined"] == 0
    assert set(smoother.smoothed()) == {"left_foot", "right_foot"}
