"""Compass and gyro: known rotations, formulas by finite differences, filters on turns that are known."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bootprint.geomagnetism import EarthField
from pdr_engine.body.azimuth.bridges import Bridged
from pdr_engine.body.azimuth.cascade import Cascade, savitzky_golay
from pdr_engine.body.azimuth.compass import (
    UNKNOWN_RAD,
    Compass,
    Reading,
    TwoAxisField,
    tilt_compensated,
    tilt_error,
    two_axis,
)
from pdr_engine.body.azimuth.denoise import approximation
from pdr_engine.body.azimuth.heading import Combined, CompassAlone, GyroAlone, wrapped
from pdr_engine.body.azimuth.sources import Headings, source_of
from pdr_engine.body.settings import BodySettings, CompassCalibration, HeadingSettings

SETTINGS = HeadingSettings()
NORTH_UT, DOWN_UT = 16.0, 48.0
DIP = math.atan2(DOWN_UT, NORTH_UT)


def device_field(azimuth: float, pitch: float, roll: float) -> tuple[float, float, float]:
    """The earth's field in forward, right, down axes after a turn by yaw, then pitch, then roll."""
    device_to_ned = Rotation.from_euler("ZYX", [azimuth, pitch, roll])
    x, y, z = device_to_ned.inv().apply([NORTH_UT, 0.0, DOWN_UT])
    return (float(x), float(y), float(z))


@pytest.mark.parametrize("azimuth", [0.1, 1.5, 3.0, 5.5])
@pytest.mark.parametrize(("pitch", "roll"), [(0.0, 0.0), (0.4, -0.2), (-0.7, 0.5)])
def test_tilt_compensation_undoes_a_known_attitude(azimuth: float, pitch: float, roll: float) -> None:
    field = device_field(azimuth, pitch, roll)
    assert tilt_compensated(field, pitch, roll) == pytest.approx(azimuth)
    assert two_axis(field[:2], pitch, roll, DOWN_UT) == pytest.approx(azimuth)


@pytest.mark.parametrize("azimuth", [0.0, 0.8, 2.0, 4.0])
def test_the_tilt_error_is_the_derivative(azimuth: float) -> None:
    small = 1e-5
    field = device_field(azimuth, 0.0, 0.0)
    by_pitch = wrapped(tilt_compensated(field, small, 0.0) - azimuth)
    by_roll = wrapped(tilt_compensated(field, 0.0, small) - azimuth)
    assert tilt_error(small, 0.0, DIP, azimuth) == pytest.approx(by_pitch, abs=1e-3 * small * math.tan(DIP))
    assert tilt_error(0.0, small, DIP, azimuth) == pytest.approx(by_roll, abs=1e-3 * small * math.tan(DIP))


def test_two_coils_do_in_any_attitude_but_on_edge() -> None:
    enu = np.array([0.0, NORTH_UT, -DOWN_UT])
    two = TwoAxisField()
    two.know_earth_field(EarthField(*enu))
    tilted = Rotation.from_euler("ZYX", [1.0, 0.3, -0.5])
    x, y, z = tilted.inv().apply(enu)
    rows = tuple(map(tuple, tilted.as_matrix()))
    np.testing.assert_allclose(two.complete(rows, (x, y, 777.0)), (x, y, z))
    on_edge = tuple(map(tuple, Rotation.from_euler("y", 1.4).as_matrix()))
    assert math.isnan(two.complete(on_edge, (x, y, z))[2])


def level_step(ahead_ut: float, left_ut: float, up_ut: float) -> np.ndarray:
    return np.tile([ahead_ut, left_ut, up_ut], (25, 1))


def test_the_compass_reads_and_is_judged_by_the_earths_field() -> None:
    """North at the left is east ahead; half as strong again is iron, and worth nothing after some steps."""
    compass = Compass(BodySettings())
    compass.know_earth_field(EarthField(0.0, 16.0, -48.0))
    clean = [compass.read(level_step(0.0, 16.0, -48.0), 0.0, 0.5, None) for _ in range(5)][-1]
    assert clean.azimuth_rad == pytest.approx(0.5 * math.pi)
    assert clean.trusted
    assert not clean.disturbed
    assert clean.sigma_rad == pytest.approx(math.hypot(0.05, 0.14), rel=0.05)
    bent = [compass.read(level_step(24.0, 0.0, -60.0), 0.0, 0.5, None) for _ in range(3)][-1]
    assert bent.disturbed
    assert bent.sigma_rad > 5.0 * clean.sigma_rad


def test_calibration_is_taken_off_in_device_axes() -> None:
    calibration = CompassCalibration((1.0, 2.0, 3.0), ((2.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    compass = Compass(BodySettings(calibration=calibration))
    quarter = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert compass.level(quarter, (11.0, 7.0, 3.0)) == pytest.approx((-5.0, 20.0, 0.0))


def good(azimuth: float, sigma: float = 0.1) -> Reading:
    return Reading(azimuth % math.tau, sigma, trusted=True)


def test_the_gyro_alone_turns_and_doubts_more_and_more() -> None:
    gyro = GyroAlone(SETTINGS)
    first = gyro.step(0.3, 0.5, good(1.0))
    after = [gyro.step(0.1, 0.5, good(2.0)) for _ in range(10)][-1]
    assert first == (1.0, 0.1)
    assert after.azimuth_rad == pytest.approx(0.0)  # counter-clockwise: azimuth falls
    walk, drift = SETTINGS.gyro_noise_rad_sqrt_s**2 * 5.0, (SETTINGS.gyro_drift_rad_s * 5.0) ** 2
    assert after.sigma_rad == pytest.approx(math.sqrt(0.01 + walk + drift))
    assert GyroAlone(SETTINGS).step(0.3, 0.5, None) == (0.0, pytest.approx(UNKNOWN_RAD))


def test_the_compass_alone_believes_each_reading() -> None:
    compass = CompassAlone(SETTINGS)
    assert compass.step(0.0, 0.5, good(1.0)).azimuth_rad == 1.0
    assert compass.step(0.0, 0.5, good(2.5)).azimuth_rad == 2.5
    assert compass.step(0.5, 0.5, None).azimuth_rad == pytest.approx(2.0)


def test_combined_learns_a_drift_and_bridges_what_is_not_trusted() -> None:
    """A gyro that tells 0.001 rad/s too much, ten minutes of clean compass, two of a wrong one: under 5°."""
    rng = np.random.default_rng(4)
    combined = Combined(SETTINGS)
    for _ in range(1200):
        combined.step(0.0005, 0.5, good(1.0 + 0.03 * rng.standard_normal(), 0.05))
    wrong = Reading(2.5, 0.5, trusted=False)
    heading = [combined.step(0.0005, 0.5, wrong) for _ in range(240)][-1]
    assert abs(math.degrees(wrapped(heading.azimuth_rad - 1.0))) < 5.0
    assert abs(wrapped(heading.azimuth_rad - 1.0)) < 3.0 * heading.sigma_rad


def test_combined_is_not_led_by_one_wild_reading() -> None:
    combined = Combined(SETTINGS)
    for _ in range(100):
        combined.step(0.0, 0.5, good(1.0))
    moved = wrapped(combined.step(0.0, 0.5, good(1.0 + 2.0, 0.1)).azimuth_rad - 1.0)
    assert 0.0 < moved < 0.05


def bent(azimuth: float) -> Reading:
    """As a compass reads in a mall: 0.14 rad off, alike over a dozen steps or, for a track's sake, many more."""
    uneven = SETTINGS.disturbance_floor**2
    lasting, alike = (steps * uneven for steps in (SETTINGS.correlation_steps, SETTINGS.alike_steps))
    return Reading(azimuth % math.tau, 0.15, lasting_variance=lasting, alike_variance=alike)


def test_north_is_found_soon_and_the_track_keeps_its_shape() -> None:
    """A first reading 0.3 rad off, then right ones: after 60 the track has still turned by less than half of it."""
    headings = Headings("combined", SETTINGS)
    headings.step(0.0, 0.5, bent(1.3))
    tracks, norths = zip(*(headings.step(0.0, 0.5, bent(1.0)) for _ in range(60)), strict=True)
    assert wrapped(norths[-1].azimuth_rad - 1.0) == pytest.approx(0.0, abs=0.05)
    assert wrapped(tracks[-1].azimuth_rad - 1.0) > 0.15
    assert norths[0].sigma_rad > tracks[0].sigma_rad  # hardly believed at first
    assert norths[-1].sigma_rad < tracks[-1].sigma_rad


@pytest.mark.parametrize("name", ["bridge", "gyro", "compass", "cascade"])
def test_other_sources_have_one_azimuth(name: str) -> None:
    headings = Headings(name, SETTINGS)
    for azimuth in (1.3, 1.0, 1.0):
        track, north = headings.step(0.1, 0.5, bent(azimuth))
        assert track == north


@pytest.mark.parametrize("name", ["combined", "bridge", "bridge-direct", "bridge-weighted"])
def test_what_standing_still_takes_off_the_gyro_is_no_drift_any_more(name: str) -> None:
    """0.002 rad/s known from twenty clean minutes; counted twice it would lead 14° aside in two blind ones."""
    source = source_of(name, SETTINGS)
    for _ in range(2400):
        source.step(0.001, 0.5, good(1.0, 0.05))
    source.unbias(0.002)
    heading = [source.step(0.0, 0.5, None) for _ in range(240)][-1]
    assert abs(math.degrees(wrapped(heading.azimuth_rad - 1.0))) < 4.0


def test_a_break_in_the_stream_is_doubt() -> None:
    for name in ("combined", "gyro", "bridge", "bridge-direct", "cascade"):
        source = source_of(name, SETTINGS)
        before = [source.step(0.0, 0.5, good(1.0)) for _ in range(10)][-1]
        source.lose(1.0)
        assert source.step(0.0, 0.5, None).sigma_rad > before.sigma_rad + 0.5


@pytest.mark.parametrize("kind", ["kalman", "exponential", "plain"])
def test_a_bridge_follows_the_compass_learns_the_bias_and_goes_on_by_it(kind: str) -> None:
    """A gyro that tells 0.004 rad a step too much counter-clockwise, ten minutes straight on, then iron."""
    bridge = Bridged(kind, SETTINGS)
    for _ in range(1200):
        heading = bridge.step(0.004, 0.5, good(1.0))
    assert heading.azimuth_rad == pytest.approx(1.0, abs=0.05)  # the exponential one halves its errors slowly
    iron = Reading(2.0, UNKNOWN_RAD, trusted=False, disturbed=True)
    for _ in range(5):
        bridged = bridge.step(0.104, 0.5, iron)
    assert wrapped(bridged.azimuth_rad - heading.azimuth_rad) == pytest.approx(-0.5, abs=0.02)
    assert bridged.sigma_rad > heading.sigma_rad


@pytest.mark.parametrize("kind", ["kalman", "exponential", "plain"])
def test_quick_turns_are_the_gyros(kind: str) -> None:
    bridge = Bridged(kind, SETTINGS)
    for _ in range(100):
        bridge.step(0.0, 0.5, good(1.0))
    assert bridge.step(-0.5, 0.5, good(3.0)).azimuth_rad == pytest.approx(1.5, abs=0.01)


def test_savitzky_golay_keeps_parabolas_and_wraps() -> None:
    line = 6.2 + 0.02 * np.arange(7)  # through north
    assert wrapped(savitzky_golay(line % math.tau, 6) - line[6]) == pytest.approx(0.0, abs=1e-3)
    assert wrapped(savitzky_golay(line % math.tau, 3) - line[3]) == pytest.approx(0.0, abs=1e-3)


def test_the_cascade_smooths_and_refines_three_steps_later() -> None:
    rng = np.random.default_rng(2)
    cascade = Cascade(SETTINGS)
    noisy = 1.0 + 0.1 * rng.standard_normal(200)
    out = [cascade.step(0.0, 0.5, good(azimuth)).azimuth_rad for azimuth in noisy]
    assert np.std(out[50:]) < 0.5 * np.std(noisy)
    assert np.mean(out[50:]) == pytest.approx(1.0, abs=0.05)
    assert cascade.refined == pytest.approx(savitzky_golay(noisy[-7:], 3))


def test_the_cascade_does_not_lag_behind_a_steady_bend() -> None:
    cascade = Cascade(SETTINGS)
    bend = 0.02 * np.arange(150)
    out = [cascade.step(0.0, 0.5, good(azimuth)).azimuth_rad for azimuth in bend]
    assert wrapped(out[-1] - bend[-1]) == pytest.approx(0.0, abs=0.03)  # a window's middle would lag by 0.06


def test_the_cascade_turns_as_fast_where_the_field_is_doubted() -> None:
    sure, doubted = Cascade(SETTINGS), Cascade(SETTINGS)
    for azimuth in (1.0,) * 30 + (2.5,) * 10:
        told = sure.step(0.0, 0.5, good(azimuth))
        unsure = doubted.step(0.0, 0.5, Reading(azimuth, 0.6))
    assert unsure.azimuth_rad == told.azimuth_rad
    assert unsure.sigma_rad > 0.6 > told.sigma_rad


def test_the_wavelet_takes_the_stride_out_and_leaves_the_turn() -> None:
    time_s = 0.02 * np.arange(512)
    turn, sway = 0.05 * time_s, 0.1 * np.sin(2 * np.pi * 0.95 * time_s)
    left = approximation(turn + sway) - turn
    inside = slice(100, -100)
    assert np.std(left[inside]) < 0.35 * np.std(sway[inside])
    np.testing.assert_allclose(approximation(turn)[inside], turn[inside], atol=1e-3)
