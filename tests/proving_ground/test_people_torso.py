"""The torso of a simulated person: above the feet, in step with them, and telling how the person moves."""

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

from support.people_walks import GRAVITY, acceleration, walked, yaw_of

STEP_S = 0.005


def steady(motion) -> np.ndarray:
    """Times of even walking."""
    return np.arange(5.0, motion.duration_s - 5.0, STEP_S)


def felt(motion, time_s: np.ndarray) -> np.ndarray:
    """Specific force at the belt in its axes, (n, 3), below 5 Hz."""
    force = motion.torso.at(time_s)[1].inv().apply(acceleration(motion.torso, time_s) + GRAVITY)
    b, a = butter(2, 5.0, fs=1.0 / STEP_S)
    return filtfilt(b, a, force, axis=0)


def strongest_hz(values: np.ndarray) -> float:
    """Where the spectrum is highest."""
    spectrum = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values))))
    return float(np.fft.rfftfreq(len(values), STEP_S)[np.argmax(spectrum)])


def step_hz(motion) -> float:
    """Footfalls a second."""
    begins = np.sort(np.concatenate([f.begin_s[2:-2] for f in motion.footfalls.values()]))
    return float(1.0 / np.mean(np.diff(begins)))


@pytest.mark.parametrize("gait", ["walk", "run", "backward"])
def test_it_bounces_once_a_step_and_sways_and_twists_once_a_stride(gait: str) -> None:
    motion = walked(gait, [[0, 0, 0], [60, 0, 0]])
    time_s = steady(motion)
    place, attitude = motion.torso.at(time_s)
    assert strongest_hz(place[:, 2]) == pytest.approx(step_hz(motion), rel=0.05)
    assert strongest_hz(place[:, 1]) == pytest.approx(0.5 * step_hz(motion), rel=0.1)
    assert strongest_hz(yaw_of(attitude)) == pytest.approx(0.5 * step_hz(motion), rel=0.1)
    assert 0.02 < np.ptp(place[:, 2]) < 0.14


@pytest.mark.parametrize("gait", ["walk", "run", "side_step_left", "backward"])
def test_it_stays_above_the_feet(gait: str) -> None:
    motion = walked(gait)
    time_s = np.arange(0.0, motion.duration_s, 0.02)
    middle = 0.5 * (motion.left_foot.at(time_s)[0] + motion.right_foot.at(time_s)[0])
    apart = np.linalg.norm((motion.torso.at(time_s)[0] - middle)[:, :2], axis=1)
    # A runner's body flies on while the feet hang back by a part of a stride.
    assert apart.max() < (0.45 if gait == "run" else 0.25)


def test_the_order_of_the_peaks_tells_forward_from_backward() -> None:
    shares = {}
    for gait in ("walk", "backward"):
        motion = walked(gait, [[0, 0, 0], [40, 0, 0]])
        time_s = steady(motion)
        force = felt(motion, time_s)
        period = 1.0 / step_hz(motion)
        vertical, ahead = (
            np.angle(np.sum((force[:, axis] - force[:, axis].mean()) * np.exp(-2j * np.pi * time_s / period)))
            for axis in (2, 0)
        )
        shares[gait] = np.mod(ahead - vertical, 2.0 * np.pi) / (2.0 * np.pi)
    # Of a step, by which the forward peak comes before the vertical one: between 0 and ½ walking forward.
    assert 0.1 < shares["walk"] < 0.45
    assert 0.55 < shares["backward"] < 0.9


def test_side_steps_push_sideways_and_turn_the_body_towards_them() -> None:
    turns = {}
    for gait, yaw in (("side_step_left", -0.5 * np.pi), ("side_step_right", 0.5 * np.pi)):
        motion = walked(gait, [[0, 0, 0], [12, 0, 0]])
        time_s = steady(motion)
        force = felt(motion, time_s)
        ahead, aside = np.std(force[:, 0]), np.std(force[:, 1])
        assert aside > 1.5 * ahead
        turns[gait] = np.mean(yaw_of(motion.torso.at(time_s)[1])) - yaw
    assert 0.05 < turns["side_step_left"] < 0.35
    assert -0.35 < turns["side_step_right"] < -0.05


def test_the_torso_is_lowest_amid_a_runners_stance_and_highest_amid_a_walkers() -> None:
    for gait, sign in (("walk", 1.0), ("run", -1.0)):
        motion = walked(gait, [[0, 0, 0], [40, 0, 0]])
        stances = np.concatenate([foot.strides.end_s[3:-3] for foot in (motion.left_foot, motion.right_foot)])
        height = motion.torso.at(stances)[0][:, 2]
        mean = motion.torso.at(steady(motion))[0][:, 2].mean()
        assert sign * (np.median(height) - mean) > 0.008
