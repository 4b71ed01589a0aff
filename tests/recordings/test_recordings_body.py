"""Body-worn recordings: phones with way-points, a chest unit, the phone app's export; and their damage."""

from pathlib import Path

import numpy as np
import pytest

from bootprint.errors import RecordingError
from sensor_gateway.recordings import load_runs

MALL = (
    "#\tstartTime:1000\n"
    "1000\tTYPE_WAYPOINT\t10.0\t20.0\n"
    "1100\tTYPE_ACCELEROMETER\t1.0\t2.0\t9.0\t3\n"
    "1110\tTYPE_GYROSCOPE\t0.1\t0.2\t0.3\t3\n"
    "1100\tTYPE_MAGNETIC_FIELD\t10.0\t20.0\t-40.0\t3\n"
    "1120\tTYPE_ACCELEROMETER\t1.0\t2.0\t9.0\t3\n"
    "1120\tTYPE_ROTATION_VECTOR\t0\t0\t0\t3\n"
    "1130\tTYPE_GYROSCOPE\t0.3\t0.4\t0.5\t3\n"
    "1140\tTYPE_MAGNETIC_FIELD\t20.0\t20.0\t-40.0\t3\n"
    "3000\tTYPE_WAYPOINT\t11.0\t22.0\n"
)


def test_a_phone_in_a_mall(tmp_path: Path) -> None:
    (tmp_path / "walk.txt").write_text(MALL)
    (tmp_path / "floor.json").write_text('{"map_info": {"height": 1.0}}')
    (run,) = load_runs([tmp_path])
    imu, truth = run.imus["body"], run.truth["body"]
    assert (run.name, run.kind) == ("walk", "body")
    np.testing.assert_allclose(imu.time_s, [0.0, 0.02], atol=1e-9)
    np.testing.assert_allclose(imu.accel_m_s2[0], [2.0, -1.0, 9.0])  # top ahead: y, −x, z
    np.testing.assert_allclose(imu.gyro_rad_s[1], [0.3, -0.2, 0.4], atol=1e-6)  # halfway between two samples
    assert imu.mag_ut is not None
    np.testing.assert_allclose(imu.mag_ut[1], [20.0, -15.0, -40.0], atol=1e-4)
    np.testing.assert_allclose(truth.time_s, [-0.1, 1.9], atol=1e-9)
    np.testing.assert_allclose(truth.position_m[:, :2], [[10.0, 20.0], [11.0, 22.0]])
    assert not truth.has_height


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (("1.0\t2.0\t9.0\t3\n", "1.0\t2.0\n"), "line 3: TYPE_ACCELEROMETER has 2 values, want 3"),
        (("0.3\t0.4", "0.3\tfour"), "line 8: could not convert"),
        (("3000\t", "900\t"), "way-points must rise"),
        (("TYPE_GYROSCOPE", "TYPE_OTHER"), "fewer than 2 lines TYPE_GYROSCOPE"),
    ],
)
def test_a_damaged_phone_recording_is_told(tmp_path: Path, damage: tuple[str, str], complaint: str) -> None:
    path = tmp_path / "walk.txt"
    path.write_text(MALL.replace(*damage))
    with pytest.raises(RecordingError, match=complaint):
        load_runs([path])


def test_a_chest_unit_in_both_layouts(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(
        "time,gx,gz,gy,ax,az,ay,mx,my,mz,p\n1000,0.1,0.3,0.2,0,1,0,1,0,0,1000\n1100,0.1,0.3,0.2,0,1,0,1,0,0,1001\n"
    )
    names = ",".join(f"{sensor}_{axis}" for sensor in ("Acc", "Gyr", "Mag") for axis in "XYZ")
    (tmp_path / "b.txt").write_text(
        f"PacketCounter,SampleTimeFine,{names}\n1,50,9.8,0,0,0,0,0,0,1,0\n2,150,9.8,0,0,0,0,0,0,1,0\n"
    )
    a, b = load_runs([tmp_path])
    np.testing.assert_allclose(a.imus["body"].accel_m_s2[0], [0.0, 0.0, 9.80665])
    np.testing.assert_allclose(a.imus["body"].gyro_rad_s[0], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(a.imus["body"].time_s, [0.0, 0.01])
    assert a.pressure is not None
    np.testing.assert_allclose(a.pressure.pressure_pa, [100000.0, 100100.0])
    assert b.pressure is None
    assert b.imus["body"].mag_ut is not None
    np.testing.assert_allclose(b.imus["body"].mag_ut[0], [0.0, 50.0, 0.0])


def test_a_phone_apps_folder(tmp_path: Path) -> None:
    folder = tmp_path / "outing"
    folder.mkdir()
    axes = {"Accelerometer": "m/s^2", "Gyroscope": "rad/s"}
    for name, unit in axes.items():
        heading = ",".join(f'"{axis} ({unit})"' for axis in "XYZ")
        (folder / f"{name}.csv").write_text(f'"Time (s)",{heading}\n1.0,1,2,9\n1.5,1,2,9\n')
    columns = ("Time (s)", "Latitude (°)", "Longitude (°)", "Height (m)", "Velocity (m/s)", "Direction (°)")
    (folder / "Location.csv").write_text(
        ",".join(f'"{name}"' for name in (*columns, "Horizontal Accuracy (m)", "Vertical Accuracy (°)"))
        + "\n1.25,43.5,1.4,150,-1,90,35,35\n"
    )
    (run,) = load_runs([tmp_path])
    assert (run.name, run.kind) == ("outing", "body")
    np.testing.assert_allclose(run.imus["body"].accel_m_s2[0], [2.0, -1.0, 9.0])
    assert run.imus["body"].mag_ut is None
    assert run.gnss is not None
    assert run.gnss.time_s[0] == pytest.approx(0.25)
    assert np.isnan(run.gnss.speed_m_s[0])
    assert (run.gnss.course_deg[0], run.gnss.h_acc_m[0]) == (90.0, 35.0)
    assert np.isnan(run.gnss.alt_m[0])
