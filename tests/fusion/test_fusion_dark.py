"""Times in which nobody was seen, and what is told at last: who vouches, what a fix and a direction may say."""

import math
from collections import Counter

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.linalg import expm

from bootprint.bus import Envelope
from bootprint.messages import FootPose, FootStep, Range
from fusion.boots import Boots
from fusion.config import FusionConfig
from fusion.cooperation import Cooperation
from fusion.engine import FusionCore
from fusion.filter import Measurement
from fusion.models import body
from fusion.models.turned import chord_of
from fusion.satellite_aid import SatelliteAid
from fusion.satellites import SatellitePosition, Satellites
from fusion.state import Array
from support.foot_walks import (
    EAST,
    LEFT,
    NS,
    ORIGIN,
    RIGHT,
    T0,
    WHO,
    SimulatedFoot,
    SimulatedWalk,
    envelope,
    in_time_order,
    rectangle,
)
from support.peer_tracks import track

BY_BOOTS = FusionConfig(gnss_sources=(), start=EAST)


def yaw_sigmas_rad(core: FusionCore) -> Array:
    """Of everybody in the filter."""
    state_filter = core.estimator.boots.filter
    yaws = [one.block.yaw for one in core.estimator.boots.everybody() if one.active]
    return np.sqrt(np.diag(state_filter.covariance)[yaws])


def broken(walk: SimulatedWalk, foot: SimulatedFoot, from_s: float, until_s: float) -> list[Envelope]:
    """A foot whose stream breaks: poses go on from nowhere, and one step over all of it tells no way."""
    out: list[Envelope] = []
    last, realigned = -1, False
    for one in walk.messages(foot):
        message = one.message
        at_s = (message.time_ns - T0) / NS
        if from_s < at_s <= until_s:
            continue
        if isinstance(message, FootStep):
            breaks = at_s > until_s and not realigned
            start_ns = T0 + round(from_s * NS) if breaks else message.start_time_ns
            last, realigned = last + 1, realigned or breaks
            out.append(
                envelope(
                    "foot_step",
                    foot.place,
                    replace(message, sequence=last, start_time_ns=start_ns, realigned=breaks),
                )
            )
        elif isinstance(message, FootPose):
            out.append(envelope("foot_pose", foot.place, replace(message, step_sequence=last)))
    return out


@pytest.mark.parametrize("from_s", [30.0, 30.7])
def test_no_foot_vouches_for_a_time_in_which_both_were_in_the_dark(from_s: float) -> None:
    """Both streams break for five seconds; who turned meanwhile, half a radian a root of a second, is unknown."""
    walk, core = SimulatedWalk(rectangle(20.0, 8.0), 60.0), FusionCore(BY_BOOTS, WHO, ORIGIN)
    feet = [broken(walk, foot, from_s, from_s + 5.0) for foot in (LEFT, RIGHT)]
    for one in in_time_order(*feet):
        core.handle(one)
    assert core.counters["feet_dropped"] == 0
    assert yaw_sigmas_rad(core).size == 2
    assert yaw_sigmas_rad(core).min() > 0.95 * BY_BOOTS.silence.turn_rad_sqrt_s * math.sqrt(5.0)


@pytest.mark.parametrize("poses", [False, True])
def test_a_foot_that_was_seen_vouches_for_the_one_that_was_not(*, poses: bool) -> None:
    walk, core = SimulatedWalk(rectangle(20.0, 8.0), 60.0, poses=poses), FusionCore(BY_BOOTS, WHO, ORIGIN)
    messages = in_time_order(broken(walk, LEFT, 30.0, 35.0), walk.messages(RIGHT))
    for one in messages:
        core.handle(one)
    assert core.counters["feet_dropped"] == 1  # it finds its place beside the other again
    assert yaw_sigmas_rad(core).size == 2
    assert yaw_sigmas_rad(core).max() < 0.2


def test_a_short_hole_of_its_own_makes_no_foot_a_bad_witness() -> None:
    """The left was gone for twenty seconds, the right for less than one of them: the left joins the right again."""
    walk, ends = SimulatedWalk(rectangle(20.0, 8.0), 60.0), []
    for right in (walk.messages(RIGHT), broken(walk, RIGHT, 40.0, 40.7)):
        core = FusionCore(BY_BOOTS, WHO, ORIGIN)
        for one in in_time_order(broken(walk, LEFT, 30.0, 50.0), right):
            core.handle(one)
        assert core.counters["feet_dropped"] == 1
        boots = core.estimator.boots
        ends.append(boots.place_at(T0 + 60 * NS, boots.alive(T0 + 60 * NS)))
    assert math.dist(*ends) < 3.0


def lost_at(place: Array, sigma_rad: float) -> Boots:
    """One foot, in ENU, that has come to ``place`` (3,) from the origin, where its heading was last sure."""
    config = FusionConfig(feet=("left_foot",), gnss_sources=())
    boots = Boots(config, Counter())
    boots.begin(boots.feet["left_foot"], T0)
    boots.in_enu = True
    block = boots.filter.layout.blocks[0]
    boots.filter.state[block.position] = place
    response = np.zeros(boots.filter.layout.size)
    response[block.all] = (-place[1], place[0], 0.0, 1.0)
    boots.filter.covariance = sigma_rad**2 * np.outer(response, response)
    boots.filter.covariance[block.position, block.position] += 0.04 * np.eye(3)
    return boots


def test_a_direction_told_at_last_turns_the_way_about_where_it_was_last_known() -> None:
    """A right angle: 20 m east become 20 m north, not 31 m along the tangent; what is left of the doubt is east."""
    boots = lost_at(np.array([20.0, 0.0, 0.0]), 1.2)
    block = boots.filter.layout.blocks[0]
    jacobian = np.zeros((1, boots.filter.layout.size))
    jacobian[0, block.yaw] = 1.0
    told = Measurement("course", np.array([0.5 * math.pi]), jacobian, np.array([[0.01]]), directs=True)
    boots.correct(told)
    np.testing.assert_allclose(boots.filter.state[block.position], [0.0, 20.0, 0.0], atol=0.3)
    spread = body.position_covariance(boots.filter.state, boots.filter.covariance, boots.stands(T0))
    east_m, north_m = np.sqrt(np.diag(spread)[:2])
    assert east_m == pytest.approx(20.0 * 0.1, rel=0.05)
    assert north_m < 0.3


def fix_at(place: Array) -> SatellitePosition:
    return SatellitePosition(T0, "gnss", (float(place[0]), float(place[1]), 0.0), 1.0, None, 60.0)


def test_a_fix_far_along_the_arc_moves_the_body_and_leaves_its_heading_to_others() -> None:
    """Who is 2 rad wrong about a way of 30 m learns from a fix where they are: which way they look, they do not."""
    boots = lost_at(np.array([30.0, 0.0, 0.0]), 1.2)
    config, counters = FusionConfig(feet=("left_foot",), gnss_sources=()), Counter[str]()
    satellites = Satellites(config.gnss, ORIGIN, counters)
    truth = 30.0 * np.array([math.cos(2.0), math.sin(2.0)])
    SatelliteAid(config, satellites, counters).correct(boots, fix_at(truth))
    block = boots.filter.layout.blocks[0]
    assert math.dist(boots.filter.state[block.position][:2], truth) < 2.0
    assert boots.filter.state[block.yaw] == 0.0
    assert boots.filter.covariance[block.yaw, block.yaw] == pytest.approx(1.44)
    near = lost_at(np.array([30.0, 0.0, 0.0]), 0.05)
    SatelliteAid(config, satellites, counters).correct(near, fix_at(np.array([30.0, 2.0])))
    assert near.filter.state[block.yaw] > 0.01, (
        "where the tangent is the arc, a fix tells the heading as ever"
    )


def test_fixes_that_are_refused_do_not_open_the_gate() -> None:
    """A receiver that is 300 m off, again and again: neither the place nor its doubt follow."""
    boots = lost_at(np.array([30.0, 0.0, 0.0]), 1.2)
    config, counters = FusionConfig(feet=("left_foot",), gnss_sources=()), Counter[str]()
    aid, before = (
        SatelliteAid(config, Satellites(config.gnss, ORIGIN, counters), counters),
        boots.filter.covariance,
    )
    for _ in range(40):
        aid.correct(boots, fix_at(np.array([0.0, 330.0])))
    np.testing.assert_array_equal(boots.filter.covariance, before)


@pytest.mark.parametrize("far_m", [3.0, 30.0])
def test_ranges_along_the_arc_move_the_body_and_leave_its_heading_to_others(far_m: float) -> None:
    """Four peers know where somebody is who went another way than they think: which way, no range tells.

    Nor does it after two steps, when the tangent would do for the place.
    """
    lost_m = np.array([far_m, 0.0, 0.0])
    boots, counters = lost_at(lost_m, 1.2), Counter[str]()
    cooperation = Cooperation(BY_BOOTS.peers, ORIGIN, counters)
    truth = far_m * np.array([math.cos(1.0), math.sin(1.0)])
    for number, place in enumerate([(0.0, 60.0), (70.0, 30.0), (-20.0, -40.0), (60.0, -50.0)], start=2):
        cooperation.track(track(f"a{number}", place))
        told = Range(time_ns=T0, sequence=number, peer=f"a{number}", distance_m=math.dist(truth, place))
        cooperation._peers.range(told, lost_m)
    cooperation.correct(boots, T0)
    block = boots.filter.layout.blocks[0]
    assert counters["located_by_ranges"] + counters["ranges_taken"] > 0
    assert math.dist(boots.filter.state[block.position][:2], truth) < 2.0
    assert boots.filter.state[block.yaw] == 0.0
    assert boots.filter.covariance[block.yaw, block.yaw] == pytest.approx(1.44)


@pytest.mark.parametrize("turn_rad", [0.0, 1e-9, 0.3, -2.0, math.pi])
def test_the_chord_is_the_exponentials(turn_rad: float) -> None:
    """Against the exponential of a planar motion: turned all the way while it goes 3 m ahead and 1 m aside."""
    along = np.array([3.0, 1.0])
    twist = np.array([[0.0, -turn_rad, along[0]], [turn_rad, 0.0, along[1]], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose((chord_of(turn_rad) @ [*along, 5.0])[:2], expm(twist)[:2, 2], atol=1e-12)
    assert (chord_of(turn_rad) @ [*along, 5.0])[2] == 5.0
