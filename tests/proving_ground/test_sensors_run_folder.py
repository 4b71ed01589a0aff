"""What is measured goes into a run folder, comes out of the gateway's reader the same, and travels as messages."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from bootprint.config import Origin
from bootprint.errors import RecordingError
from bootprint.geomagnetism import earth_field
from bootprint.messages import CameraMotion, GnssFix, ImuBatch, Message, Pressure, Range, symmetric
from bootprint.recording import Recorder
from bootprint.topics import Identity
from proving_ground.sensors import (
    BAROMETER_CLASSES,
    GNSS_CLASSES,
    IMU_CLASSES,
    RANGE_CLASSES,
    Air,
    GnssConditions,
    Magnetics,
    Mounting,
    OdometryQuality,
    Peer,
    Ranging,
    measure_camera,
    measure_gnss,
    measure_imu,
    measure_pressure,
    measure_ranges,
    write_run_folder,
)
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import CameraSeries, ImuSeries, RangeSeries, Run, Truth
from sensor_gateway.sources.run_messages import run_messages
from support.camera_rooms import CAMERA, WALKING, room
from support.moving import Straight

ORIGIN = Origin(latitude_deg=59.0, longitude_deg=18.0, height_m=20.0)
UTC_NS = 1_780_000_000_000_000_000
B1 = Identity("bp", "bravo", "b1")
DURATION_S = 40.0


@pytest.fixture(scope="module")
def run() -> Run:
    """Somebody with every sensor there is, for forty seconds."""
    rng, at = np.random.default_rng(1), Mounting()
    field = Magnetics(earth_field(ORIGIN, UTC_NS))
    time_s = np.arange(0.0, DURATION_S, 0.1)
    peers = Ranging((Peer("b2", Straight((3.0, 0.0, 1.0))), Peer("b1/left_foot", Straight((0.0, 0.0, 0.1)))))
    return Run(
        name="everything",
        kind="dual",
        path=Path("everything"),
        imus={
            place: measure_imu(WALKING, DURATION_S, at, IMU_CLASSES[quality], field, rng)
            for place, quality in (
                ("left_foot", "industrial"),
                ("right_foot", "tactical"),
                ("body", "consumer"),
            )
        },
        truth={"left_foot": Truth(time_s, np.zeros((400, 3))), "body": Truth(time_s, WALKING.at(time_s)[0])},
        pressure=measure_pressure(WALKING, DURATION_S, at, BAROMETER_CLASSES["consumer"], Air(), rng),
        gnss=measure_gnss(WALKING, DURATION_S, at, GNSS_CLASSES["honest"], GnssConditions(), ORIGIN, rng),
        camera=measure_camera(WALKING, 4.0, at, CAMERA, OdometryQuality(), room(), rng),
        ranges=measure_ranges(WALKING, DURATION_S, at, RANGE_CLASSES["soldiers"], peers, rng),
        origin=(59.0, 18.0, 20.0),
        source="simulated",
    )


@pytest.fixture(scope="module")
def read(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = write_run_folder(run, tmp_path_factory.mktemp("runs") / "everything")
    (found,) = load_runs([folder])
    return found


def known(value: object) -> np.ndarray:
    assert isinstance(value, np.ndarray)
    return value


@pytest.mark.parametrize("place", ["left_foot", "right_foot", "body"])
def test_inertial_units_and_their_magnetometers_come_back(run: Run, read: Run, place: str) -> None:
    wrote, found = run.imus[place], read.imus[place]
    np.testing.assert_allclose(found.time_s, wrote.time_s, atol=6e-7)
    np.testing.assert_allclose(found.accel_m_s2, wrote.accel_m_s2, atol=6e-6)
    np.testing.assert_allclose(found.gyro_rad_s, wrote.gyro_rad_s, atol=6e-7)
    np.testing.assert_allclose(known(found.mag_ut), known(wrote.mag_ut), atol=6e-4)


@pytest.mark.parametrize(("sensor", "atol"), [("pressure", 6e-4), ("gnss", 1e-6), ("camera", 1e-5)])
def test_the_other_series_come_back(run: Run, read: Run, sensor: str, atol: float) -> None:
    wrote, found = getattr(run, sensor), getattr(read, sensor)
    for name in wrote.__dataclass_fields__:
        expected = known(getattr(wrote, name))
        np.testing.assert_allclose(known(getattr(found, name)), expected, atol=atol, rtol=1e-5)


def test_ranges_come_back_with_their_peers(run: Run, read: Run) -> None:
    assert run.ranges is not None
    assert read.ranges is not None
    assert read.ranges.peer == run.ranges.peer
    assert set(read.ranges.peer) == {"b2", "b1/left_foot"}
    np.testing.assert_allclose(read.ranges.distance_m, run.ranges.distance_m, rtol=1e-9)
    np.testing.assert_allclose(read.ranges.sigma_m, 0.1)


def test_the_person_s_truth_is_kept_and_the_notes(run: Run, read: Run) -> None:
    assert (read.name, read.kind, read.origin, read.source) == ("everything", "dual", run.origin, "simulated")
    np.testing.assert_allclose(read.truth["body"].position_m, run.truth["body"].position_m, atol=6e-5)


def test_every_sensor_speaks_in_order_of_time(read: Run) -> None:
    envelopes = list(run_messages(read, B1, UTC_NS))
    subjects = Counter(f"{e.address.subject}/{e.address.source}" for e in envelopes)
    assert set(subjects) == {
        *("imu/left_foot", "imu/right_foot", "imu/body"),
        *("pressure/body", "gnss/gnss", "camera_motion/camera", "range/uwb"),
    }
    assert subjects["pressure/body"] == 400
    assert subjects["gnss/gnss"] == 40
    messages = [envelope.message for envelope in envelopes]
    assert all(batch.mag is not None for batch in messages if isinstance(batch, ImuBatch))
    assert all(95_000 < one.pressure_pa < 105_000 for one in messages if isinstance(one, Pressure))
    kinds = [fix.fix_kind for fix in messages if isinstance(fix, GnssFix)]
    assert kinds == ["none"] * 30 + ["3d"] * 10


def test_camera_motions_carry_their_doubt(run: Run, read: Run) -> None:
    camera = run.camera
    assert camera is not None
    motions = [e.message for e in run_messages(read, B1, UTC_NS) if isinstance(e.message, CameraMotion)]
    assert len(motions) == len(camera.time_s)
    covariance = symmetric(motions[3].covariance or ())
    sigmas = [known(camera.translation_sigma_m)[3]] * 3 + [known(camera.rotation_sigma_rad)[3]] * 3
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), sigmas, rtol=1e-4)
    assert motions[3].confidence_pct == pytest.approx(known(camera.confidence_pct)[3], rel=1e-4)


def test_a_recording_of_the_bus_gives_the_same_back(run: Run, read: Run, tmp_path: Path) -> None:
    with Recorder(tmp_path / "bus.mcap") as recorder:
        for envelope in run_messages(read, B1, UTC_NS):
            recorder.write(envelope)
    (found,) = load_runs([tmp_path / "bus.mcap"])
    assert found.ranges is not None
    assert read.ranges is not None
    assert found.ranges.peer == read.ranges.peer
    np.testing.assert_allclose(found.ranges.distance_m, read.ranges.distance_m)
    assert found.camera is not None
    for name in found.camera.__dataclass_fields__:
        expected = known(getattr(read.camera, name))
        # The run's zero is its first inertial stamp, up to a millisecond beside the folder's.
        np.testing.assert_allclose(
            known(getattr(found.camera, name)), expected, rtol=1e-6, atol=2e-3 * ("time" in name)
        )


def ranges_of(time_s: list[float], distance_m: list[float]) -> list[Message]:
    peers = tuple(f"p{number}" for number in range(len(time_s)))
    series = RangeSeries(np.array(time_s), peers, np.array(distance_m), np.full(len(time_s), np.nan))
    run = Run("r", "foot", Path("r"), imus={}, ranges=series)
    return [envelope.message for envelope in run_messages(run, B1, 0)]


def test_ranges_at_the_same_time_all_travel_and_broken_ones_do_not() -> None:
    messages = ranges_of([1.0, 1.0, 0.5, 2.0, np.nan, 3.0], [4.0, 5.0, 6.0, np.nan, 7.0, -1.0])
    assert messages == [
        Range(time_ns=500_000_000, sequence=0, peer="p2", distance_m=6.0),
        Range(time_ns=1_000_000_000, sequence=1, peer="p0", distance_m=4.0),
        Range(time_ns=1_000_000_000, sequence=2, peer="p1", distance_m=5.0),
    ]


def test_camera_motions_without_known_sigmas_claim_none(tmp_path: Path) -> None:
    vectors, times = np.ones((1, 3)), np.ones(1)
    camera = CameraSeries(np.zeros(1), times, vectors, vectors, times * np.nan, times)
    write_run_folder(Run("c", "camera", Path("c"), imus={}, camera=camera), tmp_path / "c")
    (found,) = load_runs([tmp_path / "c"])
    (message,) = [envelope.message for envelope in run_messages(found, B1, 0)]
    assert isinstance(message, CameraMotion)
    assert (message.covariance, message.confidence_pct) == (None, None)


def test_a_sensor_that_never_spoke_gets_no_file(tmp_path: Path) -> None:
    nothing = np.zeros(0)
    imu = ImuSeries(np.array([0.0, 1.0]), np.zeros((2, 3)), np.zeros((2, 3)))
    silent = RangeSeries(nothing, (), nothing, nothing)
    write_run_folder(Run("s", "body", Path("s"), {"body": imu}, ranges=silent), tmp_path / "s")
    (found,) = load_runs([tmp_path / "s"])
    assert found.ranges is None


def test_a_walk_without_heights_is_written_without_heights(tmp_path: Path) -> None:
    flat = Truth(np.array([0.0, 1.0]), np.array([[0.0, 0.0, np.nan], [1.0, 2.0, np.nan]]))
    imu = ImuSeries(np.array([0.0, 1.0]), np.zeros((2, 3)), np.zeros((2, 3)))
    write_run_folder(Run("f", "foot", Path("f"), {"left_foot": imu}, {"left_foot": flat}), tmp_path / "f")
    (found,) = load_runs([tmp_path / "f"])
    assert not found.truth["body"].has_height
    np.testing.assert_allclose(found.truth["body"].position_m[1, :2], [1.0, 2.0])


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ("time_s,distance_m\n0,1\n", "column peer is missing"),
        ("time_s,peer,distance_m,smell\n0,b2,1,2\n", "unknown column 'smell'"),
        ("time_s,peer,distance_m\n0,b2,1\n1,b2,far\n", "line 3: could not convert"),
        ("time_s,peer,distance_m\n0,,1\n", "line 2: want a peer"),
        ("time_s,peer,distance_m\n0,b2,1,4\n", "line 2: want a peer"),
        ("time_s,peer,distance_m\n0,b2\n", "line 2: want"),
        ("time_s,peer,distance_m\n", "no data"),
    ],
)
def test_damaged_ranges_are_told_in_one_line(tmp_path: Path, content: str, complaint: str) -> None:
    (tmp_path / "ranges.csv").write_text(content)
    with pytest.raises(RecordingError, match=complaint) as caught:
        load_runs([tmp_path])
    assert str(tmp_path / "ranges.csv") in str(caught.value)
    assert "\n" not in str(caught.value)
