"""Satellite receivers: their errors under open sky, and what walls, doors, jammers and spoofers do to them."""

from dataclasses import replace

import numpy as np
import pytest

from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from proving_ground.motion import Motion
from proving_ground.sensors import (
    GNSS_CLASSES,
    Area,
    GnssConditions,
    GnssQuality,
    Mounting,
    Walls,
    Zone,
    measure_gnss,
)
from sensor_gateway.recordings.run import GnssSeries
from support.moving import Straight, Track

ORIGIN = Origin(latitude_deg=59.0, longitude_deg=18.0, height_m=20.0)
HONEST = GNSS_CLASSES["honest"]
EXACT = GnssQuality(
    "none",
    sigma_m=0.0,
    sigma_up_m=0.0,
    white_m=0.0,
    speed_sigma_m_s=0.0,
    first_fix_s=0.0,
    coast_s=0.0,
    again_s=0.0,
)
OPEN = GnssConditions()
INTO_THE_HOUSE = Track(
    np.array([0.0, 100.0]), np.array([[-50.0, 0.0, 0.0], [50.0, 0.0, 0.0]])
)  # the door at 50 s
HOUSE = Zone("indoors", Area.box(0.0, -30.0, 200.0, 30.0), strength=4.0)


def fixes(
    motion: Motion, quality: GnssQuality, conditions: GnssConditions, duration_s: float = 100.0, seed: int = 1
) -> GnssSeries:
    rng = np.random.default_rng(seed)
    return measure_gnss(motion, duration_s, Mounting(), quality, conditions, ORIGIN, rng)


def enu(series: GnssSeries) -> np.ndarray:
    """Reported places (n, 3), NaN without a fix."""
    frame = LocalFrame(ORIGIN)
    rows = zip(series.lat_deg, series.lon_deg, series.alt_m, strict=True)
    return np.array([frame.to_enu(*row) if np.isfinite(row[0]) else [np.nan] * 3 for row in rows])


def fixed(series: GnssSeries) -> np.ndarray:
    return np.isfinite(series.lat_deg)


def test_without_errors_the_receiver_tells_place_speed_and_course() -> None:
    """3 m/s north and 4 m/s east: 5 m/s towards 53.13° (clockwise from north)."""
    series = fixes(Straight((1.0, 2.0, 3.0), (4.0, 3.0, 0.0)), EXACT, OPEN, 10.0)
    np.testing.assert_allclose(enu(series)[7], [29.0, 23.0, 3.0], atol=1e-6)
    np.testing.assert_allclose(series.speed_m_s, 5.0, atol=1e-9)
    np.testing.assert_allclose(series.course_deg, 53.1301, atol=1e-3)
    np.testing.assert_array_equal(series.satellites, 12.0)


def test_a_standing_receiver_knows_no_course() -> None:
    series = fixes(Straight(), EXACT, OPEN, 10.0)
    assert np.isnan(series.course_deg).all()
    np.testing.assert_allclose(series.speed_m_s, 0.0, atol=1e-9)


def test_errors_have_their_size_and_their_memory() -> None:
    quality = replace(HONEST, first_fix_s=0.0, white_m=0.0)
    errors = np.array([enu(fixes(Straight(), quality, OPEN, 61.0, seed)) for seed in range(150)])
    np.testing.assert_allclose(errors[:, 1].std(axis=0), [1.2, 1.2, 2.2], rtol=0.2)
    # A minute is the correlation time: e^-1 of the error is still there.
    alike = np.mean(errors[:, 0, :2] * errors[:, 60, :2]) / 1.2**2
    assert alike == pytest.approx(np.exp(-1.0), abs=0.15)
    assert np.abs(np.diff(errors[:, :, 0], axis=1)).mean() < 0.3


@pytest.mark.parametrize(("name", "low", "high"), [("honest", 0.8, 1.25), ("dishonest", 2.3, 3.6)])
def test_stated_accuracy_is_honest_or_is_not(name: str, low: float, high: float) -> None:
    """Horizontal error over stated accuracy, root mean square."""
    quality = replace(GNSS_CLASSES[name], first_fix_s=0.0)
    ratios = []
    for seed in range(60):
        series = fixes(Straight(), quality, OPEN, 5.0, seed)
        ratios.append(np.linalg.norm(enu(series)[1:, :2], axis=1) / series.h_acc_m[1:])
    assert low < np.sqrt(np.mean(np.square(ratios))) < high


def test_the_first_fix_takes_its_time() -> None:
    series = fixes(Straight(), replace(EXACT, first_fix_s=30.0), OPEN)
    np.testing.assert_array_equal(fixed(series), series.time_s >= 30.0)
    assert (series.satellites[~fixed(series)] <= 3.0).all()


def test_behind_the_door_reception_fades_and_ends() -> None:
    """1 m/s, the door at 50 s, 4 m of fading: signal under 0.05 from 3.8 m on."""
    series = fixes(INTO_THE_HOUSE, EXACT, GnssConditions(zones=(HOUSE,)))
    np.testing.assert_array_equal(fixed(series), series.time_s < 54.0)
    assert series.satellites[49] == 12.0
    assert series.satellites[52] == pytest.approx(3.0 + 9.0 * 0.5, abs=0.51)
    noisy = fixes(
        INTO_THE_HOUSE, replace(HONEST, first_fix_s=0.0, coast_s=0.0), GnssConditions(zones=(HOUSE,))
    )
    assert noisy.h_acc_m[53] > 2.0 * noisy.h_acc_m[49]


def test_a_receiver_that_coasts_walks_on_through_the_wall() -> None:
    inside = Track(np.array([0.0, 54.0, 100.0]), np.array([[-50.0, 0, 0], [4.0, 0, 0], [4.0, 20.0, 0]]))
    series = fixes(inside, replace(EXACT, coast_s=10.0), GnssConditions(zones=(HOUSE,)))
    assert fixed(series).sum() == 54 + 10
    # It had turned north at 54 s; the receiver goes on east with its last velocity.
    np.testing.assert_allclose(enu(series)[63], [13.0, 0.0, 0.0], atol=0.6)
    assert series.h_acc_m[63] > series.h_acc_m[54]


def test_after_an_outage_a_new_fix_takes_a_moment() -> None:
    outage = Zone("indoors", Area.box(-99.0, -99.0, 99.0, 99.0), 1.0, start_s=20.0, end_s=30.0)
    series = fixes(Straight(), replace(EXACT, again_s=5.0), GnssConditions(zones=(outage,)))
    np.testing.assert_array_equal(fixed(series), (series.time_s < 20.0) | (series.time_s >= 35.0))


def test_a_jammer_deafens_with_distance_and_while_it_is_on() -> None:
    """Felt from 200 m, deaf from 100 m."""
    jammer = Zone("jammed", Area.disc((0.0, 0.0), 200.0), 100.0, start_s=10.0)
    signal = []
    for east in (250.0, 160.0, 80.0):
        place_m = np.tile([east, 0.0, 0.0], (2, 1))
        signal.append(GnssConditions(zones=(jammer,)).reception(np.array([0.0, 20.0]), place_m).signal)
    np.testing.assert_allclose(signal, [[1.0, 1.0], [1.0, 0.6], [1.0, 0.0]], atol=0.02)


def test_a_spoofer_drags_slowly_and_seems_perfect() -> None:
    spoofer = Zone(
        "spoofed", Area.box(-99.0, -99.0, 99.0, 99.0), 0.5, start_s=20.0, end_s=60.0, direction_rad=np.pi
    )
    series = fixes(Straight((5.0, 0.0, 0.0)), EXACT, GnssConditions(zones=(spoofer,)))
    east = enu(series)[:, 0]
    np.testing.assert_allclose(east[:20], 5.0, atol=1e-6)
    np.testing.assert_allclose(np.diff(east[20:60]), -0.5, atol=1e-6)
    assert abs(east[20] - 5.0) <= 0.5
    np.testing.assert_allclose(east[60:], 5.0, atol=1e-6)
    np.testing.assert_allclose(series.speed_m_s[20:60], 0.5, atol=1e-9)
    np.testing.assert_array_equal(series.satellites, 12.0)
    assert np.ptp(series.h_acc_m) == 0.0


def test_a_spoofer_reaches_into_the_house() -> None:
    spoofer = Zone("spoofed", Area.box(-99.0, -99.0, 99.0, 99.0), 0.5, start_s=20.0)
    series = fixes(INTO_THE_HOUSE, EXACT, GnssConditions(zones=(HOUSE, spoofer)))
    assert fixed(series).all()


def test_reflections_belong_to_the_place_and_fall_off_from_the_wall() -> None:
    wall = Walls(np.array([[[-500.0, 0.0], [500.0, 0.0]]]), np.array([[0.0, 20.0]]))
    conditions = GnssConditions(walls=wall, wall_bias_m=6.0)
    east = np.linspace(-400.0, 400.0, 300)

    def bias(north_m: float, time_s: float) -> np.ndarray:
        place_m = np.column_stack([east, np.full(300, north_m), np.zeros(300)])
        return conditions.reception(np.full(300, time_s), place_m).bias_m

    np.testing.assert_array_equal(bias(2.0, 0.0), bias(2.0, 500.0))
    assert bias(0.0, 0.0).std() == pytest.approx(6.0, rel=0.2)
    assert bias(8.0, 0.0).std() == pytest.approx(6.0 / np.e, rel=0.25)
    # 6 m further on another reflection rules: correlation e^-½ over 6 m, none over 30 m.
    here = bias(2.0, 0.0)[:, 0]
    assert abs(np.corrcoef(here[12:], here[:-12])[0, 1]) < 0.3


def test_streets_hide_the_sky_in_their_share_of_the_places_and_bias_the_rest() -> None:
    town = Zone("urban", Area.box(-5000.0, -5000.0, 5000.0, 5000.0), strength=10.0, outage_share=0.3)
    rng = np.random.default_rng(2)
    place_m = np.column_stack(
        [rng.uniform(-4000, 4000, 3000), rng.uniform(-4000, 4000, 3000), np.zeros(3000)]
    )
    reception = GnssConditions(zones=(town,)).reception(np.zeros(3000), place_m)
    assert np.mean(reception.signal == 0.0) == pytest.approx(0.3, abs=0.06)
    assert reception.bias_m.std() == pytest.approx(10.0, rel=0.15)
    assert (reception.satellites[reception.signal > 0.0] < 12.0).all()
    walk = fixes(Straight((0.0, 0.0, 0.0), (1.3, 0.0, 0.0)), EXACT, GnssConditions(zones=(town,)), 1500.0)
    outages = np.diff(np.flatnonzero(np.diff(fixed(walk).astype(int))))
    assert len(outages) > 5  # it comes and goes
    assert outages.mean() > 4.0  # for more than a moment


def test_two_receivers_side_by_side_suffer_alike() -> None:
    town = GnssConditions(zones=(Zone("urban", Area.box(-999, -999, 999, 999), 8.0),), seed=3)
    one, two = (fixes(Straight((5.0, 5.0, 0.0)), EXACT, town, seed=seed) for seed in (1, 2))
    np.testing.assert_array_equal(one.lat_deg, two.lat_deg)
