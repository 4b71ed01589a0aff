"""The foot navigator on constructed walks: analytic answers, any mounting, any batches, and bad input."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pdr_engine.foot import FootNavigator, FootSettings, FootStepEstimate, clipping
from pdr_engine.foot.memory import fresh_state
from pdr_engine.foot.parameters import parameters
from pdr_engine.foot.uncertainty import surprise
from support.foot_streams import START_NS, Stream, Track, navigate, still, turning, walk

quick = settings(max_examples=20, deadline=None)
WALK = walk(8)
DISTANCE = 5 * 1.3 - 1.3, 4 * 1.3  # four strides ahead, then the turn and four more to the left


def composed(track: Track) -> tuple[np.ndarray, np.ndarray]:
    """Positions (k+1, 3) and yaws (k+1,) at the ends of the steps, from the steps alone."""
    position, yaw = np.zeros((1, 3)), np.zeros(1)
    for step in track.steps:
        turn = Rotation.from_euler("z", yaw[-1])
        position = np.vstack([position, position[-1] + turn.apply(step.displacement_m)])
        yaw = np.append(yaw, yaw[-1] + step.heading_change_rad)
    return position, yaw


def moved(track: Track) -> list[float]:
    """Lengths of the steps that moved."""
    return [math.hypot(*step.displacement_m[:2]) for step in track.steps if step.motion != "standing"]


def test_a_still_sensor_stays_where_it_is_and_its_doubt_stays_bounded() -> None:
    track = navigate(still(60.0))
    assert np.abs(track.position_m).max() < 0.005
    assert {step.motion for step in track.steps} == {"standing"}
    assert len(track.steps) == pytest.approx(120, abs=2)
    deviations = np.array([np.sqrt(np.diag(step.covariance)) for step in track.steps])
    assert (deviations > 0).all()
    assert deviations[-1].max() < 0.01
    assert deviations[-20:, 3].max() < deviations[:3, 3].max()  # the gyro bias is learnt


def test_a_walk_of_known_way() -> None:
    track = navigate(WALK)
    np.testing.assert_allclose(track.position_m[-1], [*DISTANCE, 0.0], atol=0.08)
    assert track.yaw_rad[-1] == pytest.approx(math.pi / 2, abs=0.01)
    assert moved(track) == pytest.approx([1.3] * 8, abs=0.02)
    assert {step.motion for step in track.steps} == {"standing", "walking"}


@quick
@given(st.integers(0, 2**32 - 1))
def test_any_mounting_walks_the_same_way(seed: int) -> None:
    mounting = Rotation.random(rng=np.random.default_rng(seed))
    track = navigate(WALK.mounted(mounting))
    assert math.hypot(*track.position_m[-1, :2]) == pytest.approx(math.hypot(*DISTANCE), abs=0.06)
    assert abs(track.position_m[-1, 2]) < 0.08
    assert track.yaw_rad[-1] - track.yaw_rad[0] == pytest.approx(math.pi / 2, abs=0.02)
    assert moved(track) == pytest.approx([1.3] * 8, abs=0.03)
    assert track.steps[2].displacement_m[2] == pytest.approx(0.0, abs=0.02)


@quick
@given(st.lists(st.integers(0, len(WALK.time_ns)), max_size=30))
def test_the_cut_into_batches_changes_nothing(cuts: list[int]) -> None:
    whole, cut = navigate(WALK), navigate(WALK, cuts)
    for name in ("time_ns", "position_m", "yaw_rad", "stance"):
        assert np.array_equal(getattr(whole, name), getattr(cut, name)), name
    assert [step.time_ns for step in whole.steps] == [step.time_ns for step in cut.steps]
    assert all(
        np.array_equal(a.covariance, b.covariance) for a, b in zip(whole.steps, cut.steps, strict=True)
    )


def test_single_samples_give_what_the_whole_file_gives() -> None:
    whole, single = navigate(WALK), navigate(WALK, list(range(1, len(WALK.time_ns))))
    assert np.array_equal(whole.position_m, single.position_m)


def test_composed_steps_are_the_track_at_stances() -> None:
    track = navigate(WALK)
    position, yaw = composed(track)
    at = np.searchsorted(track.time_ns, [step.time_ns for step in track.steps])
    np.testing.assert_allclose(position[1:], track.position_m[at], atol=1e-9)
    np.testing.assert_allclose(np.sin(yaw[1:] - track.yaw_rad[at]), 0.0, atol=1e-9)
    starts = [step.start_time_ns for step in track.steps]
    assert starts[1:] == [step.time_ns for step in track.steps][:-1]
    assert track.stance[at].all()


@pytest.mark.parametrize("rate_rad_s", [1.5, -1.5])
@pytest.mark.parametrize("up", [(0, 0, 1), (0, 0, -1), (0, 1, 0), (1, 0, 0)])
def test_a_turn_about_the_vertical_is_a_heading_change(rate_rad_s: float, up: tuple[int, ...]) -> None:
    parts = Stream.joined(still(1.0), turning(1.0, rate_rad_s), still(1.0))
    mounting, _ = Rotation.align_vectors([up], [[0, 0, 1]])
    track = navigate(parts.mounted(mounting))
    assert sum(step.heading_change_rad for step in track.steps) == pytest.approx(rate_rad_s, abs=0.01)


def test_a_foot_may_pitch_upright_in_the_swing() -> None:
    """The sole goes through 100° of pitch and back: yaw stays what it was."""
    parts = Stream.joined(
        still(1.0), turning(0.4, 1.745 / 0.4, axis=1), turning(0.4, -1.745 / 0.4, axis=1), still(1.0)
    )
    parts.accel[:] = [0.0, 0.0, 9.81]
    pitch = np.cumsum(parts.gyro[:, 1]) * 0.005
    parts.accel[:, 0], parts.accel[:, 2] = -9.81 * np.sin(pitch), 9.81 * np.cos(pitch)
    track = navigate(parts)
    assert np.abs(track.yaw_rad).max() < 0.02


def test_results_come_within_100_ms() -> None:
    navigator = FootNavigator()
    newest = []
    for k in range(len(WALK.time_ns)):
        output = navigator.process(WALK.time_ns[k : k + 1], WALK.accel[k : k + 1], WALK.gyro[k : k + 1])
        newest.extend(output.time_ns[-1:])
        if newest:
            assert WALK.time_ns[k] - newest[-1] <= 100_000_000
    assert len(newest) > 0.9 * len(WALK.time_ns)


def test_a_third_of_a_second_of_rest_is_enough() -> None:
    track = navigate(WALK.only(np.arange(len(WALK.time_ns)) >= round(1.7 * 200)))
    np.testing.assert_allclose(track.position_m[-1], [*DISTANCE, 0.0], atol=0.08)
    assert len(moved(track)) == 8


@pytest.mark.parametrize("into_swing_s", [0.05, 0.15, 0.25])
def test_a_start_in_the_swing_loses_nothing_and_owns_up_to_its_doubt(into_swing_s: float) -> None:
    """The rest of the swing is known from the first stance backwards, but its start speed only from that."""
    begin = round((2.0 + into_swing_s) * 200)
    track, whole = navigate(WALK.only(np.arange(len(WALK.time_ns)) >= begin)), navigate(WALK)
    way, way_whole = (
        track.position_m[-1] - track.position_m[0],
        whole.position_m[-1] - whole.position_m[begin],
    )
    assert math.hypot(*way[:2]) == pytest.approx(math.hypot(*way_whole[:2]), abs=0.15)
    assert way[2] == pytest.approx(way_whole[2], abs=0.15)
    assert track.steps[0].covariance[0, 0] > 20 * track.steps[-1].covariance[0, 0]


def test_the_gyro_bias_comes_from_rest_and_not_from_a_turn() -> None:
    bias = np.array([0.004, -0.006, 0.005])
    biased = Stream(WALK.time_ns, WALK.accel, WALK.gyro + bias)
    assert navigate(biased).yaw_rad[-1] == pytest.approx(math.pi / 2, abs=0.02)
    turned = navigate(Stream.joined(turning(1.0, 0.04), WALK))  # as constant as a bias, but too fast
    assert turned.yaw_rad[-1] == pytest.approx(math.pi / 2 + 0.04, abs=0.06)


def clipped_walk(part: float) -> Stream:
    """The walk with a gyro that saturates at this part of its peak."""
    peak = np.abs(WALK.gyro).max()
    assert part * peak > 6.0  # what the settings think can clip
    return Stream(WALK.time_ns, WALK.accel, np.clip(WALK.gyro, -part * peak, part * peak))


def test_clipped_peaks_are_rebuilt_from_their_flanks() -> None:
    cut = clipped_walk(0.9)
    state, p = fresh_state(FootSettings())[0], parameters(FootSettings())[0]
    n = min(1000, len(WALK.time_ns))
    state["time_ns"][:n], state["gyro"][:n], state["head"] = cut.time_ns[:n], cut.gyro[:n], n
    for at in range(n):
        clipping.mend(state, p, at)
    lost = np.abs(cut.gyro - WALK.gyro)[:n]
    left = np.abs(state["gyro"][:n] - WALK.gyro[:n])
    assert lost[:, 1].sum() > 1.0
    assert left[:, 1].sum() < 0.4 * lost[:, 1].sum()
    assert (state["clipped"][:n][lost > 0.1] == 1).all()


def test_a_walk_with_a_clipped_gyro_stays_good() -> None:
    track = navigate(clipped_walk(0.9))
    assert track.counters["clippings"] >= 8
    np.testing.assert_allclose(track.position_m[-1], [*DISTANCE, 0.0], atol=0.1)


def own_variance(step: FootStepEstimate) -> float:
    """The filter's own doubt of the way forward: without what all steps share, and not widened by the landing."""
    shared = (step.common_scale_sigma * step.displacement_m[0]) ** 2
    return float(step.covariance[0, 0] - shared) / surprise(step.landing_nis)


def test_a_short_gap_is_counted_and_doubted() -> None:
    """As much as it deserves: the landing behind it does not surprise (99 % of χ² with 3 degrees of freedom)."""
    in_swing = np.flatnonzero(np.abs(WALK.gyro[:, 1]) > 6.0)[0]
    kept = np.ones(len(WALK.time_ns), bool)
    kept[in_swing : in_swing + 20] = False
    whole, gap = navigate(WALK), navigate(WALK.only(kept))
    assert gap.counters["gaps"] == 1
    hit = next(i for i, step in enumerate(gap.steps) if step.motion != "standing")
    assert own_variance(gap.steps[hit]) > 4 * own_variance(whole.steps[hit])
    assert gap.steps[hit].landing_nis < 11.34
    assert not any(step.realigned for step in gap.steps)


def test_a_long_gap_realigns_and_keeps_the_heading() -> None:
    pause = Stream.joined(WALK, still(2.0))
    pause.time_ns[len(WALK.time_ns) :] += 5_000_000_000
    track = navigate(pause)
    realigned = [step for step in track.steps if step.realigned]
    assert track.counters["realignments"] == len(realigned) == 1
    assert realigned[0].motion == "unknown"
    assert realigned[0].covariance[0, 0] > 1.0
    assert track.yaw_rad[-1] == pytest.approx(math.pi / 2, abs=0.02)
    np.testing.assert_allclose(track.position_m[-1], [*DISTANCE, 0.0], atol=0.06)


def test_duplicate_backward_and_broken_samples_change_nothing() -> None:
    rng = np.random.default_rng(1)
    at = np.sort(rng.choice(len(WALK.time_ns) - 1, 60, replace=False)) + 1
    bad_time = np.where(np.arange(60) % 3 == 0, WALK.time_ns[at - 1], WALK.time_ns[at - 1] + 1_000_000)
    bad_time[1::3] -= 30_000_000
    bad_accel = np.tile([np.nan, 0.0, 9.8], (60, 1))
    bad_accel[1::3] = bad_accel[::3] = [500.0, 0.0, 0.0]
    soiled = Stream(
        np.insert(WALK.time_ns, at, bad_time),
        np.insert(WALK.accel, at, bad_accel, axis=0),
        np.insert(WALK.gyro, at, 100.0, axis=0),
    )
    track, clean = navigate(soiled), navigate(WALK)
    assert track.counters["dropped"] == 60
    assert np.array_equal(track.position_m, clean.position_m)


def test_one_wild_stamp_does_not_deafen_the_foot() -> None:
    wild = Stream(WALK.time_ns.copy(), WALK.accel, WALK.gyro)
    wild.time_ns[200] = 2**62
    track = navigate(wild)
    assert track.counters["realignments"] == 2
    assert len(moved(track)) >= 8
    assert all(step.start_time_ns <= step.time_ns for step in track.steps)


@quick
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 6.0))
def test_garbage_ends_in_finite_numbers(seed: int, magnitude: float) -> None:
    rng = np.random.default_rng(seed)
    n = 600
    scale = 10.0**magnitude
    noise = Stream(
        START_NS + np.cumsum(rng.integers(-2_000_000, 20_000_000, n)),
        rng.normal(size=(n, 3)) * scale,
        rng.normal(size=(n, 3)) * scale,
    )
    track = navigate(Stream.joined(still(1.0), noise, still(2.0)))
    assert np.isfinite(track.position_m).all()
    for step in track.steps:
        assert np.isfinite(step.displacement_m).all()
        assert np.linalg.eigvalsh(step.covariance).min() > -1e-9 * np.trace(step.covariance)


def test_divergence_goes_back_to_the_last_stance() -> None:
    thrown = turning(1.0, 1.0)
    thrown.accel[:, 0] = 60.0
    track = navigate(Stream.joined(still(2.0), thrown, still(2.0)))
    assert track.counters["realignments"] >= 1
    assert np.linalg.norm(track.position_m[-1]) < 15.0
    assert any(step.realigned for step in track.steps)
