"""Faults put into recordings, and what they do: each is what its name says, and the table tells its figures."""

from pathlib import Path

import numpy as np
import pytest

from proving_ground.evaluation.foot import faults
from proving_ground.evaluation.foot.faults import FAULTS, Fault
from proving_ground.evaluation.foot.robustness import HEADER, Degradation, degradation_table, degradations
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import ImuSeries
from support.walking_foot import walking_foot, write_run_folder


def series(count: int = 4000) -> ImuSeries:
    """20 s at 200 Hz of a ramp: what is added or lost shows."""
    ramp = np.linspace(-200.0, 200.0, count)[:, None] * [1.0, 0.5, 0.25]
    return ImuSeries(np.arange(1, count + 1) * 0.005, ramp, 0.1 * ramp)


@pytest.mark.parametrize("fault", FAULTS[1:], ids=lambda fault: fault.name)
def test_every_fault_changes_something_and_leaves_the_recording_alone(fault: Fault) -> None:
    before = series()
    after = fault.change(before)
    assert np.array_equal(before.accel_m_s2, series().accel_m_s2)
    same = len(after.time_s) == len(before.time_s) and all(
        np.array_equal(getattr(after, name), getattr(before, name))
        for name in ("time_s", "accel_m_s2", "gyro_rad_s")
    )
    assert same == (fault.name == "`unknown` set")
    assert np.isfinite(after.accel_m_s2).all()


@pytest.mark.parametrize("change", [faults.slower(100.0), faults.faster(800.0)], ids=["slower", "faster"])
def test_another_rate_keeps_the_integral(change: faults.Change) -> None:
    """What is measured is the mean over an interval: its sum times the interval is the change of velocity."""
    before, after = series(), change(series())
    assert np.sum(after.accel_m_s2, axis=0) * np.median(np.diff(after.time_s)) == pytest.approx(
        np.sum(before.accel_m_s2, axis=0) * 0.005, abs=2.0
    )
    assert np.interp(5.0, after.time_s, after.accel_m_s2[:, 0]) == pytest.approx(
        np.interp(5.0, before.time_s, before.accel_m_s2[:, 0]), abs=0.3
    )


def test_shares_limits_and_scales_are_as_named() -> None:
    imu = series()
    assert len(faults.missing(0.2)(imu).time_s) == pytest.approx(3200, abs=80)
    assert len(faults.duplicated(0.05)(imu).time_s) == 4200
    assert np.abs(faults.clipped(accel_g=4.0)(imu).accel_m_s2).max() == pytest.approx(39.2266)
    assert np.abs(faults.clipped(gyro_deg_s=400.0)(imu).gyro_rad_s).max() == pytest.approx(6.98132)
    assert np.linalg.norm((faults.biased(0.1)(imu).gyro_rad_s - imu.gyro_rad_s)[0]) == pytest.approx(0.1)
    gaps = np.diff(faults.bursts(0.2, 0.5)(imu).time_s)
    assert len(gaps[gaps > 0.1]) == 3
    assert 0.2 <= gaps.max() <= 0.51


def test_only_the_mirror_is_left_handed() -> None:
    basis = ImuSeries(np.arange(3) * 0.005, np.eye(3), np.eye(3))
    assert np.linalg.det(faults.turned()(basis).accel_m_s2) == pytest.approx(1.0)
    assert np.linalg.det(faults.mirrored()(basis).accel_m_s2) == pytest.approx(-1.0)


def test_the_table_tells_median_mean_and_worst() -> None:
    text = degradation_table([Degradation("rust", [0.1, 0.2, 0.6], [], [100.0, 50.0])])
    assert text == f"{HEADER}\n| rust | 0.200 / 0.300 / 0.600 | – | 75 | 3 |"


def test_a_fault_shows_in_its_row(tmp_path: Path) -> None:
    folder = write_run_folder(tmp_path / "run", {"left_foot": walking_foot(10, seed=1, offset_m=0.2)})
    runs = load_runs([folder])
    chosen = [fault for fault in FAULTS if fault.name in ("untouched", "axes turned", "left-handed axes")]
    untouched, turned, mirrored = degradations(runs, chosen)
    assert untouched.rmse_m[0] < 0.15
    assert turned.rmse_m == pytest.approx(untouched.rmse_m, abs=1e-3)
    assert mirrored.rmse_m[0] > 2 * untouched.rmse_m[0]
