"""Broken sensors, and sensors as MAVLink bytes that the gateway's own intake reads back."""

import heapq
from pathlib import Path

import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.messages import CameraMotion, GnssFix, ImuBatch, Pressure
from bootprint.topics import Identity
from proving_ground.exercises.exercise import Exercise, Fault, Soldier
from proving_ground.exercises.faults.sensor_faults import with_faults
from proving_ground.exercises.processes.mavlink_out import PLACES, mavlink_frames
from proving_ground.exercises.processes.run_files import with_files, without_samples
from sensor_gateway.intake import Intake
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import CameraSeries, GnssSeries, ImuSeries, PressureSeries, Run, Truth
from sensor_gateway.settings import Device, Sensor

START_NS = 1_780_000_000_000_000_000
TIME_S = np.arange(0.0, 4.0, 0.01)
SLOW_S = np.arange(0.0, 4.0, 0.5)


def imu(seed: int) -> ImuSeries:
    rng = np.random.default_rng(seed)
    shape = (TIME_S.size, 3)
    return ImuSeries(TIME_S, rng.normal(0, 20, shape), rng.normal(0, 3, shape), rng.normal(0, 40, shape))


def gnss() -> GnssSeries:
    n = SLOW_S.size
    unknown = np.full(n, np.nan)
    latitude = np.linspace(59.35, 59.351, n)
    latitude[3] = np.nan  # a second without satellites
    return GnssSeries(
        SLOW_S, latitude, np.full(n, 18.07), np.full(n, 41.5), np.full(n, 2.5), np.full(n, 4.0),
        np.full(n, 9.0), unknown, np.full(n, 370.0),
    )  # fmt: skip


def run() -> Run:
    turn = np.column_stack([np.zeros(8), np.zeros(8), np.full(8, 0.5)])
    camera = CameraSeries(SLOW_S - 0.1, SLOW_S, np.tile([1.0, 0.25, -0.125], (8, 1)), turn)
    return Run(
        "walk",
        "dual",
        Path(),
        {"left_foot": imu(1), "right_foot": imu(2)},
        pressure=PressureSeries(SLOW_S, np.linspace(100_000.0, 100_100.0, SLOW_S.size)),
        gnss=gnss(),
        camera=camera,
    )


DEVICE = Device(
    imus=tuple(Sensor(system=PLACES[place], place=place) for place in ("left_foot", "right_foot")),
    pressure=(Sensor(system=PLACES["body"], place="body"),),
    gnss=(Sensor(system=PLACES["gnss"], place="gnss"),),
    camera=(Sensor(system=PLACES["camera"], place="camera"),),
)


def read_back() -> tuple[list[Envelope], dict[str, int]]:
    """The frames in order of time through the gateway's intake, each a millisecond late."""
    intake = Intake(Identity("bp", "alpha", "a1"), DEVICE)
    envelopes: list[Envelope] = []
    end_ns = START_NS
    for time_ns, frame in heapq.merge(*mavlink_frames(run(), START_NS), key=lambda item: item[0]):
        end_ns = time_ns + 1_000_000
        envelopes += intake.feed(frame, end_ns)
    envelopes += intake.cut(end_ns)
    return envelopes, intake.counters()


@pytest.fixture(scope="module")
def heard() -> list[Envelope]:
    envelopes, counts = read_back()
    bad = {name: count for name, count in counts.items() if count and name not in ("frames", "clock_resets")}
    assert bad == {}
    return envelopes


def test_samples_come_back_with_their_times(heard: list[Envelope]) -> None:
    for place, seed in (("left_foot", 1), ("right_foot", 2)):
        batches = [e.message for e in heard if e.address.source == place and isinstance(e.message, ImuBatch)]
        times = np.concatenate([batch.times for batch in batches])
        np.testing.assert_allclose((times - START_NS) / 1e9, TIME_S, atol=1e-6)
        sent = imu(seed)
        np.testing.assert_allclose(np.concatenate([b.accel for b in batches]), sent.accel_m_s2, rtol=1e-6)
        np.testing.assert_allclose(np.concatenate([b.gyro for b in batches]), sent.gyro_rad_s, rtol=1e-6)
        fields = [batch.mag for batch in batches]
        assert all(field is not None for field in fields)
        np.testing.assert_allclose(np.concatenate(fields), sent.mag_ut, rtol=1e-5)  # type: ignore[arg-type]


def test_fixes_come_back_and_none_is_made_up(heard: list[Envelope]) -> None:
    fixes = [e.message for e in heard if isinstance(e.message, GnssFix)]
    assert len(fixes) == SLOW_S.size
    assert fixes[3].fix_kind == "none"
    sent = gnss()
    for row in (0, 7):
        assert fixes[row].latitude_deg == pytest.approx(sent.lat_deg[row], abs=1e-7)
        assert fixes[row].height_m == pytest.approx(41.5)
        assert (fixes[row].horizontal_accuracy_m, fixes[row].vertical_accuracy_m) == pytest.approx((2.5, 4.0))
        assert fixes[row].satellites == 9
        assert fixes[row].speed_m_s is None
        assert fixes[row].course_rad == pytest.approx(np.deg2rad(10.0))


def test_pressure_comes_back(heard: list[Envelope]) -> None:
    pressures = [e.message.pressure_pa for e in heard if isinstance(e.message, Pressure)]
    np.testing.assert_allclose(pressures, np.linspace(100_000.0, 100_100.0, SLOW_S.size), atol=0.02)


def test_camera_motions_come_back_in_the_axes_at_their_start(heard: list[Envelope]) -> None:
    motions = [e.message for e in heard if isinstance(e.message, CameraMotion)]
    assert len(motions) == SLOW_S.size
    for motion in motions:
        assert motion.translation_m == pytest.approx((1.0, 0.25, -0.125), abs=1e-6)
        assert motion.rotation_rad == pytest.approx((0.0, 0.0, 0.5), abs=1e-6)
        assert motion.time_ns - motion.start_time_ns == 100_000_000


def fault(kind: str, sensor: str = "left_foot", for_s: float | None = 1.0) -> Fault:
    details: dict[str, object] = {"sensor": sensor}
    if for_s is not None:
        details["for_s"] = for_s
    return Fault(1.0, kind, "a1", details)


DURING = (TIME_S >= 1.0) & (TIME_S < 2.0)


def test_an_unplugged_sensor_sends_nothing_for_a_while() -> None:
    broken = with_faults(run(), [fault("sensor_unplugged")], "a1")
    np.testing.assert_array_equal(broken.imus["left_foot"].time_s, TIME_S[~DURING])
    np.testing.assert_array_equal(broken.imus["left_foot"].accel_m_s2, imu(1).accel_m_s2[~DURING])
    np.testing.assert_array_equal(broken.imus["right_foot"].time_s, TIME_S)


def test_a_frozen_sensor_repeats_its_last_value() -> None:
    broken = with_faults(run(), [fault("sensor_frozen")], "a1").imus["left_foot"]
    np.testing.assert_array_equal(broken.time_s, TIME_S)
    assert (broken.gyro_rad_s[DURING] == imu(1).gyro_rad_s[99]).all()
    np.testing.assert_array_equal(broken.gyro_rad_s[~DURING], imu(1).gyro_rad_s[~DURING])


def test_a_saturated_unit_sticks_at_the_ends_of_its_ranges() -> None:
    broken = with_faults(run(), [fault("sensor_saturated")], "a1").imus["left_foot"]
    assert set(np.abs(broken.accel_m_s2[DURING]).ravel()) == {160.0}
    np.testing.assert_array_equal(np.sign(broken.accel_m_s2), np.sign(imu(1).accel_m_s2))


def test_a_broken_sensor_without_an_end_stays_so_and_other_soldiers_are_well() -> None:
    walk = run()
    broken = with_faults(walk, [fault("sensor_nan", "gnss", None)], "a1").gnss
    assert broken is not None
    assert np.isnan(broken.lon_deg[SLOW_S >= 1.0]).all()
    assert np.isfinite(broken.lon_deg[SLOW_S < 1.0]).all()
    np.testing.assert_array_equal(broken.time_s, SLOW_S)
    assert with_faults(walk, [fault("sensor_nan")], "a2") is walk
    assert with_faults(walk, [fault("sensor_nan", "range")], "a1") is walk


def test_gateways_are_given_what_the_broken_sensors_measured(tmp_path: Path) -> None:
    walk = run()
    truth = Truth(np.arange(2.0), np.zeros((2, 3)))
    soldiers = tuple(Soldier(f"a{n}", n, "", walk, truth, {}, simulated=True) for n in (1, 2))
    exercise = with_files(Exercise(soldiers, faults=(fault("sensor_unplugged"),)), tmp_path)
    broken, well = (load_runs([soldier.run.path])[0] for soldier in exercise.soldiers)
    np.testing.assert_allclose(broken.imus["left_foot"].time_s, TIME_S[~DURING], atol=1e-6)
    np.testing.assert_allclose(well.imus["left_foot"].time_s, TIME_S, atol=1e-6)
    np.testing.assert_array_equal(exercise.soldiers[0].run.imus["left_foot"].time_s, TIME_S[~DURING])
    assert with_files(exercise, tmp_path / "again").soldiers == exercise.soldiers
    light = without_samples(exercise)
    assert light.duration_s == exercise.duration_s
    assert [list(soldier.run.imus) for soldier in light.soldiers] == [["left_foot", "right_foot"]] * 2
