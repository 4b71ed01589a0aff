"""Steps and what they look like: sinusoid walkers of which everything is known by hand."""

import math
from itertools import pairwise

import numpy as np
import pytest

from pdr_engine.body.azimuth.ahead import Ahead
from pdr_engine.body.length.network import Network, inputs_of
from pdr_engine.body.length.network_weights import NETWORK
from pdr_engine.body.length.step_length import (
    LONGEST_M,
    SHORTEST_M,
    Placement,
    StepLengths,
    blend,
    frequency,
    network,
    pendulum,
    projected,
    weinberg,
)
from pdr_engine.body.settings import LengthSettings, StepSettings
from pdr_engine.body.steps.footfalls import Footfalls
from pdr_engine.body.steps.gait import Gait, gait_of
from pdr_engine.body.steps.grid import CELL_NS, CELL_S
from pdr_engine.body.steps.rhythm import unevenness

LEVEL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SETTINGS = LengthSettings()


def steps_in(vertical: np.ndarray) -> list[tuple[int, int]]:
    footfalls = Footfalls(StepSettings())
    return [step for k, value in enumerate(vertical) for step in footfalls.take(k * CELL_NS, float(value))]


def sine(frequency_hz: float, amplitude: float, seconds: float = 20.0) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * frequency_hz * np.arange(0.0, seconds, CELL_S))


@pytest.mark.parametrize(("frequency_hz", "amplitude"), [(1.0, 0.7), (1.4, 1.0), (1.9, 4.0), (2.8, 12.0)])
def test_every_step_of_a_regular_walk_is_found_once(frequency_hz: float, amplitude: float) -> None:
    steps = steps_in(sine(frequency_hz, amplitude))
    assert abs(len(steps) - 20.0 * frequency_hz) <= 1.0
    assert all(a[1] == b[0] for a, b in pairwise(steps))
    intervals = [(end - start) * 1e-9 for start, end in steps]
    assert np.mean(intervals) == pytest.approx(1.0 / frequency_hz, rel=0.01)


def test_a_step_ends_at_its_peak() -> None:
    (_, end_ns), *_ = steps_in(sine(2.0, 3.0))
    assert end_ns * 1e-9 % 0.5 == pytest.approx(0.125, abs=CELL_S)


def test_double_peaks_within_a_step_count_once() -> None:
    time_s = np.arange(0.0, 20.0, CELL_S)
    vertical = 2.0 * np.sin(2 * np.pi * 1.5 * time_s) + 1.2 * np.sin(2 * np.pi * 3.0 * time_s + 2.0)
    assert abs(len(steps_in(vertical)) - 30) <= 1


def test_standing_and_irregular_jolts_are_no_steps() -> None:
    rng = np.random.default_rng(1)
    assert steps_in(0.2 * rng.standard_normal(2000)) == []
    jolts = np.zeros(3000)
    at, wait = 20, 0
    for wait in (22, 71, 35, 64, 24, 70, 30, 74, 40, 22, 66, 33, 72, 26, 60):
        at += wait
        jolts[at : at + 12] += 4.0 * np.hanning(12)
    assert steps_in(jolts) == []


def test_a_walk_goes_on_only_with_three_steps() -> None:
    two = np.concatenate([np.zeros(50), sine(2.0, 3.0, 1.0), np.zeros(150)])
    assert steps_in(two) == []
    four = np.concatenate([np.zeros(50), sine(2.0, 3.0, 2.0), np.zeros(150)])
    assert len(steps_in(four)) == 4


def gait_with(frequency_hz: float = 2.0, rise_m: float = 0.05, ahead_rad: float = 0.0) -> Gait:
    """Two exact steps: height rise/2 cos φ, the surge half as strong and a quarter of a step ahead, some sway."""
    count = round(2.0 / frequency_hz / CELL_S)
    time_s = np.arange(count) * CELL_S
    phi = 2.0 * np.pi * frequency_hz * time_s
    vertical = -0.5 * rise_m * (2.0 * np.pi * frequency_hz) ** 2 * np.cos(phi)
    size = 0.25 * rise_m * (2.0 * np.pi * frequency_hz) ** 2
    surge = size * np.sin(phi)
    sway = 0.5 * np.cos(0.5 * phi)
    x = np.cos(ahead_rad) * surge - np.sin(ahead_rad) * sway
    y = np.sin(ahead_rad) * surge + np.cos(ahead_rad) * sway
    return gait_of(time_s, np.column_stack([x, y, vertical]), count * CELL_S / 2, slice(count // 2, count))


def test_rise_frequency_and_range_come_back() -> None:
    gait = gait_with(2.0, 0.06)
    amplitude = 0.03 * (4.0 * np.pi) ** 2
    assert gait.frequency_hz == pytest.approx(2.0)
    assert gait.rise_m == pytest.approx(0.06, rel=1e-6)
    assert gait.range_m_s2 == pytest.approx(2.0 * amplitude, rel=0.02)
    assert gait.variance_m2_s4 == pytest.approx(amplitude**2 / 2.0, rel=0.02)
    assert gait.sharpness == pytest.approx(1.0, rel=0.02)
    assert 0.5 <= gait.surge_share < 0.52


@pytest.mark.parametrize("degrees", [0.0, 35.0, 140.0, -100.0])
def test_the_push_points_ahead_and_sway_does_not_count(degrees: float) -> None:
    push = gait_with(ahead_rad=math.radians(degrees)).push
    assert math.degrees(math.atan2(push[1], push[0])) == pytest.approx(degrees, abs=0.5)


def test_the_direction_is_learned_against_the_prior_and_then_held() -> None:
    ahead = Ahead("auto", 0.0)
    assert ahead.reference(LEVEL) == (1.0, 0.0)
    left = gait_with(ahead_rad=0.5 * np.pi + 0.3)
    for _ in range(10):
        ahead.learn(left, 0.0, LEVEL, "forward", False)
    assert ahead.angle_rad == pytest.approx(0.0)  # ten steps are not enough against x
    for _ in range(50):
        ahead.learn(left, 0.0, LEVEL, "forward", False)
    assert ahead.angle_rad == pytest.approx(0.5 * np.pi)  # the unit's own axis, not the push's 107°
    for _ in range(300):
        ahead.learn(gait_with(), 0.0, LEVEL, "forward", False)
    assert ahead.angle_rad == pytest.approx(0.5 * np.pi)


def test_steps_aside_and_back_are_turned_and_runs_do_not_count() -> None:
    ahead = Ahead("auto", 0.0)
    for way, degrees in (("forward", 0.0), ("left", 90.0), ("backward", 180.0), ("right", -90.0)):
        for _ in range(15):
            ahead.learn(gait_with(ahead_rad=math.radians(degrees + 50.0)), 0.0, ((*LEVEL,)), way, False)
    assert math.degrees(ahead.angle_rad) == pytest.approx(0.0)  # 20 steps' worth of x, and 50° of 60 steps
    runner = Ahead("auto", 0.0)
    for _ in range(60):
        runner.learn(gait_with(ahead_rad=2.0), 0.0, LEVEL, "forward", True)
    assert runner.angle_rad == 0.0


def test_the_direction_is_known_once_pushes_agree_with_it() -> None:
    ahead, against = Ahead("auto", 0.0), Ahead("auto", 0.0)
    assert not ahead.known
    for _ in range(12):
        ahead.learn(gait_with(), 0.0, LEVEL, "forward", False)
        against.learn(gait_with(ahead_rad=1.6), 0.0, LEVEL, "forward", False)
    assert ahead.known
    assert not against.known
    assert Ahead("x", 0.0).known


def test_turns_do_not_tell_the_direction_and_a_told_one_is_kept() -> None:
    turning, told = Ahead("auto", 0.0), Ahead("-y", 0.1)
    assert told.reference(LEVEL) == (0.0, -1.0)
    for _ in range(60):
        turning.learn(gait_with(ahead_rad=2.0), 0.6, LEVEL, "forward", False)
        told.learn(gait_with(ahead_rad=2.0), 0.0, LEVEL, "forward", False)
    assert turning.angle_rad == 0.0
    assert told.angle_rad == pytest.approx(-0.1)


def test_step_lengths_by_hand() -> None:
    gait = gait_with(2.0, 0.05)
    chord = 2.0 * math.sqrt(2.0 * 0.9 * 0.05 - 0.05**2)  # 0.5916
    assert pendulum(gait, SETTINGS, 1.25, False) == pytest.approx(1.25 * chord)
    assert frequency(gait, SETTINGS, 1.0, False) == pytest.approx(0.21 + 0.25 * 2.0)
    tall = LengthSettings(leg_length_m=1.08)
    assert frequency(gait, tall, 1.0, False) == pytest.approx(1.2 * 0.71)
    assert weinberg(gait, SETTINGS, 1.0, False) == pytest.approx(0.38 * gait.range_m_s2**0.25)
    assert blend(gait, SETTINGS, 1.0, False) == pytest.approx(chord**0.8 * 0.71**0.2)
    assert projected(0.8, math.radians(60.0)) == pytest.approx(0.4)


@pytest.mark.parametrize(("speed_m_s", "frequency_hz"), [(2.8, 2.86), (5.0, 3.3)])
def test_a_run_goes_by_its_frequency(speed_m_s: float, frequency_hz: float) -> None:
    """An average runner makes 2.3 Hz and 0.2 Hz more for each m/s (after Cavanagh and Kram 1989)."""
    run = gait_with(frequency_hz, 0.12)
    assert blend(run, SETTINGS, 1.0, True) == pytest.approx(speed_m_s / frequency_hz, rel=0.05)


def test_classes_have_lengths_of_their_own() -> None:
    gait, lengths = gait_with(), StepLengths("frequency", LengthSettings(leg_length_m=1.08))
    assert lengths.length(gait, 0.0, motion="stairs") == 0.28
    assert lengths.length(gait, 0.0, motion="crawling") == pytest.approx(1.2 * 0.21)
    assert lengths.length(gait, 0.0, direction="left") == pytest.approx(1.2 * 0.20)
    level = lengths.length(gait, 0.0)
    assert lengths.length(gait, 0.0, direction="backward") == level
    assert lengths.length(gait, 0.0, motion="running") < level  # 2 Hz is slow for a run


def test_turns_shorten_steps_and_bounds_hold() -> None:
    settings = LengthSettings(turn_shortening_s=0.5)
    gait = gait_with()
    straight = StepLengths("frequency", settings).length(gait, 0.0)
    assert straight == pytest.approx(0.71)
    assert StepLengths("frequency", settings).length(gait, -1.0) == pytest.approx(0.5 * straight)
    assert StepLengths("frequency", settings).length(gait, 50.0) == pytest.approx(0.2 * straight)
    assert StepLengths("frequency", LengthSettings(leg_length_m=100.0)).length(gait, 0.0) == LONGEST_M
    assert StepLengths("frequency", LengthSettings(leg_length_m=1e-6)).length(gait, 0.0) == SHORTEST_M


def test_the_placement_is_told_by_surge_and_strikes() -> None:
    placement = Placement(SETTINGS)
    first = placement.pendulum_factor
    smooth, struck = gait_with(), gait_with()
    object.__setattr__(smooth, "surge_share", 0.3)
    object.__setattr__(struck, "surge_share", 0.75)
    object.__setattr__(struck, "range_m_s2", 1.8 * struck.range_m_s2)
    for _ in range(60):
        placement.learn(struck)
    assert first == pytest.approx(SETTINGS.hand_factor)
    assert placement.pendulum_factor == pytest.approx(SETTINGS.trunk_factor, rel=0.03)
    for _ in range(600):
        placement.learn(smooth)
    assert placement.pendulum_factor == pytest.approx(SETTINGS.hand_factor)
    assert Placement(LengthSettings(placement="trunk")).pendulum_factor == SETTINGS.trunk_factor


def test_the_network_computes_what_its_weights_say() -> None:
    hidden = np.array([[0.5, -0.2, 0.1, 0.3]])
    tiny = Network(hidden, np.array([0.4, -0.1]))
    frequency_hz, variance = 1.9 * math.exp(0.15), 8.0 * math.exp(-0.8)  # one spread above, one below
    out = 0.4 * math.tanh(0.5 + 0.2 + 0.1 * 0.5 + 0.3) - 0.1
    bounded = math.log(2.0) * math.tanh(out / math.log(2.0))
    assert tiny.length_m(frequency_hz, variance, 0.05) == pytest.approx(0.68 * math.exp(bounded))


def test_the_network_never_runs_away() -> None:
    wild = [NETWORK.length_m(f, v, i) for f in (0.1, 2.0, 50.0) for v in (0.0, 1e6) for i in (-1.5, 1.5)]
    assert all(0.34 < length < 1.36 for length in wild)
    huge = inputs_of(np.array([1e9]), np.array([1e9]), np.array([1e9]))
    assert np.abs(huge).max() == 2.5
    assert network(gait_with(1.9, 0.06), SETTINGS, 1.0, False) == pytest.approx(0.66, abs=0.06)
    fast, slow = gait_with(2.2, 0.06), gait_with(1.5, 0.03)
    assert network(fast, SETTINGS, 1.0, False) > network(slow, SETTINGS, 1.0, False) + 0.05


def test_small_bumps_between_steps_are_none_even_at_the_start() -> None:
    """Steps half a second apart, each with a knock 0.24 s later: nobody walks four steps a second."""
    time_s = np.arange(0.0, 20.0, CELL_S)
    since = np.mod(time_s, 0.5)
    vertical = sum(6.0 * np.exp(-0.5 * ((since - at) / 0.035) ** 2) for at in (0.1, 0.34))
    assert abs(len(steps_in(np.asarray(vertical))) - 40) <= 1


def test_a_runner_whose_feet_strike_unlike_is_counted_by_steps() -> None:
    """After a slow walk: 2.9 steps a second, every second one a third softer."""
    slow = sine(1.4, 2.0, 6.0)
    time_s = np.arange(0.0, 12.0, CELL_S)
    run = (12.0 + 2.4 * np.sign(np.sin(np.pi * 2.9 * time_s))) * np.sin(2.0 * np.pi * 2.9 * time_s)
    steps = steps_in(np.concatenate([slow, run]))
    assert abs(len(steps) - (6.0 * 1.4 + 12.0 * 2.9)) <= 3.0


def test_a_ride_is_told_from_a_walk_by_its_rhythm() -> None:
    """Bounces as often as steps, whose intervals and heights are anything; then a walk, which is believed."""
    rng = np.random.default_rng(5)
    ride = np.concatenate(
        [sine(1.0 / wait, rng.uniform(1.5, 6.0), wait) for wait in rng.uniform(0.35, 1.4, 300)]
    )
    assert len(steps_in(ride)) < 0.5 * 300
    walk = sine(1.8, 4.0, 60.0)
    found = [end for _, end in steps_in(np.concatenate([ride, walk])) if end > len(ride) * CELL_NS]
    assert abs(len(found) - 108) <= 3


def test_strides_are_even_though_left_and_right_differ() -> None:
    assert unevenness([0.34, 0.66] * 6) == pytest.approx(0.0)
    assert unevenness([0.5, 0.5, 0.6, 0.6]) == pytest.approx(0.1 / 0.55)
    assert unevenness([0.5]) == 0.0


def test_a_unit_is_surely_on_the_trunk_after_many_hard_steps_only() -> None:
    told, auto = Placement(LengthSettings(placement="trunk")), Placement(SETTINGS)
    hard = Gait(0.5, 0.04, 2.0 * 1.8 * 0.02 * (4.0 * math.pi) ** 2, 4.0, (1.0, 0.0), 0.75)
    soft = Gait(0.5, 0.04, 2.0 * 1.1 * 0.02 * (4.0 * math.pi) ** 2, 4.0, (1.0, 0.0), 0.25)
    assert told.on_trunk
    for _ in range(10):
        auto.learn(hard)
    assert not auto.on_trunk
    for _ in range(90):
        auto.learn(hard)
    assert auto.on_trunk
    for _ in range(200):
        auto.learn(soft)
    assert not auto.on_trunk
