"""The agreement of simulated with recorded walks: the tools against a motion that is known, then the verdict."""

import json
from dataclasses import replace

import numpy as np
import pytest
import typer
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from bootprint.errors import ConfigError
from proving_ground.agreement import torso
from proving_ground.agreement.command import register
from proving_ground.agreement.comparison import Finding, compare, load, observe, survey_is_sound
from proving_ground.agreement.fit_shapes import KINDS, fitted, lever_arm, samples_of
from proving_ground.agreement.report import page, rows_of
from proving_ground.agreement.signals import BANDS_HZ, band_rms
from proving_ground.agreement.strides import strides_of
from proving_ground.people import INSTEP_M
from proving_ground.people.shape import PITCH, evaluated, whole
from proving_ground.people.stride_shapes import SHAPES
from proving_ground.sensors import Mounting, imu_class, measure_imu
from sensor_gateway.recordings.run import Run
from support.people_walks import walked
from support.recorded import recorded_data

MOUNTING = Mounting(INSTEP_M, Rotation.from_euler("XYZ", [0.4, -0.3, 1.2]))


@pytest.fixture(scope="module")
def known():
    """A simulated walk, and what a good unit on its right instep measures."""
    motion = walked("walk", [[0, 0, 0], [40, 0, 0]], seed=9)
    rng = np.random.default_rng(1)
    return motion, measure_imu(
        motion.right_foot, motion.duration_s, MOUNTING, imu_class("tactical"), None, rng
    )


def test_strides_are_rebuilt_as_they_were(known) -> None:
    motion, imu = known
    strides = strides_of(imu)
    true = motion.right_foot.strides
    assert len(strides) == pytest.approx(len(true.start_s), abs=1)
    inner = strides[2:-2]
    begins = [np.abs(true.start_s - stride.begin_s).min() for stride in inner]
    assert np.median(begins) < 0.08
    errors_m = []
    for stride in inner:
        times = stride.begin_s + stride.time_s
        place, attitude = MOUNTING.carried(motion.right_foot, times)
        moved = place - place[0]
        errors_m.append(np.linalg.norm(stride.position_m[-1]) - np.linalg.norm(moved[-1]))
        pitch = (attitude * MOUNTING.rotation.inv()).as_euler("ZYX")[:, 1]
        assert np.abs(stride.euler_rad[:, 1] - pitch).max() < np.radians(6.0)
    # A foot that creeps at 2 cm/s at mid-stance, taken to be at rest there, is wrong by about as much in a second.
    assert np.median(np.abs(errors_m)) < 0.04
    assert np.max(np.abs(errors_m)) < 0.15


def test_the_lever_arm_is_found(known) -> None:
    _, imu = known
    strides = [stride for stride in strides_of(imu) if KINDS["walk"](stride)]
    found = lever_arm(strides)
    np.testing.assert_allclose(found[[0, 2]], -INSTEP_M[[0, 2]], atol=0.02)
    # Feet hardly roll about their long axis, so how far aside the still point lies is weakly seen.
    assert abs(found[1]) < 0.09


def test_shapes_fitted_to_simulated_strides_are_those_they_were_made_of(known, tmp_path) -> None:
    _, imu = known
    run = Run("known", "foot", tmp_path, {"right_foot": imu})
    found = fitted([sample for sample in samples_of(run) if KINDS["walk"](sample.stride)])
    made = SHAPES["walk"]
    phase, index = np.linspace(0.0, 1.0, 101), np.zeros(101, np.int64)
    speed, none = np.array([found.speed_m_s]), np.zeros((1, len(made.modes)))
    pitches = [
        evaluated(whole(shape.coefficients(speed, none[:, : len(shape.modes)])), index, phase)[:, PITCH]
        for shape in (made, found)
    ]
    assert np.degrees(np.sqrt(np.mean((pitches[0] - pitches[1]) ** 2))) < 5.0
    assert found.land_share == pytest.approx(made.land_share, abs=0.06)


def test_the_energy_of_a_tone_is_found_in_its_band() -> None:
    time_s = np.arange(0.0, 20.0, 0.005)
    tone = np.column_stack([np.sin(2 * np.pi * 20.0 * time_s), np.zeros((len(time_s), 2))])
    rms = band_rms(time_s, 3.0 * tone)
    expected = [3.0 / np.sqrt(2.0) if low <= 20.0 < high else 0.0 for low, high in BANDS_HZ]
    np.testing.assert_allclose(rms, expected, atol=0.05)


def test_a_ratio_beyond_its_bound_does_not_agree() -> None:
    fair = Finding("s", "walk", "rmse_m p50", recorded=0.1, simulated=0.19, bound=2.0, held_out_ratio=None)
    assert fair.agrees
    assert not replace(fair, simulated=0.21).agrees
    assert not replace(fair, simulated=0.049).agrees
    assert "1 of 2 figures" in page([fair, replace(fair, simulated=0.3)])
    assert rows_of([fair])[0]["ratio"] == pytest.approx(1.9)


def test_the_command_says_what_is_wrong_with_its_folder(tmp_path) -> None:
    app = typer.Typer()
    register(app)
    for folder, says in ((tmp_path, "none of the sets"), (tmp_path / "no", "is no folder")):
        result = CliRunner().invoke(app, [str(folder)])
        assert isinstance(result.exception, ConfigError)
        assert says in str(result.exception)


@pytest.mark.recorded
def test_foot_walks_agree_within_their_bounds() -> None:
    feet = [(foot, odd) for foot, odd in load(recorded_data()) if foot.kind == "walk"]
    walks = [pair for pair in feet if pair[0].dataset != "foot-gcp" or survey_is_sound(pair[0])]
    assert len(feet) - len(walks) == 1  # walk 31, whose survey is wrong
    recorded, simulated = [], []
    for real, twins in observe(walks, seeds=1):
        recorded.append(real)
        simulated += twins
    found = compare(recorded, simulated)
    assert len(found) >= 90
    # With one twin each a few figures wander; the page's three hold them all.
    outside = [one for one in found if not one.agrees]
    assert len(outside) <= 3, outside
    # The errors of the foot INS are the point: within a factor of two at every percentile.
    errors = [one for one in found if one.figure.startswith("rmse_m")]
    assert len(errors) == 9
    assert [one for one in errors if not one.agrees] == []


@pytest.mark.recorded
def test_the_torso_shakes_as_a_recorded_one() -> None:
    found = list(torso.findings(recorded_data(), seeds=2))
    assert len(found) == 9
    assert [one for one in found if not one.agrees] == []
    assert json.dumps(rows_of(found), allow_nan=False)
