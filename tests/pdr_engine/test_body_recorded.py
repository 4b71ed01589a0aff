"""The body-worn navigator on recorded walks: the figures that are promised, with one configuration."""

from pathlib import Path

import numpy as np
import pytest

from pdr_engine.body import BodyNavigator
from proving_ground.evaluation.body.train import Interval, length_gradients, train
from proving_ground.evaluation.evaluate import evaluate_task, plan
from sensor_gateway.recordings import load_runs
from support.recorded import recorded_data

pytestmark = pytest.mark.recorded


def figures(path: Path, method: str) -> np.ndarray:
    """(runs, 3): RMSE m, distance error %, NEES."""
    rows = [evaluate_task(task, "best-fit").row for task in plan(load_runs([path]), "body", [method])]
    names = ("rmse_m", "distance_error_pct", "nees")
    return np.array([[np.nan if row[name] is None else row[name] for name in names] for row in rows])


def test_mall_walks_are_as_good_as_promised_and_better_than_a_pedometer() -> None:
    ours = figures(recorded_data() / "msindoor20", "default")
    peer = figures(recorded_data() / "msindoor20", "weinberg-gyro")
    assert len(ours) == 14
    assert ours[:, 0].mean() < 1.75
    assert ours[:, 0].max() < 4.0
    assert np.abs(ours[:, 1]).mean() < 4.2
    assert ours[:, 0].mean() < 0.85 * peer[:, 0].mean()
    assert 0.5 < np.nanmean(ours[:, 2]) < 4.0


def test_a_chest_is_told_from_a_hand_and_which_way_it_faces() -> None:
    """Chest units: x ahead in two, and with x up in the third, z ahead, a quarter turn from its y axis."""
    expected = {"test1_sensors": 0.0, "test2_sensors": 0.0, "l_shape_u_turn": 90.0, "phone-gps": 0.0}
    folders = [recorded_data() / name for name in ("chest-xsens", "phone-gps")]
    for run in load_runs(folders):
        imu, navigator = run.imus["body"], BodyNavigator()
        steps = navigator.process(
            np.round(imu.time_s * 1e9).astype(np.int64), imu.accel_m_s2, imu.gyro_rad_s, imu.mag_ut
        )
        assert np.degrees(navigator.ahead_rad) == pytest.approx(expected[run.name], abs=12.0)
        surge = np.median([step.gait.surge_share for step in steps])
        assert (surge > 0.54) == (run.name != "phone-gps")
        assert 1.4 < np.median([step.gait.frequency_hz for step in steps]) < 2.0
        assert np.median([step.length_m for step in steps]) == pytest.approx(0.65, abs=0.12)


def test_training_goes_downhill_by_true_gradients() -> None:
    rng = np.random.default_rng(3)
    intervals = [
        Interval(rng.standard_normal((8, 3)), np.ones(8), float(rng.uniform(4.0, 7.0))) for _ in range(20)
    ]
    network = train(intervals)
    inputs = intervals[0].inputs
    gradients = length_gradients(network, inputs)
    weights = np.concatenate([network.hidden.ravel(), network.output])
    for index in range(len(weights)):
        change = 1e-6 * (np.arange(len(weights)) == index)
        up, down = (lengths(network, weights + sign * change, inputs) for sign in (1.0, -1.0))
        np.testing.assert_allclose(gradients[:, index], (up - down) / 2e-6, atol=1e-6)


def lengths(network, weights: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    size = network.hidden.size
    changed = type(network)(weights[:size].reshape(network.hidden.shape), weights[size:])
    return np.asarray(0.68 * np.exp(changed.log_length(inputs)))
