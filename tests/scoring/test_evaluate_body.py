"""`bootprint evaluate --kind body`: run folders with a body-worn unit, every method a row; the errors' chain."""

from pathlib import Path

import numpy as np
import pytest

from pdr_engine.body import BodyNavigator, BodySettings
from pdr_engine.body.methods import METHODS
from proving_ground.evaluation.body.poor_fixes import Receiver, pns_walk, with_fixes
from proving_ground.evaluation.body.recorded_run import body_chain, body_track, walk_body
from proving_ground.evaluation.evaluate import evaluate_task, methods_of, plan
from proving_ground.evaluation.floors import Floors, floors_right_pct
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import GnssSeries, ImuSeries, Truth
from support.walking_trunk import START_NS, trunk_walk

FREQUENCY_HZ, LENGTH_M = 1.8, 0.66


def quarter(time_s: np.ndarray) -> np.ndarray:
    """North for 20 s, then east."""
    return 0.5 * np.pi * np.clip((time_s - 20.0) / 2.0, 0.0, 1.0)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    stream = trunk_walk(42.0, azimuth=quarter)
    time_s = (stream.time_ns - START_NS) * 1e-9
    table = np.column_stack([time_s, stream.accel, stream.gyro, stream.mag])
    walk = tmp_path / "walk"
    walk.mkdir()
    header = "time_s,ax,ay,az,gx,gy,gz,mx,my,mz"
    np.savetxt(walk / "body.csv", table, delimiter=",", header=header, comments="", fmt="%.9f")
    speed = LENGTH_M * FREQUENCY_HZ
    way = (
        np.cumsum(np.column_stack([np.sin(quarter(time_s)), np.cos(quarter(time_s))]), axis=0) * 0.01 * speed
    )
    truth = np.column_stack([time_s, way])[::500]
    np.savetxt(walk / "truth.csv", truth, delimiter=",", header="time_s,east_m,north_m", comments="")
    return walk


def test_a_run_folder_gives_a_row_for_each_method(folder: Path) -> None:
    rows = [
        evaluate_task(task, "best-fit").row for task in plan(load_runs([folder]), None, methods_of("all"))
    ]
    assert [row["method"] for row in rows] == list(METHODS)
    assert {(row["run"], row["kind"]) for row in rows} == {("walk", "body")}
    default = rows[0]
    assert float(default["rmse_m"] or 99.0) < 1.5
    assert abs(float(default["distance_error_pct"] or 99.0)) < 12.0
    assert abs(int(default["strides"] or 0) - 75) <= 2
    assert default["inside_95_pct"] == pytest.approx(100.0)
    assert all(isinstance(row["us_per_sample"], float) for row in rows)


def test_without_a_method_each_kind_has_its_own_default(folder: Path) -> None:
    (task,) = plan(load_runs([folder]), "body", methods_of(None))
    assert (task.place, task.method) == ("body", "default")


def test_track_and_chain_lead_to_the_same_place() -> None:
    stream = trunk_walk(20.0, azimuth=lambda t: 1.0 + 0.1 * t)
    imu = ImuSeries((stream.time_ns - START_NS) * 1e-9, stream.accel, stream.gyro, stream.mag)
    time_ns = np.round(imu.time_s * 1e9).astype(np.int64)
    steps = BodyNavigator().process(time_ns, stream.accel, stream.gyro, stream.mag)
    track, chain = body_track(steps, imu), body_chain(steps)
    assert chain is not None
    way = track.position_m[-1, :2] - track.position_m[0, :2]
    yaw = 0.5 * np.pi - steps[0].azimuth_rad
    turned = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]) @ chain.position_m[-1]
    np.testing.assert_allclose(turned, way, atol=1e-9)
    assert track.time_s[-1] == pytest.approx(imu.time_s[-1])
    assert (np.diff(track.time_s) > 0.0).all()
    np.testing.assert_allclose(chain.covariance[5, 0, 0], steps[5].length_sigma_m ** 2)
    assert body_chain([]) is None


def test_floors_count_from_the_first_of_each_and_only_where_known() -> None:
    told = Floors(np.array([5.0, 10.0, 20.0]), np.array([0.0, 1.0, 2.0]))
    times = np.array([0.0, 9.0, 10.0, 15.0, 25.0])
    truth = Truth(times, np.zeros((5, 3)), floor=np.array([3.0, 4.0, 4.0, np.nan, 5.0]))
    assert floors_right_pct(told, truth) == pytest.approx(75.0)  # wrong at 9 s alone
    assert floors_right_pct(None, truth) is None
    assert floors_right_pct(told, Truth(times, np.zeros((5, 3)))) is None


def test_a_run_folder_s_barometer_and_floors_are_scored(folder: Path) -> None:
    seconds = np.arange(0.0, 42.0, 0.2)
    pressure = 101_325.0 - 12.0 * 3.0 * np.clip((seconds - 20.0) / 10.0, 0.0, 1.0)
    np.savetxt(
        folder / "pressure.csv",
        np.column_stack([seconds, pressure]),
        delimiter=",",
        header="time_s,pressure_pa",
        comments="",
    )
    way = np.genfromtxt(folder / "truth.csv", delimiter=",", skip_header=1)
    floor = np.where(way[:, 0] < 20.0, 2.0, np.where(way[:, 0] > 31.0, 3.0, np.nan))
    up = 3.0 * np.clip((way[:, 0] - 20.0) / 10.0, 0.0, 1.0)
    table = np.column_stack([way, up, floor])
    header = "time_s,east_m,north_m,up_m,floor"
    np.savetxt(folder / "truth.csv", table, delimiter=",", header=header, comments="")
    (task,) = plan(load_runs([folder]), None, methods_of("default"))
    row = evaluate_task(task, "best-fit").row
    assert float(row["height_rmse_m"] or 99.0) < 0.6
    assert row["floors_right_pct"] == pytest.approx(100.0)


def test_poor_fixes_change_nothing(folder: Path) -> None:
    (run,) = load_runs([folder])
    like = GnssSeries(np.arange(0.0, 40.0, 2.0), *np.full((8, 20), np.nan))
    like.h_acc_m[:] = np.linspace(22.0, 669.0, 20)
    poor = with_fixes(run, Receiver("poor", None, 3.0), like, seed=2)
    assert poor.gnss is not None
    assert np.isfinite(poor.gnss.lat_deg).all()
    alone = body_track(walk_body(run, BodySettings()).steps, run.imus["body"])
    heard = body_track(walk_body(poor, BodySettings()).steps, run.imus["body"])
    np.testing.assert_array_equal(heard.position_m, alone.position_m)
    filtered = pns_walk(poor, BodySettings())[1]
    np.testing.assert_allclose(
        filtered.position_m[-1, :2] - filtered.position_m[0, :2],
        alone.position_m[-1, :2] - alone.position_m[0, :2],
        atol=1e-9,
    )
    good = with_fixes(run, Receiver("good", 3.0, 1.0), like, seed=2)
    assert not np.allclose(pns_walk(good, BodySettings())[1].position_m[-1, :2], filtered.position_m[-1, :2])
