"""`bootprint calibrate foot-magnetometer`: from a run folder to a table that the pdr-engine takes."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from bootprint.config import convert
from bootprint.errors import BootprintError, ConfigError, RecordingError
from pdr_engine.config import PdrConfig
from proving_ground.calibration import foot_magnetometer as calibration

HARD = np.array([12.0, -20.0, 5.0])
REALM = """
id = "bp"
group_key = "group"
origin = { latitude_deg = 47.05, longitude_deg = 8.31 }
[[roster]]
id = "a1"
number = 1
unit = "alpha"
"""

app = typer.Typer()
calibration.register(app)


def calibrate(*arguments: object) -> str:
    command = ["calibrate", "foot-magnetometer", *map(str, arguments)]
    result = CliRunner().invoke(app, command, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


def turned_boot(folder: Path, places: tuple[str, ...] = ("left_foot",), magnetic: bool = True) -> Path:
    """A run folder of boots turned in all directions in a field of 48 µT."""
    rng = np.random.default_rng(0)
    unit = rng.normal(size=(800, 3))
    field = 48.0 * unit / np.linalg.norm(unit, axis=1, keepdims=True) + HARD
    columns = np.column_stack([np.arange(800) / 200.0, 9.81 * unit, 0.0 * unit, field])
    folder.mkdir()
    for place in places:
        header = "time_s,ax,ay,az,gx,gy,gz" + (",mx,my,mz" if magnetic else "")
        width = 10 if magnetic else 7
        np.savetxt(folder / f"{place}.csv", columns[:, :width], "%.6f", ",", header=header, comments="")
    return folder


def test_the_table_is_one_that_the_engine_takes(tmp_path: Path) -> None:
    text = calibrate(turned_boot(tmp_path / "run"))
    assert text.startswith("# 26 of 26 directions covered; strength 48.0 µT")
    config = convert(tomllib.loads(text)["pdr"], PdrConfig, where="test")
    found = config.foot.magnetometer.calibration("left_foot")
    np.testing.assert_allclose(found.offset_ut, HARD, atol=0.02)
    np.testing.assert_allclose(found.matrix, np.eye(3), atol=1e-3)
    assert config.foot.magnetometer.calibration("right_foot") != found


def test_the_realm_s_place_gives_the_strength(tmp_path: Path) -> None:
    (tmp_path / "realm.toml").write_text(REALM)
    (tmp_path / "computer.toml").write_text('realm = "realm.toml"\nsoldier = "a1"\n')
    output = tmp_path / "calibration.toml"
    boot = turned_boot(tmp_path / "run", ("left_foot", "right_foot"))
    assert not calibrate(
        boot, "--place", "right_foot", "--config", tmp_path / "computer.toml", "--output", output
    )
    matrix = tomllib.loads(output.read_text())["pdr"]["foot"]["magnetometer"]["right_foot"]["matrix"]
    # The field in central Switzerland is 48.3 µT strong and grows by 0.03 µT a year.
    assert 48.0 * np.linalg.det(matrix) ** (1 / 3) == pytest.approx(48.4, abs=0.5)


@pytest.mark.parametrize(
    ("places", "magnetic", "options", "complaint"),
    [
        (("left_foot",), False, (), "no magnetometer of a foot"),
        (("left_foot",), True, ("--place", "right_foot"), "no magnetometer of right_foot"),
        (("left_foot", "right_foot"), True, (), "magnetometers of left_foot, right_foot: name one"),
    ],
)
def test_what_cannot_be_calibrated_is_said(
    tmp_path: Path, places: tuple[str, ...], magnetic: bool, options: tuple[str, ...], complaint: str
) -> None:
    with pytest.raises(RecordingError, match=complaint):
        calibrate(turned_boot(tmp_path / "run", places, magnetic), *options)


def test_a_file_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be written"):
        calibrate(turned_boot(tmp_path / "run"), "--output", tmp_path / "nowhere" / "x.toml")
    assert issubclass(ConfigError, BootprintError)
