"""The body's steps as a source: beside the boots, in their place, and alone."""

import itertools
import math

import msgspec
import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.geodesy import LocalFrame
from bootprint.messages import BodyStep, GnssFix, Position
from fusion.config import FusionConfig
from fusion.engine import FusionCore
from support.foot_walks import (
    EAST,
    LEFT,
    NS,
    ORIGIN,
    RIGHT,
    T0,
    WHO,
    SimulatedWalk,
    envelope,
    in_time_order,
    rectangle,
    straight,
)

CONFIG = FusionConfig(gnss_sources=(), start=EAST)
STEP_S = 0.6


def body_steps(walk: SimulatedWalk, turned_rad: float = 0.0, length: float = 1.0) -> list[Envelope]:
    """A belt that is turned clockwise by so much and takes steps for ``length`` of what they are."""
    out = []
    for number, end_s in enumerate(np.arange(STEP_S, walk.walk_s, STEP_S)):
        start, end = (np.array(walk.path(1.4 * at)[:2]) for at in (end_s - STEP_S, end_s))
        east, north = end - start
        message = BodyStep(
            time_ns=T0 + round(end_s * NS),
            sequence=number,
            start_time_ns=T0 + round((end_s - STEP_S) * NS),
            length_m=length * math.hypot(east, north),
            length_sigma_m=0.05,
            azimuth_rad=(math.atan2(east, north) + turned_rad) % math.tau,
            azimuth_sigma_rad=0.1,
            motion="walking",
        )
        out.append(envelope("body_step", "body", message))
    return out


def run(*streams: list[Envelope]) -> list[Position]:
    core = FusionCore(CONFIG, WHO, ORIGIN, patient=True)
    out = [m for item in in_time_order(*streams) for m in core.handle(item)]
    return [item.message for item in [*out, *core.close()] if isinstance(item.message, Position)]


def away_m(position: Position, walk: SimulatedWalk) -> float:
    time_s = (position.time_ns - T0) / NS
    east, north, _ = walk.path(1.4 * min(time_s, walk.walk_s))
    return math.hypot(position.east_m - east, position.north_m - north)


def sigma_m(position: Position) -> float:
    return math.sqrt(position.covariance_m2[0] + position.covariance_m2[3])


def without(messages: list[Envelope], from_s: float, until_s: float) -> list[Envelope]:
    return [e for e in messages if not from_s * NS < e.message.time_ns - T0 < until_s * NS]


def test_a_soldier_without_boots_walks_by_the_body_alone() -> None:
    walk = SimulatedWalk(straight(0.5), 60.0)
    out = run(body_steps(walk))
    placed = [position for position in out if position.mode != "unplaced"]
    assert {position.mode for position in placed} == {"body"}
    assert placed[-1].sources == ("body",)
    assert away_m(placed[-1], walk) < 2.0
    sigmas = [sigma_m(position) for position in placed]
    assert sigmas[-1] == pytest.approx(84.0 * math.hypot(0.2, 0.2), rel=0.15)  # of length, and of azimuth


def test_silent_boots_are_replaced_without_a_jump_and_take_over_again() -> None:
    walk = SimulatedWalk(rectangle(40, 30), 120.0)
    feet = [without(walk.messages(foot), 60.0, 80.0) for foot in (LEFT, RIGHT)]
    out = run(*feet, body_steps(walk))
    by_body = [position for position in out if position.mode == "body"]
    assert by_body
    assert all(60.5 < (position.time_ns - T0) / NS < 82.0 for position in by_body)
    assert all(position.sources == ("body",) for position in by_body)
    places = [(position.east_m, position.north_m) for position in out[40:]]
    jumps = [math.dist(*pair) for pair in itertools.pairwise(places)]
    assert max(jumps) < 4.0  # two seconds of steps, when silence is noticed
    assert max(away_m(position, walk) for position in by_body) < 3.0
    assert out[-1].mode == "boots"


def test_boots_teach_how_the_belt_sits_and_how_long_steps_are() -> None:
    turned_rad, length = 0.3, 0.8
    walk = SimulatedWalk(straight(0.0), 250.0, poses=False)
    feet = [without(walk.messages(foot), 180.0, 500.0) for foot in (LEFT, RIGHT)]
    out = run(*feet, body_steps(walk, turned_rad, length))
    end = next(position for position in out if (position.time_ns - T0) / NS > 248.0)
    assert end.mode == "body"
    assert away_m(end, walk) < 0.12 * 98.0  # of the last 98 m; untaught it would be 30 % or more
    assert away_m(end, walk) < 2.5 * sigma_m(end)


def doppler(until_s: int, sigma_m_s: float = 0.1) -> list[Envelope]:
    """Fixes of somebody who walks east: places good to 3 m, speed and course far better."""
    rng, frame = np.random.default_rng(11), LocalFrame(ORIGIN)
    out = []
    for second in range(1, until_s):
        latitude, longitude, height = frame.to_geodetic(1.4 * second + 1.5, -1.5, 0.0)
        east, north = 1.4 + sigma_m_s * rng.normal(), sigma_m_s * rng.normal()
        message = GnssFix(
            time_ns=T0 + second * NS,
            sequence=second,
            fix_kind="3d",
            latitude_deg=latitude,
            longitude_deg=longitude,
            height_m=height,
            horizontal_accuracy_m=3.0,
            speed_m_s=math.hypot(east, north),
            course_rad=math.atan2(east, north) % math.tau,
        )
        out.append(envelope("gnss", "gnss", message))
    return out


@pytest.mark.parametrize(("turned_rad", "length"), [(0.3, 0.8), (-0.2, 1.15)])
def test_satellites_teach_a_belt_alone_how_it_sits(turned_rad: float, length: float) -> None:
    """Two minutes of satellites, two without: 168 m, of which an untaught belt would miss a fifth or more."""
    walk = SimulatedWalk(straight(0.0), 240.0)
    out = run(body_steps(walk, turned_rad, length), doppler(120))
    end = next(position for position in out if (position.time_ns - T0) / NS > 238.0)
    assert end.mode == "body"
    assert away_m(end, walk) < 0.06 * 168.0
    assert away_m(end, walk) < 2.5 * sigma_m(end)


def taught(steps: list[Envelope], from_s: float, turned_rad: float, scale: float) -> list[Envelope]:
    """The same steps, told by a pdr-engine that satellites have taught so much from then on."""
    out = []
    for item in steps:
        step = item.message
        assert isinstance(step, BodyStep)
        if step.time_ns - T0 > from_s * NS:
            step = msgspec.structs.replace(
                step,
                length_m=scale * step.length_m,
                azimuth_rad=step.azimuth_rad + turned_rad,
                taught_scale=scale,
                taught_turn_rad=turned_rad,
            )
        out.append(envelope("body_step", "body", step))
    return out


@pytest.mark.parametrize("taught_from_s", [0.0, 60.0])
def test_what_pdr_engine_has_been_taught_is_not_mended_twice(taught_from_s: float) -> None:
    """It learns from the same satellites, before or amid fusion's own lessons; no error is mended twice."""
    walk = SimulatedWalk(straight(0.0), 200.0)
    own = body_steps(walk, turned_rad=0.3, length=0.8)
    untaught, told = (
        run(steps, doppler(120))[-1] for steps in (own, taught(own, taught_from_s, -0.3, 1.0 / 0.8))
    )
    assert told.mode == untaught.mode == "body"
    assert away_m(told, walk) < away_m(untaught, walk) + 0.5


def test_what_walking_has_shown_does_not_stretch_a_run() -> None:
    walk = SimulatedWalk(straight(0.0), 200.0)
    steps = body_steps(walk, length=0.8)
    run_steps = [
        envelope("body_step", "body", msgspec.structs.replace(item.message, motion="running"))
        for item in steps
        if item.message.time_ns - T0 > 140 * NS
    ]
    walked = [item for item in steps if item.message.time_ns - T0 <= 140 * NS]
    out = run([*walked, *run_steps], doppler(120))
    begin, end = (next(p for p in out if p.time_ns - T0 > at * NS) for at in (142, 198))
    assert end.east_m - begin.east_m == pytest.approx(0.8 * 1.4 * 56.0, rel=0.03)


def test_a_foot_that_tells_late_of_a_silence_is_not_counted_beside_the_body() -> None:
    """One boot without poses, whose steps come three seconds late: the body stands in, and steps back."""
    walk = SimulatedWalk(straight(0.0), 60.0, poses=False)
    core = FusionCore(msgspec.structs.replace(CONFIG, feet=("left_foot",)), WHO, ORIGIN)
    late = [
        (e.message.time_ns + 3 * NS * (40 * NS < e.message.time_ns - T0 < 43 * NS), e)
        for e in walk.messages(LEFT)
    ]
    heard = sorted([*late, *((e.message.time_ns, e) for e in body_steps(walk))], key=lambda item: item[0])
    out = [m for at_ns, item in heard for m in [*core.handle(item), *core.tick(at_ns)]]
    end = [one.message for one in out if isinstance(one.message, Position)][-1]
    assert core.counters["steps_by_body"] > 0
    assert away_m(end, walk) < 1.5
