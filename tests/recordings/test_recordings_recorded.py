"""The readers on the recorded data: sizes, rates, gravity, distances, handedness. Skipped where there is none."""

import csv
from collections.abc import Iterator

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from structlog.testing import capture_logs

from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import ImuSeries, Run, Truth
from support.recorded import recorded_data

pytestmark = pytest.mark.recorded


def runs_of(*folders: str) -> list[Run]:
    return load_runs([recorded_data() / folder for folder in folders])


def feet(*folders: str) -> Iterator[tuple[Run, ImuSeries, Truth]]:
    for run in runs_of(*folders):
        for place, imu in run.imus.items():
            yield run, imu, run.truth[place]


def path_m(position_m: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(position_m[:, :2], axis=0), axis=1).sum())


@pytest.mark.parametrize(
    ("folder", "count", "kind", "rate_hz"),
    [
        ("pyshoe-vicon", 28, "foot", 200.0),
        ("foot-gcp", 8, "foot", 200.0),
        ("xio-gait", 1, "foot", 398.0),
        ("gaitmap-example", 1, "dual", 204.8),
        ("dualfoot-fgo", 1, "dual", 60.0),
    ],
)
def test_runs_and_rates(folder: str, count: int, kind: str, rate_hz: float) -> None:
    with capture_logs() as logs:
        runs = runs_of(folder)
    assert (len(runs), {run.kind for run in runs}) == (count, {kind})
    for run in runs:
        for imu in run.imus.values():
            assert 1.0 / np.median(np.diff(imu.time_s)) == pytest.approx(rate_hz, rel=0.005)
            assert (np.diff(imu.time_s) > 0.0).all()
    assert [log for log in logs if log["event"] == "recording.samples_dropped"] == []


def test_feet_at_rest_feel_gravity_and_turn_slowly() -> None:
    for run, imu, _ in feet("pyshoe-vicon", "foot-gcp", "xio-gait", "gaitmap-example", "dualfoot-fgo"):
        # The quietest quarter of a second of the first three: all stand at first, if only for a moment.
        window = round(0.25 / np.median(np.diff(imu.time_s)))
        starts = range(0, 12 * window, window)
        start = min(starts, key=lambda s: float(imu.accel_m_s2[s : s + window].std(axis=0).sum()))
        rest = slice(start, start + window)
        assert np.linalg.norm(imu.accel_m_s2[rest], axis=1).mean() == pytest.approx(9.81, abs=0.12), run.name
        assert np.linalg.norm(imu.gyro_rad_s[rest], axis=1).mean() < 0.1, run.name


def test_truth_distances_are_those_published() -> None:
    with (recorded_data() / "pyshoe-vicon" / "TRIALS.csv").open() as file:
        published = {row["file"].removesuffix(".mat"): row for row in csv.DictReader(file)}
    for run in runs_of("pyshoe-vicon"):
        row = published[run.name]
        assert len(run.imus["right_foot"].time_s) == int(row["n"])
        # Their path is summed at 20 Hz, which keeps the markers' tremble out.
        assert path_m(run.truth["right_foot"].position_m[::10]) == pytest.approx(
            float(row["path2d_m"]), abs=0.15
        )


def test_surveyed_walks_have_the_stated_lengths_and_magnetometers() -> None:
    runs = {run.name: run for run in runs_of("foot-gcp")}
    lengths = {name: path_m(run.truth["right_foot"].position_m) for name, run in runs.items()}
    assert lengths["SensorConnectData_31_LLIO"] == pytest.approx(47.855, abs=0.01)
    assert lengths["SensorConnectData_41_LLIO"] == pytest.approx(108.849, abs=0.01)
    with_mag = {name[-7:-5] for name, run in runs.items() if run.imus["right_foot"].mag_ut is not None}
    assert with_mag == {"31", "33", "35", "39"}
    for name in ("31", "33", "35", "39"):
        mag = runs[f"SensorConnectData_{name}_LLIO"].imus["right_foot"].mag_ut
        assert mag is not None
        assert 25.0 < np.median(np.linalg.norm(mag, axis=1)) < 65.0  # the earth's field is 25 to 65 µT


def test_dual_runs_have_both_feet_and_both_truths() -> None:
    (gaitmap,) = runs_of("gaitmap-example")
    for truth in gaitmap.truth.values():
        assert truth.at_stances
        assert path_m(truth.position_m) == pytest.approx(41.0, abs=1.5)
    (dual,) = runs_of("dualfoot-fgo")
    left, right = (dual.truth[place].position_m for place in ("left_foot", "right_foot"))
    apart = np.linalg.norm(left - right, axis=1)
    assert np.linalg.norm(left[0] - right[0]) == pytest.approx(0.32, abs=0.02)
    assert np.percentile(apart, 1) > 0.2
    rest = left[0, 2]
    assert left[:, 2].max() - rest > 0.07  # a swinging foot rises
    assert rest - left[:, 2].min() < 0.04


def direction_agreement(imu: ImuSeries, truth: Truth, mirrored: bool) -> float:
    """How constant the angle from the foot's gyro-integrated heading to its true direction of travel is, 0 to 1."""
    rest = slice(0, 60)
    level, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [imu.accel_m_s2[rest].mean(axis=0)])
    rate = imu.gyro_rad_s - imu.gyro_rad_s[rest].mean(axis=0)
    attitude = np.empty((len(rate), 3, 3))
    attitude[0] = level.as_matrix()
    steps = Rotation.from_rotvec(rate[1:] * np.diff(imu.time_s)[:, None]).as_matrix()
    for k, step in enumerate(steps):
        attitude[k + 1] = attitude[k] @ step
    forward = attitude @ (attitude[0].T @ np.array([1.0, 0.0, 0.0]))
    heading = np.unwrap(np.arctan2(forward[:, 1], forward[:, 0]))
    times = truth.time_s if truth.strides else np.arange(truth.time_s[0], truth.time_s[-1], 1.2)
    position = np.column_stack([np.interp(times, truth.time_s, truth.position_m[:, axis]) for axis in (0, 1)])
    moved = np.diff(position, axis=0)
    far = np.linalg.norm(moved, axis=1) > 0.3
    direction = np.arctan2(moved[far, 1], moved[far, 0])
    between = np.interp(((times[1:] + times[:-1]) / 2.0)[far], imu.time_s, heading)
    return float(abs(np.exp(1j * (direction + between if mirrored else direction - between)).mean()))


@pytest.mark.parametrize(
    ("path", "walks"),
    [
        ("pyshoe-vicon/2017-11-22-11-35-59.mat", 1),
        ("pyshoe-vicon/2017-11-27-11-24-07.mat", 1),
        ("pyshoe-vicon/2017-12-15-18-02-28.mat", 1),
        ("foot-gcp/SensorConnectData_37_LLIO.mat", 1),
        ("foot-gcp/SensorConnectData_45_LLIO.mat", 1),
        ("dualfoot-fgo", 2),
    ],
)
def test_truth_turns_the_way_the_gyro_turns(path: str, walks: int) -> None:
    """These walks turn through many directions, so a mirrored truth could not agree with the gyro."""
    found = list(feet(path))
    assert len(found) == walks
    for _, imu, truth in found:
        assert direction_agreement(imu, truth, mirrored=False) > 0.9
        assert direction_agreement(imu, truth, mirrored=True) < 0.65
