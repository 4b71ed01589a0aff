"""Ranges between soldiers: liars found out, nothing counted twice, the unplaced placed (METHODS D10)."""

import math
from collections.abc import Mapping
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.geodesy import LocalFrame
from bootprint.messages import FootPose, Position, Range, Track
from fusion.config import FusionConfig, PeersConfig, StartConfig
from fusion.consensus import agreeing, line, located
from fusion.engine import FusionCore
from fusion.filter import Measurement, StateFilter
from fusion.peers import Peers, Sight
from fusion.state import Array, Layout
from support.foot_walks import EAST, LEFT, NS, ORIGIN, RIGHT, T0, WHO, SimulatedWalk, envelope, in_time_order
from support.foot_walks import straight as straight_on
from support.peer_tracks import track

FRAME = LocalFrame(ORIGIN)
HERE = np.array([3.0, -4.0, 0.0])
AROUND = {"a2": (30.0, 10.0), "a3": (-20.0, 25.0), "a4": (5.0, -40.0), "a5": (-30.0, -20.0)}
CONFIG = PeersConfig()


def sight(peer: str, place: tuple[float, float], excess_m: float = 0.0, sigma_m: float = 1.0) -> Sight:
    at = np.array([*place, 0.0])
    return Sight(peer, at, sigma_m, float(np.linalg.norm(HERE - at)) + excess_m, 0.3)


# --- what fits together ----------------------------------------------------------------------------------------


def test_three_peers_tell_the_place_and_no_surer_than_the_worst_of_them() -> None:
    found = located([sight(peer, place) for peer, place in list(AROUND.items())[:3]], 0.0, 0.999)
    assert found is not None
    np.testing.assert_allclose(found.place, HERE[:2], atol=1e-3)
    assert np.linalg.eigvalsh(found.covariance)[0] > 1.0  # a metre that all may have in common


def test_peers_in_a_row_do_not_tell_one_side_from_the_other() -> None:
    row = [sight(f"a{number}", (10.0 * number, 0.0)) for number in (2, 3, 4)]
    found = located(row, 0.0, 0.999)
    assert found is not None
    mirrored = np.array([HERE[0], -HERE[1]])
    for place in (HERE[:2], mirrored):
        away = place - found.place
        assert away @ np.linalg.solve(found.covariance, away) < 6.0


def test_a_liar_among_peers_is_left_out_and_two_against_each_other_both() -> None:
    spread = 400.0 * np.eye(2)
    honest = [sight(peer, place) for peer, place in list(AROUND.items())[:3]]
    kept, out = agreeing([*honest, sight("a5", AROUND["a5"], 25.0)], HERE, spread, 0.999)
    assert [one.peer for one in kept] == ["a2", "a3", "a4"]
    assert [one.peer for one in out] == ["a5"]
    kept, out = agreeing([honest[0], sight("a9", (31.0, 10.0), 60.0)], HERE, spread, 0.999)
    assert kept == []
    assert len(out) == 2


def test_a_line_is_the_derivative_of_the_distance() -> None:
    seen, small = sight("a2", (30.0, 10.0)), 1e-5
    told = line(seen, HERE)
    assert told.residual_m == pytest.approx(0.0, abs=1e-9)
    for axis in (0, 1):
        moved = HERE.copy()
        moved[axis] += small
        change = (line(seen, HERE).residual_m - line(seen, moved).residual_m) / small
        assert told.toward[axis] == pytest.approx(change, abs=1e-5)


# --- nothing counts twice --------------------------------------------------------------------------------------

LAYOUT = Layout.of(("left_foot",))


def told(residual_m: float, variance_m2: float, *, entangled: bool) -> Measurement:
    jacobian = np.zeros((1, LAYOUT.size))
    jacobian[0, 0] = 1.0
    noise = np.array([[variance_m2]])
    return Measurement("range", np.array([residual_m]), jacobian, noise, entangled=entangled)


def unsure(cross: float) -> StateFilter:
    """4 m² east and north, which err together by ``cross``."""
    state_filter = StateFilter(LAYOUT)
    state_filter.widen_together(np.array([[4.0, cross, 0.0], [cross, 4.0, 0.0], [0.0, 0.0, 1.0]]))
    return state_filter


def test_told_again_and_again_nobody_gets_surer_than_who_tells() -> None:
    state_filter, naive = unsure(0.0), unsure(0.0)
    for _ in range(20):
        for one, entangled in ((state_filter, True), (naive, False)):
            one.update(told(1.0 - float(one.state[0]), 1.0, entangled=entangled))
    assert state_filter.state[0] == pytest.approx(1.0)
    assert state_filter.covariance[0, 0] == pytest.approx(1.0)
    assert naive.covariance[0, 0] < 0.06  # what averaging would claim


def test_what_errs_with_the_line_is_corrected_with_it() -> None:
    """Regression: the rest follows by cov/var of the difference, and keeps 4 − 2²/4 + (2/4)²·1 of variance."""
    state_filter = unsure(2.0)
    state_filter.update(told(1.0, 1.0, entangled=True))
    assert state_filter.state[1] == pytest.approx(0.5)
    assert state_filter.covariance[1, 1] == pytest.approx(4.0 - 1.0 + 0.25)


def test_two_who_take_over_from_each_other_stay_honest() -> None:
    """A rumour: both drift, whoever is worse takes the other's place over; stated variances hold on 500 pairs."""
    rng = np.random.default_rng(4)
    error, variance = rng.normal(0.0, [1.0, 3.0], (500, 2)), np.array([1.0, 9.0])
    for step in range(60):
        grows = np.array([0.3, 0.05]) if step % 20 < 10 else np.array([0.05, 0.3])
        error += rng.normal(0.0, np.sqrt(grows), error.shape)
        variance = variance + grows
        worse = int(np.argmax(variance))
        told_m2 = variance[1 - worse] + 0.1
        if told_m2 < 0.5 * variance[worse]:
            error[:, worse] = error[:, 1 - worse] + rng.normal(0.0, math.sqrt(0.1), len(error))
            variance[worse] = told_m2
        np.testing.assert_array_less(np.mean(error**2, axis=0), 1.25 * variance)


# --- ranges and tracks -----------------------------------------------------------------------------------------


def peers_hearing(distances_m: list[float], told_of: Track) -> list[Sight]:
    peers = Peers(CONFIG, ORIGIN)
    peers.track(told_of)
    for number, distance_m in enumerate(distances_m):
        peers.range(Range(time_ns=T0 + number * NS, peer="a2", distance_m=distance_m), HERE)
    return peers.sights(T0 + len(distances_m) * NS, HERE)


def test_of_ranges_through_walls_the_short_ones_count() -> None:
    true_m = math.dist(HERE[:2], (30.0, 10.0))
    (seen,) = peers_hearing([true_m + by for by in (0.0, 4.0, 0.1, 7.0, 2.0)], track("a2", (30.0, 10.0)))
    assert seen.distance_m == pytest.approx(true_m + 0.1, abs=0.05)


def test_own_lost_and_old_tracks_tell_nothing_and_age_is_doubt() -> None:
    place = (30.0, 10.0)
    assert peers_hearing([20.0], track("a2", place, via="own")) == []
    assert peers_hearing([20.0], track("a2", place, mode="lost")) == []
    assert peers_hearing([20.0], track("a2", place, T0 - 400 * NS)) == []
    (young,) = peers_hearing([20.0], track("a2", place))
    (old,) = peers_hearing([20.0], track("a2", place, T0 - 20 * NS))
    assert young.place_sigma_m < 2.0 < 8.0 < old.place_sigma_m


def test_nonsense_is_no_range() -> None:
    assert peers_hearing([1e300], track("a2", (30.0, 10.0))) == []


# --- the whole core --------------------------------------------------------------------------------------------


def squad_core(
    config: FusionConfig, walk: SimulatedWalk, places: Mapping[str, tuple[float, float]], excess_m: Array
) -> tuple[list[Position], FusionCore]:
    """A soldier among peers who stand still, ranged with once a second, their tracks told every three seconds."""
    core = FusionCore(config, WHO, ORIGIN)
    feet = in_time_order(walk.messages(LEFT), walk.messages(RIGHT))
    heard: list[Envelope] = []
    for second in range(1, int(walk.walk_s)):
        body = walk.body(LEFT, RIGHT, time_s=float(second))
        for index, (peer, place) in enumerate(places.items()):
            at_ns = T0 + second * NS + index * 1000
            if second % 3 == 1:
                heard.append(envelope("track", peer, track(peer, place, at_ns)))
            distance_m = math.dist(body, place) + excess_m[index]
            heard.append(
                envelope(
                    "range",
                    "uwb",
                    Range(time_ns=at_ns, sequence=second * 10 + index, peer=peer, distance_m=distance_m),
                )
            )
    out = [one for each in in_time_order(feet, heard) for one in core.handle(each)]
    return [one.message for one in [*out, *core.close()] if isinstance(one.message, Position)], core


def error_m(walk: SimulatedWalk, position: Position) -> float:
    true = walk.body(LEFT, RIGHT, time_s=(position.time_ns - T0) / NS)
    return math.hypot(position.east_m - true[0], position.north_m - true[1])


def test_a_wrong_start_is_mended_by_peers_and_a_liar_is_named() -> None:
    config = FusionConfig(
        gnss_sources=(), start=StartConfig(east_m=6.0, north_m=5.0, sigma_m=8.0, azimuth_deg=90.0)
    )
    walk = SimulatedWalk(straight_on(0.0), 30.0)
    positions, core = squad_core(config, walk, AROUND, np.array([0.0, 0.0, 0.0, 60.0]))
    assert error_m(walk, positions[-1]) < 1.5
    assert core.counters["ranges_taken"] > 0
    assert positions[-1].rejections == {"a5": "contradicted"}
    alone, _ = squad_core(
        msgspec.structs.replace(config, peers=PeersConfig(use=False)), walk, AROUND, np.zeros(4)
    )
    assert error_m(walk, alone[-1]) > 7.0


def test_an_unplaced_soldier_is_placed_by_peers() -> None:
    walk = SimulatedWalk(straight_on(0.7), 60.0)
    positions, core = squad_core(FusionConfig(gnss_sources=()), walk, AROUND, np.zeros(4))
    assert core.counters["placed"] == 1
    assert positions[-1].mode == "boots"
    assert error_m(walk, positions[-1]) < 3.0


def test_who_is_surer_than_the_peers_is_left_alone() -> None:
    walk = SimulatedWalk(straight_on(0.0), 20.0)
    config = FusionConfig(gnss_sources=(), start=EAST)
    with_peers, core = squad_core(config, walk, AROUND, np.full(4, 1.0))
    alone, _ = squad_core(config, walk, {}, np.zeros(0))
    assert core.counters["ranges_taken"] == 0
    assert error_m(walk, with_peers[-1]) == pytest.approx(error_m(walk, alone[-1]), abs=1e-9)


def test_a_range_between_the_feet_holds_them_apart_while_both_stand() -> None:
    """Feet stand 0.24 m apart, which passing feet do not tell; a range does."""
    alone, ranged = feet_apart_m(None), feet_apart_m(0.24)
    assert abs(ranged - 0.24) < 0.5 * abs(alone - 0.24)


def feet_apart_m(ranged_m: float | None) -> float:
    """After a walk and five seconds of standing, ranged ten times a second if at all."""
    walk = SimulatedWalk(straight_on(0.0), 12.0, stand_s=6.0)
    core = FusionCore(FusionConfig(gnss_sources=(), start=EAST), WHO, ORIGIN)
    for each in in_time_order(walk.messages(LEFT), walk.messages(RIGHT)):
        time_ns = each.message.time_ns
        if isinstance(each.message, FootPose) and time_ns > T0 + 14 * NS:
            each = replace(each, message=msgspec.structs.replace(each.message, in_stance=True))
        list(core.handle(each))
        if ranged_m is not None and isinstance(each.message, FootPose) and each.address.source == "left_foot":
            number = each.message.sequence
            ranged = Range(time_ns=time_ns, sequence=number, peer="a1/right_foot", distance_m=ranged_m)
            list(core.handle(envelope("range", "feet", ranged)))
    list(core.close())
    feet = core.estimator.boots.feet
    return float(
        np.linalg.norm(feet["left_foot"].trail.at(T0 + 17 * NS) - feet["right_foot"].trail.at(T0 + 17 * NS))
    )
