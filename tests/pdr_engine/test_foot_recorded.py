"""Recorded walks with surveyed or motion-captured truth: the default beats the fixed threshold and stays good.

A few runs of each kind of movement, so that the test is quick; `bootprint evaluate` tells of all.
"""

import math

import numpy as np
import pytest

from pdr_engine.foot import FootSettings
from sensor_gateway.recordings import load_runs
from support.foot_streams import START_NS, Stream, Track, navigate
from support.recorded import recorded_data

pytestmark = pytest.mark.recorded

# run, and the 2-D RMSE in metres that it may not pass (measured: 0.06, 0.06, 0.06, 0.10, 0.17, 0.34, 0.21)
RUNS = (
    ("pyshoe-vicon/2017-11-22-11-22-03.mat", 0.12),
    ("pyshoe-vicon/2018-02-09-11-29-43.mat", 0.12),
    ("pyshoe-vicon/2017-11-27-11-14-52.mat", 0.12),
    ("pyshoe-vicon/2017-11-27-11-22-22.mat", 0.17),  # running
    ("pyshoe-vicon/2018-02-09-11-19-39.mat", 0.3),  # ladder
    ("foot-gcp/SensorConnectData_31_LLIO.mat", 0.5),  # its survey is wrong by a metre at three points
    ("foot-gcp/SensorConnectData_35_LLIO.mat", 0.4),  # running
)


def scored(name: str, method: str) -> tuple[float, Track]:
    """2-D RMSE after the best rigid fit, and the track."""
    (run,) = load_runs([recorded_data() / name])
    ((place, imu),) = run.imus.items()
    time_ns = START_NS + np.round(imu.time_s * 1e9).astype(np.int64)
    track = navigate(Stream(time_ns, imu.accel_m_s2, imu.gyro_rad_s), foot=FootSettings(method=method))
    truth = run.truth[place]
    at = (track.time_ns - START_NS) * 1e-9
    own = np.column_stack([np.interp(truth.time_s, at, track.position_m[:, k]) for k in range(2)])
    return rigid_rmse(own, truth.position_m[:, :2]), track


def rigid_rmse(own: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square distance after the best turn and shift, in complex numbers."""
    a, b = own @ [1, 1j], truth @ [1, 1j]
    a, b = a - a.mean(), b - b.mean()
    turn = np.vdot(a, b)
    return float(np.sqrt(np.mean(np.abs(a * turn / abs(turn) - b) ** 2)))


@pytest.mark.parametrize(("name", "bound_m"), RUNS)
def test_recorded_movements_stay_within_their_bound(name: str, bound_m: float) -> None:
    rmse_m, track = scored(name, FootSettings().method)
    assert rmse_m < bound_m
    assert track.counters["realignments"] == 0


def test_the_default_beats_the_fixed_threshold() -> None:
    runs = [name for name, _ in RUNS]
    default, fixed = (np.mean([scored(name, method)[0] for name in runs]) for method in ("learned", "shoe"))
    assert default < 0.8 * fixed


@pytest.mark.parametrize(("number", "count"), [(31, 33), (33, 47), (35, 28), (43, 60)])
def test_strides_of_a_surveyed_walk_are_counted_exactly(number: int, count: int) -> None:
    """Walked (31, 33) and run (35, 43); a stride lies between two surveyed stances."""
    _, track = scored(f"foot-gcp/SensorConnectData_{number}_LLIO.mat", FootSettings().method)
    strides = [step for step in track.steps if math.hypot(*step.displacement_m[:2]) > 0.3]
    assert len(strides) == count
