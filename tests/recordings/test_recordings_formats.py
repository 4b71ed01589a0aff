"""Every format from a few hand-made rows: units, axes, companions, damage. Needs no recorded data."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from structlog.testing import capture_logs

from bootprint.errors import ConfigError, RecordingError
from sensor_gateway.recordings import load_runs

G0 = 9.80665
IMU_HEADER = "time_s,ax,ay,az,gx,gy,gz"


def imu_csv(samples: int = 5, rate_hz: float = 100.0) -> str:
    rows = [f"{k / rate_hz},0.1,0.2,9.8,0.01,0.02,0.03" for k in range(samples)]
    return "\n".join([IMU_HEADER, *rows]) + "\n"


def imu_matrix(samples: int) -> np.ndarray:
    return np.tile([0.0, 0.0, -9.81, 0.1, 0.2, 0.3], (samples, 1)) + np.arange(samples)[:, None] * 1e-3


def write_pyshoe(path: Path, samples: int = 6) -> None:
    gt = np.column_stack([np.arange(samples), 2.0 * np.arange(samples), np.ones(samples)])
    savemat(path, {"imu": imu_matrix(samples), "ts": np.arange(samples)[None] / 200.0, "gt": gt})


def write_foot_gcp(path: Path, samples: int = 8) -> None:
    savemat(
        path,
        {
            "imu_data": imu_matrix(samples),
            "timestamps": np.arange(samples)[None] / 200.0,
            "strideIndex": np.array([[1, 4, 7]]),
            "GCP_wcf": np.array([[0.0, 0.0], [1.0, 0.5], [2.0, 0.0]]),
        },
    )


def write_logger_csv(path: Path, samples: int = 8, shift_rad_s: float = 0.0) -> None:
    names = [f"scaled{kind}{axis}" for kind in ("Accel", "Gyro", "Mag") for axis in "XYZ"]
    imu = imu_matrix(samples)
    lines = [",".join(["Time", *(f"inertial-1.2:{name}" for name in names)])]
    for k in range(samples):
        values = [k / 200.0, *(imu[k, :3] / G0), *(imu[k, 3:] + shift_rad_s), 0.2, 0.0, -0.4]
        lines.append(",".join(repr(float(value)) for value in values))
    path.write_text("\n".join(lines) + "\n")


def test_pyshoe_truth_becomes_right_handed(tmp_path: Path) -> None:
    write_pyshoe(tmp_path / "trial.mat")
    (run,) = load_runs([tmp_path / "trial.mat"])
    assert (run.name, run.kind, list(run.imus)) == ("trial", "foot", ["right_foot"])
    np.testing.assert_allclose(run.truth["right_foot"].position_m[2], [2.0, -4.0, 1.0])
    np.testing.assert_allclose(run.imus["right_foot"].gyro_rad_s[0], [0.1, 0.2, 0.3])


def test_pyshoe_is_known_by_its_shape_and_not_by_its_name(tmp_path: Path) -> None:
    write_pyshoe(tmp_path / "whatever.bin.mat")
    (tmp_path / "whatever.bin.mat").rename(tmp_path / "whatever.bin")
    assert load_runs([tmp_path / "whatever.bin"])[0].name == "whatever"


def test_foot_gcp_survey_stands_at_the_end_of_each_stance(tmp_path: Path) -> None:
    write_foot_gcp(tmp_path / "walk_LLIO.mat")
    (run,) = load_runs([tmp_path])
    truth = run.truth["right_foot"]
    np.testing.assert_allclose(truth.time_s, [0.005, 0.02, 0.035])
    np.testing.assert_allclose(truth.position_m, [[0, 0, 0], [1, 0.5, 0], [2, 0, 0]])
    assert truth.strides == 2
    assert run.imus["right_foot"].mag_ut is None


def test_foot_gcp_companions_add_the_magnetometer_and_no_rows(tmp_path: Path) -> None:
    write_foot_gcp(tmp_path / "walk_LLIO.mat")
    write_logger_csv(tmp_path / "walk.csv")
    savemat(tmp_path / "walk.mat", {"GCP_meters": np.zeros((3, 2)), "GCP_stride_numbers": np.arange(3)})
    with capture_logs() as logs:
        (run,) = load_runs([tmp_path])
    assert logs == []
    mag = run.imus["right_foot"].mag_ut
    assert mag is not None
    np.testing.assert_allclose(mag[0], [20.0, 0.0, -40.0])


def test_foot_gcp_companion_of_other_samples_adds_nothing(tmp_path: Path) -> None:
    write_foot_gcp(tmp_path / "walk_LLIO.mat")
    write_logger_csv(tmp_path / "walk.csv", shift_rad_s=0.001)
    (run,) = load_runs([tmp_path])
    assert run.imus["right_foot"].mag_ut is None


def test_logger_csv_alone_is_a_run_without_truth(tmp_path: Path) -> None:
    write_logger_csv(tmp_path / "lonely.csv")
    (run,) = load_runs([tmp_path])
    assert run.truth == {}
    np.testing.assert_allclose(run.imus["right_foot"].accel_m_s2[0], [0.0, 0.0, -9.81])


def test_xio_units_repeats_and_closed_loop(tmp_path: Path) -> None:
    axes = [
        f"{kind} {axis} ({unit})"
        for kind, unit in (("Gyroscope", "deg/s"), ("Accelerometer", "g"))
        for axis in "XYZ"
    ]
    row = "180.0,-90.0,0.0,0.0,0.0,1.0"
    (tmp_path / "loop.csv").write_text(
        "\n".join(
            [",".join(["Time (s)", *axes]), f"0,{row}", f"0.0025,{row}", f"0.0025,{row}", f"0.005,{row}"]
        )
    )
    with capture_logs() as logs:
        (run,) = load_runs([tmp_path / "loop.csv"])
    assert logs == []  # a row written twice is this format's habit, not a fault
    imu, truth = run.imus["right_foot"], run.truth["right_foot"]
    np.testing.assert_allclose(imu.time_s, [0.0, 0.0025, 0.005])
    np.testing.assert_allclose(imu.gyro_rad_s[0], [np.pi, -np.pi / 2, 0.0])
    np.testing.assert_allclose(imu.accel_m_s2[0], [0.0, 0.0, G0])
    np.testing.assert_allclose(truth.time_s, [0.0, 0.005])
    np.testing.assert_allclose(truth.position_m, 0.0)


def write_gaitmap(folder: Path) -> None:
    cells = [
        (f"{side}_sensor", f"{kind}_{axis}")
        for kind in ("acc", "gyr")
        for axis in "xyz"
        for side in ("left", "right")
    ]
    values = [90.0 if axis.startswith("gyr") else 1.0 + side.startswith("right") for side, axis in cells]
    rows = [",".join(map(str, [k, *values])) for k in range(5)]
    header = [
        ",".join(["sensor", *(side for side, _ in cells)]),
        ",".join(["axis", *(axis for _, axis in cells)]),
    ]
    (folder / "imu_sample.csv").write_text("\n".join([*header, *rows]))
    (folder / "imu_stairs.csv").write_text("\n".join([*header, *rows]))
    heels = [",L_FCC,L_FCC,L_FCC,R_FCC,R_FCC,R_FCC", ",x,y,z,x,y,z"]
    (folder / "mocap_sample.csv").write_text(
        "\n".join([*heels, *(f"{k},1000,2000,30,-1000,0,40" for k in range(3))])
    )


def test_gaitmap_folder_is_one_run_of_both_feet(tmp_path: Path) -> None:
    folder = tmp_path / "walks"
    folder.mkdir()
    write_gaitmap(folder)
    (run,) = load_runs([tmp_path])
    assert (run.name, run.kind, set(run.imus)) == ("walks", "dual", {"left_foot", "right_foot"})
    np.testing.assert_allclose(run.imus["right_foot"].accel_m_s2[0], 2.0)
    np.testing.assert_allclose(run.imus["left_foot"].gyro_rad_s[0], np.pi / 2)
    np.testing.assert_allclose(run.imus["left_foot"].time_s[1], 1 / 204.8)
    np.testing.assert_allclose(run.truth["left_foot"].position_m[0], [1.0, 2.0, 0.03])
    assert run.truth["left_foot"].at_stances
    np.testing.assert_allclose(run.truth["right_foot"].time_s, [0.0, 0.01, 0.02])


def test_gaitmap_walk_without_motion_capture_is_a_run_without_truth(tmp_path: Path) -> None:
    write_gaitmap(tmp_path)
    (run,) = load_runs([tmp_path / "imu_stairs.csv"])
    assert (run.name, run.truth) == ("imu_stairs", {})


def test_dualfoot_folder_is_one_run_with_z_up(tmp_path: Path) -> None:
    imu = "time_index,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,is_zero_vel\n"
    for side, accel in (("Left", 1.0), ("Right", 2.0)):
        (tmp_path / f"imuMeas{side}.csv").write_text(
            imu + "".join(f"{k},{accel},0,9,0,0,0.5,1\n" for k in range(4))
        )
    names = ",".join(f"pos_{side}_{axis}" for side in ("left", "right") for axis in "xyz")
    (tmp_path / "positionGt.csv").write_text(
        f"time_index,{names}\n" + "".join(f"{k},1,2,3,4,5,6\n" for k in range(4))
    )
    (run,) = load_runs([tmp_path])
    assert run.kind == "dual"
    np.testing.assert_allclose(run.imus["left_foot"].accel_m_s2[0], [1.0, 0.0, 9.0])
    np.testing.assert_allclose(run.imus["left_foot"].time_s[-1], 3 / 60)
    np.testing.assert_allclose(run.truth["right_foot"].position_m[0], [4.0, -5.0, -6.0])
    np.testing.assert_allclose(run.truth_of("body").position_m[0], [2.5, -3.5, -4.5])  # type: ignore[union-attr]


def write_run_folder(folder: Path, notes: str = "") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "left_foot.csv").write_text(imu_csv())
    (folder / "right_foot.csv").write_text(imu_csv())
    (folder / "gnss.csv").write_text(
        "time_s,lat_deg,lon_deg,alt_m,h_acc_m\n0,59.1,17.9,,3.5\n1,59.2,17.9,40,\n"
    )
    (folder / "pressure.csv").write_text("time_s,pressure_pa\n0,101325\n")
    (folder / "truth.csv").write_text("time_s,east_m,north_m\n0,0,0\n0.04,3,4\n")
    if notes:
        (folder / "run.toml").write_text(notes)
    return folder


def test_run_folder_is_read_whole(tmp_path: Path) -> None:
    notes = 'kind = "dual"\nsensors = ["left_foot", "right_foot", "gnss"]\n'
    notes += 'origin = [59.0, 17.0, 30]\nlicence = "CC0"\n'
    (run,) = load_runs([write_run_folder(tmp_path / "mine", notes)])
    assert (run.name, run.kind, run.origin, run.source) == ("mine", "dual", (59.0, 17.0, 30.0), "CC0")
    assert run.pressure is None  # not among the sensors named
    assert run.gnss is not None
    assert np.isnan(run.gnss.alt_m[0])
    assert np.isnan(run.gnss.course_deg).all()
    np.testing.assert_allclose(run.gnss.h_acc_m[0], 3.5)
    truth = run.truth_of("left_foot")
    assert truth is not None
    assert not truth.has_height


def test_run_folder_without_notes_uses_everything(tmp_path: Path) -> None:
    (run,) = load_runs([write_run_folder(tmp_path / "mine")])
    assert run.kind == "dual"
    assert run.pressure is not None
    (tmp_path / "mine" / "left_foot.csv").unlink()
    (run,) = load_runs([tmp_path / "mine"])
    assert run.kind == "foot"


@pytest.mark.parametrize(
    ("notes", "complaint"),
    [
        ('colour = "red"', "colour"),
        ('kind = "hat"', "hat"),
        ('sensors = ["left_hand"]', "left_hand"),
        ('sensors = ["body"]', "body.csv"),
        ("kind = ", "TOML"),
    ],
)
def test_run_folder_notes_are_strict(tmp_path: Path, notes: str, complaint: str) -> None:
    folder = write_run_folder(tmp_path / "mine", notes)
    with pytest.raises((ConfigError, RecordingError), match=complaint) as caught:
        load_runs([folder])
    assert "run.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("file", "content", "complaint"),
    [
        ("left_foot.csv", "time_s,ax,ay,az,gx,gy\n0,1,2,3,4,5\n", "column gz is missing"),
        ("left_foot.csv", f"{IMU_HEADER},smell\n0,1,2,3,4,5,6,7\n", "unknown column 'smell'"),
        ("left_foot.csv", f"{IMU_HEADER}\n0,1,2,3,4,5,six\n", "line 2"),
        ("left_foot.csv", f"{IMU_HEADER}\n0,1,2,3,4,5,6\n1,2\n", "line 3 has 2 cells"),
        ("left_foot.csv", f"{IMU_HEADER}\n", "no data"),
        ("truth.csv", "time_s,east_m,north_m\n1,0,0\n0,1,1\n", "must rise"),
        ("pressure.csv", "time_s,pressure_pa\n0,1013\n1,1012\n", "must be Pa, not hPa"),
    ],
)
def test_damaged_tables_are_told_in_one_line(tmp_path: Path, file: str, content: str, complaint: str) -> None:
    folder = write_run_folder(tmp_path / "mine")
    (folder / file).write_text(content)
    with pytest.raises(RecordingError, match=complaint) as caught:
        load_runs([folder])
    assert str(folder / file) in str(caught.value)


def test_unusable_samples_are_dropped_and_told(tmp_path: Path) -> None:
    folder = write_run_folder(tmp_path / "mine")
    rows = [
        "0,0,0,9.8,0,0,0",
        "0.01,nan,0,9.8,0,0,0",
        "0.02,0,0,9.8,0,0,0",
        "0.01,0,0,9.8,0,0,0",
        "0.03,0,0,9.8,0,0,0",
    ]
    (folder / "left_foot.csv").write_text("\n".join([IMU_HEADER, *rows]))
    with capture_logs() as logs:
        (run,) = load_runs([folder])
    np.testing.assert_allclose(run.imus["left_foot"].time_s, [0.0, 0.02, 0.03])
    assert [(log["event"], log["samples"], log["of"]) for log in logs] == [
        ("recording.samples_dropped", 2, 5)
    ]


def test_folders_are_searched_and_unknown_files_skipped_with_a_warning(tmp_path: Path) -> None:
    write_run_folder(tmp_path / "b" / "run1")
    write_pyshoe(tmp_path / "trial.mat")
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "noise.bin").write_bytes(bytes(range(256)))
    with capture_logs() as logs:
        runs = load_runs([tmp_path])
    assert [run.name for run in runs] == ["trial", "run1"]
    assert [(log["event"], log["files"]) for log in logs] == [
        ("recording.unknown_skipped", "noise.bin, notes.txt")
    ]


def test_kind_chooses_among_runs(tmp_path: Path) -> None:
    write_run_folder(tmp_path / "two_feet")
    write_pyshoe(tmp_path / "one_foot.mat")
    assert [run.name for run in load_runs([tmp_path], "dual")] == ["two_feet"]
    assert [run.name for run in load_runs([tmp_path], "foot")] == ["one_foot", "two_feet"]
    with pytest.raises(RecordingError, match="no run of kind body"):
        load_runs([tmp_path], "body")


def test_missing_unknown_and_damaged_paths(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no such file"):
        load_runs([tmp_path / "nowhere"])
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(RecordingError, match="no recording"):
        load_runs([tmp_path / "notes.txt"])
    write_pyshoe(tmp_path / "trial.mat")
    whole = (tmp_path / "trial.mat").read_bytes()
    for size in (128, 130, 200, len(whole) // 2, len(whole) - 20):
        (tmp_path / "trial.mat").write_bytes(whole[:size])
        with pytest.raises(RecordingError, match=r"trial\.mat"):
            load_runs([tmp_path])
