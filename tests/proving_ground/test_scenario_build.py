"""From scenario to exercise: motion, sensors, nets and faults, the same for the same seed."""

from pathlib import Path

import numpy as np
import pytest

from bootprint.geodesy import yaw_of_azimuth
from proving_ground.exercises.exercise import Exercise, Fault
from proving_ground.scenario import Scenario, load_scenario
from proving_ground.scenario.build import build, instrumented, start_of
from proving_ground.scenario.surroundings import Surroundings
from sensor_gateway.recordings.run import Truth
from support.scenarios import HEAD, HOUSE, team, written

UNITS = """
start_sigma_m = 0.3
units = [{ id = "hq", kind = "platoon" }, { id = "alpha", kind = "squad", parent = "hq" }]
posts = [{ id = "cp", unit = "hq" }]
zones = [{ kind = "spoofed", from_s = 4, until_s = 9, drag_m_s = 2, towards_deg = 90 }]
magnetic = [{ kind = "dipole", at_m = [3, 3], moment_a_m2 = [0, 0, 80] }]
weather = { wind_m_s = 0, drift_pa_per_sqrt_h = 0 }

[[kits]]
name = "full"
imus = [{ place = "left_foot" }, { place = "right_foot" }, { place = "body", quality = "consumer" }]
camera = "fast"
uwb = true
foot_ranging = true

[[kits]]
name = "plain"
imus = [{ place = "right_foot", magnetometer = false }]
gnss = "none"
barometer = "none"
"""
MORE = """
[[nets]]
each = "platoon"
profile = "vhf-1200"
latency_s = 0.4
outages = [{ from_s = 5, until_s = 7 }, { from_s = 9 }]
[[nets]]
each = "squad"
loss = 0.2
[[faults]]
kind = "clock_jump"
at_s = 12
target = "cp"
jump_s = -3600
[[faults]]
kind = "sensor_frozen"
at_s = 6
target = "a1"
sensor = "left_foot"
for_s = 2
"""
SEARCH = '  { do = "run", to = "upstairs" },\n  { do = "stand", for_s = 3 },'
LEADER = 'roles = ["squad_leader"]\nkit = "full"'


def scenario_in(folder: Path) -> Scenario:
    teams = team(SEARCH, LEADER, at="[3, -8]", soldiers=2) + team(
        '  { do = "walk", to = [-5, -8] },', 'kit = "plain"', at="[0, -8]", soldiers=1
    )
    # TOML wants what stands at the top before any table.
    return load_scenario(written(folder, HEAD + UNITS + HOUSE + teams + MORE))


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    return scenario_in(tmp_path_factory.mktemp("scenario"))


@pytest.fixture(scope="module")
def exercise(scenario: Scenario) -> Exercise:
    return build(scenario, seed=3)


def test_everybody_goes_where_the_plan_says(scenario: Scenario, exercise: Exercise) -> None:
    play = scenario.play(3)
    for soldier in exercise.soldiers:
        legs = play.timetables[soldier.id].itinerary.legs
        ends = soldier.truth.position_m[[0, -1]]
        assert ends[0] == pytest.approx(legs[0].points_m[0], abs=0.15)
        assert ends[1] == pytest.approx(legs[-1].points_m[-1], abs=0.15)
        assert soldier.truth.time_s[-1] == pytest.approx(play.duration_s, abs=0.2)
    assert exercise.soldiers[0].truth.position_m[-1, 2] == pytest.approx(3.0, abs=0.05)
    assert exercise.duration_s == pytest.approx(play.duration_s, abs=0.2)


def test_kits_measure_what_they_have(exercise: Exercise) -> None:
    full, other, plain = (soldier.run for soldier in exercise.soldiers)
    assert set(full.imus) == {"left_foot", "right_foot", "body"}
    assert all(imu.mag_ut is not None for imu in full.imus.values())
    assert full.camera is not None
    assert full.pressure is not None
    assert full.ranges is not None
    assert set(full.ranges.peer) == {"a2", "a1/right_foot"}
    assert other.ranges is not None
    assert "a1" in other.ranges.peer
    assert (np.diff(full.ranges.time_s) >= 0).all()
    assert list(plain.imus) == ["right_foot"]
    assert plain.imus["right_foot"].mag_ut is None
    assert (plain.gnss, plain.pressure, plain.camera, plain.ranges) == (None, None, None, None)


def test_pressure_falls_by_a_storey_s_worth(exercise: Exercise) -> None:
    series = exercise.soldiers[0].run.pressure
    assert series is not None
    climb = float(series.pressure_pa[:10].mean() - series.pressure_pa[-5:].mean())
    assert climb == pytest.approx(3.0 * 11.96, abs=6.0)  # 11.96 Pa a metre at sea level, 15 °C


def test_satellites_are_dragged_by_the_spoofer_and_end_at_the_door(exercise: Exercise) -> None:
    soldier = exercise.soldiers[0]
    gnss = soldier.run.gnss
    assert gnss is not None
    east = (gnss.lon_deg - 18.07) * 111_320.0 * np.cos(np.radians(59.35))
    true_east = np.interp(gnss.time_s, soldier.truth.time_s, soldier.truth.position_m[:, 0])
    error = east - true_east
    assert error[8] - error[4] == pytest.approx(8.0, abs=1.5)  # 2 m/s for four seconds
    assert np.isnan(gnss.lat_deg[-4:]).all()
    assert np.isfinite(gnss.lat_deg[:8]).all()


def test_iron_bends_the_field_near_it(scenario: Scenario) -> None:
    field = Surroundings(scenario, scenario.play(3), 3).magnetics
    near, far = field.field_ut(np.array([[3.0, 3.0, 1.5], [60.0, 60.0, 0.0]]))
    # On the axis of a dipole 1 m away: 0.2 µT m³/(A m²) · 80 A m² / 1 m³, up.
    assert near[2] - far[2] == pytest.approx(16.0, rel=0.1)


# Stands, then goes north-west, whichever way the body faces.
NORTH_WEST = Truth(np.arange(4.0), np.array([[0.0, 0, 0], [0, 0, 0], [-1, 1, 0], [-5, 5, 0]]))


def test_the_start_is_as_wrong_as_it_says(scenario: Scenario) -> None:
    errors, azimuths = [], []
    for seed in range(40):
        for soldier in scenario.cast.soldiers:
            start = start_of(scenario, soldier, NORTH_WEST, seed)
            place = scenario.starts[soldier.id][0][0]
            errors.append([start["east_m"] - place[0], start["north_m"] - place[1]])
            azimuths.append((start["azimuth_deg"] - 315.0) / start["azimuth_sigma_deg"])
            assert start["sigma_m"] == 0.3
    assert np.std(errors) == pytest.approx(0.3, rel=0.2)
    assert abs(np.mean(azimuths)) < 0.3
    assert np.std(azimuths) == pytest.approx(1.0, rel=0.2)


def test_who_stays_is_given_the_way_they_face(scenario: Scenario) -> None:
    soldier = scenario.cast.soldiers[0]
    facing = scenario.starts[soldier.id][1]
    start = start_of(scenario, soldier, Truth(np.arange(2.0), np.zeros((2, 3))), 1)
    wrong = np.angle(np.exp(1j * (yaw_of_azimuth(np.radians(start["azimuth_deg"])) - facing)))
    assert abs(np.degrees(wrong)) < 5.0 * start["azimuth_sigma_deg"]


def test_posts_nets_and_faults_are_handed_over(scenario: Scenario, exercise: Exercise) -> None:
    assert [(hub.id, hub.unit, hub.role) for hub in exercise.hubs] == [("cp", "hq", "command_post")]
    nets = {net.profile.name: net for net in exercise.nets}
    assert nets["hq"].members == ("cp", "a1")
    assert nets["hq"].outages_s == ((5.0, 7.0), (9.0, scenario.play(3).duration_s))
    assert nets["alpha"].members == ("a1", "a2", "a3")
    assert nets["alpha"].profile.loss == 0.2
    radios = {name: (net.profile.profile, net.profile.rate_bits_per_s) for name, net in nets.items()}
    assert set(radios.values()) == {("vhf-1200", 1200.0), (None, 9600.0)}
    slow = next(net.profile for net in exercise.nets if net.profile.profile)
    assert (slow.latency_s, slow.header_bytes) == (0.4, 8)
    assert exercise.faults == (
        Fault(6.0, "sensor_frozen", "a1", {"sensor": "left_foot", "for_s": 2.0}),
        Fault(12.0, "clock_jump", "cp", {"jump_s": -3600.0}),
    )
    assert exercise.storeys_m == {0: 0.0, 1: 3.0}
    leader = exercise.soldiers[0]
    assert (leader.id, leader.unit, leader.role) == ("a1", "alpha", "squad_leader")


def test_the_same_seed_is_the_same_exercise(scenario: Scenario, exercise: Exercise) -> None:
    again, other = (next(instrumented(scenario, scenario.play(seed), seed)) for seed in (3, 4))
    first = exercise.soldiers[0]
    assert first.start == again.start != other.start
    assert np.array_equal(first.truth.position_m, again.truth.position_m)
    for place, imu in first.run.imus.items():
        assert np.array_equal(imu.gyro_rad_s, again.run.imus[place].gyro_rad_s)
        assert not np.array_equal(imu.gyro_rad_s[:50], other.run.imus[place].gyro_rad_s[:50])


def test_run_folders_hold_the_same_to_six_digits(
    scenario: Scenario, exercise: Exercise, tmp_path: Path
) -> None:
    first, read = exercise.soldiers[0], next(instrumented(scenario, scenario.play(3), 3, tmp_path))
    assert read.run.path == tmp_path / "a1"
    assert np.array_equal(first.truth.position_m, read.truth.position_m)
    assert set(read.run.imus) == set(first.run.imus)
    for place, imu in first.run.imus.items():
        assert np.abs(read.run.imus[place].gyro_rad_s - imu.gyro_rad_s).max() < 1e-6
    assert first.run.ranges is not None
    assert read.run.ranges is not None
    assert read.run.ranges.peer == first.run.ranges.peer
