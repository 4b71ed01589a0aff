"""Cameras as sources: a folder that is replayed, and a pair of devices, here files that OpenCV plays."""

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.clock import EventClock
from bootprint.config import convert
from bootprint.errors import ConfigError, RecordingError
from bootprint.messages import CameraMotion, ImuBatch
from bootprint.topics import Identity
from proving_ground.sensors import Mounting, write_camera_folder
from sensor_gateway.recordings.camera_folder import projections
from sensor_gateway.settings import CameraSource, GatewaySettings, ReplaySource, check
from sensor_gateway.sources.camera import CameraIntake, StereoReader
from sensor_gateway.sources.replay import open_recording
from sensor_gateway.stereo import StereoCalibration, StereoOdometry, Verdict
from support.camera_rooms import Swaying, room
from support.moving import Straight
from support.stereo_walks import SMALL

A1 = Identity("bp", "alpha", "a1")
S = 1_000_000_000
WALK = Swaying(Straight((-3.5, -1.0, 1.5), (1.3, 0.2, 0.0)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight pairs."""
    path = tmp_path_factory.mktemp("gateway") / "camera"
    return write_camera_folder(path, room(), SMALL, WALK, Mounting(), 0.75, np.random.default_rng(1))


def test_a_folder_is_played_as_motions_with_their_times(folder: Path) -> None:
    recording = open_recording(folder, ReplaySource(path=str(folder)), A1)
    envelopes = list(recording.messages(5 * S))
    assert {envelope.address.key for envelope in envelopes} == {"bp/@v1/alpha/a1/camera_motion/camera"}
    motions = [item.message for item in envelopes if isinstance(item.message, CameraMotion)]
    assert [motion.time_ns for motion in motions] == [5 * S + number * S // 10 for number in range(1, 8)]
    assert motions[0].start_time_ns == 5 * S
    assert motions[-1].sequence == 6
    assert recording.counts == {"verdict_starting": 1}


def test_a_folder_with_a_wrong_calibration_is_refused_when_it_is_opened(folder: Path, tmp_path: Path) -> None:
    import shutil

    spoilt = Path(shutil.copytree(folder, tmp_path / "spoilt"))
    lines = (spoilt / "calib.txt").read_text().replace("P0", "P2").replace("P1", "P0").replace("P2", "P1")
    (spoilt / "calib.txt").write_text(lines)
    with pytest.raises(RecordingError, match="right of the left"):
        open_recording(spoilt, ReplaySource(path=str(spoilt)), A1)


@dataclass
class TenthsClock:
    """Every question is asked a tenth of a second after the last."""

    now: int = 0

    def now_ns(self) -> int:
        self.now += S // 10
        return self.now


def read(
    source: CameraSource, folder: Path, heard: Sequence[Envelope] = ()
) -> tuple[StereoReader, CameraIntake, list[CameraMotion]]:
    """Until the devices have no more images."""
    stopping = threading.Event()
    motions: list[CameraMotion] = []
    intake = CameraIntake(A1, source.name)
    odometry = StereoOdometry(StereoCalibration.of_projections(*projections(folder / "calib.txt")))

    def on_told(told: CameraMotion | Verdict) -> None:
        motions.extend(item.message for item in intake.take(told) if isinstance(item.message, CameraMotion))

    def wait_stop(seconds: float) -> bool:
        if seconds > 0.0:  # it waits before it opens them again
            stopping.set()
        return stopping.is_set()

    clock: EventClock = TenthsClock()  # type: ignore[assignment]
    reader = StereoReader(source, odometry, clock, on_told, wait_stop)
    reader.hear(heard)
    reader.run()
    return reader, intake, motions


def test_two_devices_are_read_until_they_fail(folder: Path) -> None:
    sides = [str(folder / side / "%06d.png") for side in ("image_l", "image_r")]
    source = CameraSource(left=sides[0], right=sides[1], calibration="calib.txt")
    reader, intake, motions = read(source, folder)
    assert reader.counts["pairs"] == 8
    assert len(motions) == 7
    assert "gives no images" in reader.fault
    assert intake.counters() == {"verdict_starting": 1, "motions": 7}
    assert intake.silent(motions[-1].time_ns + S, 0) == []
    assert intake.silent(motions[-1].time_ns + 2 * S, 0) == ["camera_motion/camera is silent: first pair"]


def test_a_faster_camera_is_thinned(folder: Path) -> None:
    sides = [str(folder / side / "%06d.png") for side in ("image_l", "image_r")]
    source = CameraSource(left=sides[0], right=sides[1], calibration="calib.txt", rate_hz=5.0)
    reader, _, _ = read(source, folder)
    assert (reader.counts["pairs"], reader.counts["pairs_skipped"]) == (4, 4)


def test_devices_that_are_not_there_are_a_fault_and_not_an_end(folder: Path) -> None:
    source = CameraSource(left="/nowhere/1", right="/nowhere/2", calibration="calib.txt")
    reader, intake, motions = read(source, folder)
    assert motions == []
    assert reader.counts["openings"] == 1
    assert "nowhere" in reader.fault
    assert intake.silent(10 * S, 0) == ["camera_motion/camera is silent: no image yet"]


def test_a_pair_waits_for_the_samples_of_the_unit_beside_it(folder: Path) -> None:
    """Samples up to 0.45 s: pairs of later times wait, but no longer than three tenths of a second."""
    sides = [str(folder / side / "%06d.png") for side in ("image_l", "image_r")]
    source = CameraSource(left=sides[0], right=sides[1], calibration="calib.txt", imu="camera")
    still = np.tile([0.0, 0.0, 9.81], (45, 1))
    batch = ImuBatch.from_arrays(0, np.arange(1, 46) * S // 100, still, np.zeros((45, 3)))
    others = ImuBatch.from_arrays(0, np.arange(1, 46) * S, still, np.zeros((45, 3)))
    heard = [
        Envelope(A1.address("imu", place), message)
        for place, message in (("camera", batch), ("body", others))
    ]
    reader, _, _ = read(source, folder, heard)
    # Pairs at 0.1 to 0.8 s: four are felt; that of 0.5 s has waited for 0.3 s, no longer, when the last comes.
    assert reader.counts["pairs"] == 4


def test_a_camera_is_a_source_of_the_gateway() -> None:
    one = {"kind": "camera", "left": 0, "right": 2, "calibration": "calib.txt"}
    settings = convert({"sources": [one]}, GatewaySettings, where="[gateway]")
    check(settings, "[gateway]")
    twice = convert({"sources": [one, one]}, GatewaySettings, where="[gateway]")
    with pytest.raises(ConfigError, match="camera_motion camera more than once"):
        check(twice, "[gateway]")
