"""What becomes of samples before the filter uses them: missing ones, cut peaks, forces at their limit, gaps."""

import math

import numpy as np
import pytest

from pdr_engine.foot import FootNavigator, FootSettings, clipping, intake
from pdr_engine.foot.gap import doubt_gap
from pdr_engine.foot.kernel import propagate
from pdr_engine.foot.memory import RING, SAMPLE, fresh_state
from pdr_engine.foot.parameters import parameters
from support.foot_streams import START_NS, Stream, navigate, still, walk

INTERVAL_NS = 5_000_000
WALK = walk(8)


def state_and_parameters() -> tuple[np.record, np.record]:
    return fresh_state(FootSettings())[0], parameters(FootSettings())[0]


def samples(times_ms: list[float], values: list[float]) -> np.ndarray:
    """Samples whose accelerometer and gyro read the value along every axis."""
    rows = np.zeros(len(times_ms), SAMPLE)
    rows["time_ns"] = START_NS + np.round(np.array(times_ms) * 1e6).astype(np.int64)
    rows["accel"], rows["gyro"] = np.array(values)[:, None], np.array(values)[:, None]
    return rows


def taken(rows: np.ndarray) -> np.record:
    """The state after these samples."""
    state, _ = state_and_parameters()
    for row in rows:
        for left in range(intake.missing(state, row), 0, -1):
            intake.fill(state, row, left)
        intake.push(state, row)
    return state


def test_missing_samples_lie_on_the_line_between_their_neighbours() -> None:
    state = taken(samples([0, 5, 10, 25, 30], [0.0, 0.0, 1.0, 4.0, 4.0]))
    assert state["head"] == 7
    np.testing.assert_allclose(state["gyro"][:7, 0], [0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 4.0])
    np.testing.assert_allclose(state["accel"][:7, 2], state["gyro"][:7, 0])
    np.testing.assert_array_equal(np.diff(state["time_ns"][:7]), INTERVAL_NS)
    assert list(state["filled"][:7]) == [0, 0, 0, 1, 1, 0, 0]
    assert (state["missing"], state["accepted"]) == (2, 5)


def test_trembling_stamps_and_gaps_are_not_filled_in() -> None:
    assert taken(samples([0, 5, 10, 18, 20], [0.0] * 5))["missing"] == 0
    gap = taken(samples([0, 5, 10, 61, 66], [0.0] * 5))
    assert (gap["missing"], gap["gaps"]) == (0, 1)


def test_the_usual_interval_is_that_of_most_samples() -> None:
    """Not their mean, 6.2 ms, when a fifth is missing."""
    kept = np.random.default_rng(1).random(2000) > 0.2
    state = taken(samples(list(5.0 * np.flatnonzero(kept)), [0.0] * int(kept.sum())))
    assert state["usual_ns"] == pytest.approx(INTERVAL_NS, rel=0.05)
    assert state["missing"] == pytest.approx(2000 - kept.sum(), abs=30)


def test_a_sensor_that_becomes_slower_for_good_is_believed_in_the_end() -> None:
    """200 Hz, then 60: at first two of three seem to be missing, in the last seconds none does."""
    times_ms = np.concatenate([5.0 * np.arange(400), 2000.0 + 1000.0 / 60.0 * np.arange(1800)])
    state = taken(samples(list(times_ms), [0.0] * len(times_ms)))
    assert state["usual_ns"] == pytest.approx(1e9 / 60.0, rel=0.05)
    assert not state["filled"][np.arange(state["head"] - 1000, state["head"]) % RING].any()
    assert 100 < state["missing"] < 1000


def test_only_samples_that_came_are_reported() -> None:
    kept = np.random.default_rng(2).random(len(WALK.time_ns)) > 0.1
    track = navigate(WALK.only(kept))
    assert np.isin(track.time_ns, WALK.time_ns[kept]).all()
    assert len(track.time_ns) == kept.sum()
    assert track.counters["missing"] > 100


def half_sine(peak: float, length_s: float, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (s) and a rate (rad/s) that rises from 0 to a peak and back, with 0.1 s of nothing on both sides."""
    time_s = np.arange(0.0, length_s + 0.2, 1.0 / rate_hz)
    phase = np.clip((time_s - 0.1) / length_s, 0.0, 1.0)
    return time_s, peak * np.sin(np.pi * phase)


def used_by_the_filter(time_s: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.record]:
    """Rates about y as the filter meets them: cleaned 35 ms after they came, used another 60 ms later."""
    state, p = state_and_parameters()
    n = len(time_s)
    state["time_ns"][:n] = np.round(time_s * 1e9)
    state["gyro"][:n, 1] = rate
    interval = time_s[1] - time_s[0]
    ahead, behind = round(0.035 / interval), round(0.06 / interval)
    used = np.zeros(n)
    for at in range(n + behind):
        state["head"], state["done"] = min(at + ahead, n), max(0, at - behind)
        if at < n:
            clipping.mend(state, p, at)
        if at >= behind:
            used[at - behind] = state["gyro"][at - behind, 1]
    return used, state


@pytest.mark.parametrize("rate_hz", [200.0, 400.0, 800.0])
@pytest.mark.parametrize(("length_s", "limit"), [(0.15, 11.0), (0.25, 9.0), (0.32, 9.0)])
def test_a_cut_peak_keeps_its_angle(rate_hz: float, length_s: float, limit: float) -> None:
    """The plateaus last 40, 115 and 150 ms: the longer ones begin to be used before their end is known."""
    time_s, true = half_sine(12.0, length_s, rate_hz)
    used, state = used_by_the_filter(time_s, np.minimum(true, limit))
    lost = (true - np.minimum(true, limit)).sum()
    assert state["clippings"] == 1
    assert abs((true - used).sum()) < 0.3 * lost


@pytest.mark.parametrize("rate_hz", [60.0, 100.0, 200.0, 400.0, 800.0])
def test_a_round_peak_is_not_a_cut_one_at_any_rate(rate_hz: float) -> None:
    time_s, true = half_sine(9.0, 0.25, rate_hz)
    used, state = used_by_the_filter(time_s, true)
    assert state["clippings"] == 0
    assert np.array_equal(used, true)


def forces_at_limit(values: list[float]) -> list[int]:
    state, p = state_and_parameters()
    marks = []
    for row in samples([5.0 * k for k in range(len(values))], values):
        intake.push(state, row)
        clipping.watch_force(state, p, state["head"] - 1)
        marks.append(int(state["cut_force"][state["head"] - 1, 0]))
    return marks


def test_a_limit_of_the_accelerometer_shows_by_repetition() -> None:
    """Four equal ones are a limit; below 30 m/s² nothing is; the limit of one side is not that of the other."""
    assert forces_at_limit([156.9, 10.0, 156.8, 80.0, 156.9, 156.7, -156.9]) == [0, 0, 0, 0, 0, 1, 0]
    assert sum(forces_at_limit([90.0, 95.0, 93.0, 99.0, 97.0, 98.0])) == 0
    assert sum(forces_at_limit([20.0] * 10)) == 0


def test_a_higher_force_shows_that_there_was_no_limit() -> None:
    assert forces_at_limit([60.0, 60.0, 60.0, 60.0, 70.0, 60.0, 70.0]) == [0, 0, 0, 1, 0, 0, 0]


def test_a_force_at_its_limit_is_doubted_along_its_axis() -> None:
    """σ of clip_excess · dt on the velocity along the sensor's x, which lies along nav y here."""
    variances = []
    for mark in (0, 1):
        state, p = state_and_parameters()
        state["attitude"] = [math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
        state["cut_force"][0, 0] = mark
        propagate(state, p, 0, 0.005, False)
        variances.append(np.diag(state["P"])[3:6].copy())
    excess = FootSettings().filter.clip_excess_m_s2
    np.testing.assert_allclose(variances[1] - variances[0], [0.0, (excess * 0.005) ** 2, 0.0], atol=1e-12)


def test_a_gaps_covariance_is_that_of_white_acceleration() -> None:
    """Monte Carlo of what `doubt_gap` states in closed form: place and velocity, and what they have in common."""
    state, p = state_and_parameters()
    dt, parts = 0.3, 200
    doubt_gap(state, p, dt)
    rng = np.random.default_rng(3)
    sigma = FootSettings().filter.gap_accel_m_s2 * math.sqrt(parts)
    steps = rng.normal(0.0, sigma, (20_000, parts)) * dt / parts
    velocity = steps.sum(axis=1)
    place = (np.cumsum(steps, axis=1) * dt / parts).sum(axis=1)
    np.testing.assert_allclose(state["P"][np.ix_([0, 3], [0, 3])], np.cov(place, velocity), rtol=0.05)
    assert np.array_equal(state["P"], state["P"].T)
    assert np.linalg.eigvalsh(state["P"]).min() > -1e-12


def test_a_burst_in_swing_is_doubted_the_more_the_longer_it_is() -> None:
    in_swing = int(np.flatnonzero(np.abs(WALK.gyro[:, 1]) > 3.0)[0])
    doubts = []
    for lost in (0, 4, 20, 40):
        kept = np.ones(len(WALK.time_ns), bool)
        kept[in_swing : in_swing + lost] = False
        steps = [step for step in navigate(WALK.only(kept)).steps if step.motion != "standing"]
        doubts.append(steps[0].covariance[0, 0])
    assert doubts == sorted(doubts)
    assert doubts[-1] > 20 * doubts[0]


@pytest.mark.parametrize("sensor", ["microstrain-gx3", "unknown"])
def test_faults_of_all_kinds_give_the_same_in_any_batches(sensor: str) -> None:
    kept = np.random.default_rng(4).random(len(WALK.time_ns)) > 0.1
    kept[900:950] = False
    peak = 0.9 * np.abs(WALK.gyro).max()
    faulty = Stream(WALK.time_ns, np.clip(WALK.accel, -31.0, 31.0), np.clip(WALK.gyro, -peak, peak)).only(
        kept
    )
    settings = FootSettings(sensor=sensor)
    whole, cut = (
        navigate(faulty, foot=settings),
        navigate(faulty, list(range(0, kept.sum(), 7)), foot=settings),
    )
    assert whole.counters == cut.counters
    assert min(whole.counters[name] for name in ("missing", "gaps", "clippings")) > 0
    assert np.array_equal(whole.position_m, cut.position_m)


def heard(noise: float, seconds: float = 5.0) -> tuple[float, float]:
    """The filter's gyro density, rad/s/√Hz, after rest with an unknown sensor of 0.001·noise rad/s at 200 Hz."""
    navigator = FootNavigator(FootSettings(sensor="unknown"))
    rest = still(seconds, noise=noise)
    navigator.process(rest.time_ns, rest.accel, rest.gyro)
    return float(navigator._state["gyro_noise"][0]), noise * 0.001 / math.sqrt(200.0)


def test_an_unknown_sensors_noise_is_heard_at_rest() -> None:
    """The sensor's own part of the variance; twice the noise is four times that part."""
    worst = FootSettings(sensor="unknown").filter.gyro_noise_rad_s_sqrt_hz
    motion = worst**2 - math.radians(0.03) ** 2
    for noise in (2.0, 4.0):
        found, own = heard(noise)
        assert found**2 - motion == pytest.approx(own**2, rel=0.25)


def test_what_is_heard_is_bounded_by_the_presets() -> None:
    worst = FootSettings(sensor="unknown").filter.gyro_noise_rad_s_sqrt_hz
    assert heard(20.0)[0] == pytest.approx(worst)
    assert worst > heard(0.1)[0] > 0.8 * math.sqrt(worst**2 - math.radians(0.03) ** 2)


def test_without_rest_an_unknown_sensor_stays_the_worst() -> None:
    navigator = FootNavigator(FootSettings(sensor="unknown"))
    moving = WALK.only((WALK.time_ns - START_NS > 2.3e9) & (WALK.time_ns - START_NS < 8e9))
    shaken = moving.gyro + np.random.default_rng(5).normal(0.0, 0.1, moving.gyro.shape)
    navigator.process(moving.time_ns, moving.accel, shaken)
    assert navigator._state["gyro_noise"][0] == FootSettings(sensor="unknown").filter.gyro_noise_rad_s_sqrt_hz
