"""`bootprint calibrate compass`: a worn unit turned on the spot, and walked out and back."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
import typer
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from bootprint.errors import ConfigError, RecordingError
from proving_ground.calibration.foot_magnetometer import register

WORN = Rotation.from_euler("ZYX", [0.0, 0.2, -0.1])  # device to level, yaw free
HARD = np.array([5.0, -3.0, 2.0])
RATE_HZ = 50.0


def calibrate(*args: object) -> str:
    app = typer.Typer()
    register(app)
    result = CliRunner().invoke(app, ["calibrate", "compass", *map(str, args)], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


def run_folder(folder: Path, yaw: np.ndarray, bounce_m_s2: float = 0.0, magnetic: bool = True) -> Path:
    """A body-worn unit that faces these yaws (n,), in a field of 21 µT north and 43 µT down; it has iron."""
    time_s = np.arange(len(yaw)) / RATE_HZ
    attitude = Rotation.from_euler("Z", yaw[:, None]) * WORN
    up = np.zeros((len(yaw), 3))
    up[:, 2] = 9.80665 + bounce_m_s2 * np.cos(2.0 * np.pi * 1.8 * time_s)
    accel = attitude.inv().apply(up)
    rate = np.gradient(yaw, time_s)
    gyro = attitude.inv().apply(np.column_stack([0.0 * rate, 0.0 * rate, rate]))
    field = attitude.inv().apply(np.tile([0.0, 21.0, -43.0], (len(yaw), 1))) + HARD
    columns = [time_s[:, None], accel, gyro, field][: 4 if magnetic else 3]
    header = "time_s,ax,ay,az,gx,gy,gz" + (",mx,my,mz" if magnetic else "")
    folder.mkdir()
    np.savetxt(folder / "body.csv", np.hstack(columns), "%.6f", ",", header=header, comments="")
    return folder


def turning() -> np.ndarray:
    """Two turns in 40 s, after 2 s of standing."""
    return np.concatenate([np.zeros(100), np.linspace(0.0, 4.0 * np.pi, 2000)])


def test_the_horizontal_part_of_the_iron_is_found(tmp_path: Path) -> None:
    text = calibrate(run_folder(tmp_path / "run", turning()))
    found = tomllib.loads(text)["pdr"]["body"]["calibration"]
    matrix, offset = np.array(found["matrix"]), np.array(found["offset_ut"])
    np.testing.assert_allclose(matrix, np.eye(3), atol=0.02)
    # What is along the vertical no turn on the spot can tell.
    level = WORN.apply(HARD - offset)
    np.testing.assert_allclose(level[:2], 0.0, atol=0.3)
    assert "horizontal field 21.0 µT" in text


def test_a_walk_adds_virtual_pitch_and_roll(tmp_path: Path) -> None:
    yaw = np.concatenate([np.full(2500, 0.3), np.linspace(0.3, 0.3 + np.pi, 100), np.full(2500, 0.3 + np.pi)])
    walk = run_folder(tmp_path / "walk", yaw, bounce_m_s2=3.0)
    azimuth_deg = np.degrees(0.5 * np.pi - 0.3)
    turn = run_folder(tmp_path / "turn", turning())
    text = calibrate(turn, "--walk", walk, "--azimuth-deg", azimuth_deg)
    assert "virtual pitch" in text
    closed = calibrate(turn, "--walk", walk)
    assert "virtual pitch" in closed


def test_what_cannot_be_calibrated_is_said(tmp_path: Path) -> None:
    still = run_folder(tmp_path / "still", np.zeros(500))
    with pytest.raises(RecordingError, match="turn on the spot"):
        calibrate(still)
    with pytest.raises(RecordingError, match="magnetometer"):
        calibrate(run_folder(tmp_path / "blind", turning(), magnetic=False))
    with pytest.raises(ConfigError, match="no axis"):
        calibrate(still, "--ahead", "up")
    with pytest.raises(ConfigError, match="needs --walk"):
        calibrate(still, "--azimuth-deg", "30")
    turn = run_folder(tmp_path / "turn", turning())
    with pytest.raises(RecordingError, match="too few"):
        calibrate(turn, "--walk", still)
    with pytest.raises(ConfigError, match="cannot be written"):
        calibrate(turn, "--output", tmp_path / "nowhere" / "x.toml")
