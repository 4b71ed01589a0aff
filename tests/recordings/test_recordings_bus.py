"""A recording of the bus becomes a run for each soldier."""

from pathlib import Path

import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.errors import RecordingError
from bootprint.messages import GnssFix, ImuBatch, Message, Pressure
from bootprint.recording import Recorder
from bootprint.topics import Identity
from sensor_gateway.recordings import load_runs

ZERO_NS = 1_700_000_000_000_000_000
STEP_NS = 5_000_000


def imu_batch(number: int, mag: bool = False) -> ImuBatch:
    times = ZERO_NS + STEP_NS * np.arange(10 * number, 10 * number + 10)
    values = np.tile([1.0, 2.0, 3.0], (10, 1)) + number
    return ImuBatch.from_arrays(number, times, values, -values, 10.0 * values if mag else None)


def record(path: Path, *messages: tuple[str, str, str, Message]) -> Path:
    with Recorder(path) as recorder:
        for soldier, subject, source, message in messages:
            recorder.write(Envelope(Identity("bp", "alpha", soldier).address(subject, source), message))
    return path


def test_one_soldier_with_everything(tmp_path: Path) -> None:
    fix = GnssFix(
        time_ns=ZERO_NS + 1_000_000_000,
        fix_kind="3d",
        latitude_deg=59.0,
        longitude_deg=17.0,
        horizontal_accuracy_m=4.0,
        course_rad=np.pi / 2,
    )
    path = record(
        tmp_path / "patrol.mcap",
        ("a1", "imu", "left_foot", imu_batch(1)),
        ("a1", "imu", "left_foot", imu_batch(0)),
        ("a1", "imu", "right_foot", imu_batch(0, mag=True)),
        ("a1", "pressure", "body", Pressure(time_ns=ZERO_NS + 500_000_000, pressure_pa=101325.0)),
        ("a1", "gnss", "body", fix),
    )
    (run,) = load_runs([path])
    assert (run.name, run.kind) == ("patrol", "dual")
    left = run.imus["left_foot"]
    np.testing.assert_allclose(left.time_s, 0.005 * np.arange(20), atol=1e-12)
    np.testing.assert_allclose(left.accel_m_s2[[0, 19], 0], [1.0, 2.0])
    np.testing.assert_allclose(left.gyro_rad_s[19], [-2.0, -3.0, -4.0])
    assert left.mag_ut is None
    assert run.imus["right_foot"].mag_ut is not None
    assert run.pressure is not None
    np.testing.assert_allclose(run.pressure.time_s, [0.5])
    assert run.gnss is not None
    assert (run.gnss.time_s[0], run.gnss.lat_deg[0], run.gnss.course_deg[0]) == pytest.approx(
        (1.0, 59.0, 90.0)
    )
    assert np.isnan([run.gnss.alt_m[0], run.gnss.satellites[0]]).all()


def test_several_soldiers_are_several_runs(tmp_path: Path) -> None:
    path = record(
        tmp_path / "squad.mcap",
        ("b2", "imu", "right_foot", imu_batch(0)),
        ("a1", "imu", "right_foot", imu_batch(0)),
        ("c3", "pressure", "body", Pressure(time_ns=ZERO_NS, pressure_pa=101325.0)),
    )
    assert [(run.name, run.kind) for run in load_runs([path])] == [("squad-a1", "foot"), ("squad-b2", "foot")]


def test_recordings_without_samples_and_damaged_ones_are_errors(tmp_path: Path) -> None:
    path = record(
        tmp_path / "empty.mcap", ("a1", "pressure", "body", Pressure(time_ns=ZERO_NS, pressure_pa=1e5))
    )
    with pytest.raises(RecordingError, match="no inertial samples"):
        load_runs([path])
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(path.read_bytes()[:8] + bytes(100))
    with pytest.raises(RecordingError, match=r"broken\.mcap"):
        load_runs([broken])
