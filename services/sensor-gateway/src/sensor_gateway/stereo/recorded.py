"""Odometry over recorded pairs: what a camera folder holds, as the motions that a camera would have told."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from bootprint.bus import Envelope
from bootprint.errors import RecordingError
from bootprint.topics import Identity
from sensor_gateway.recordings.camera_folder import pairs
from sensor_gateway.recordings.run import StereoSeries
from sensor_gateway.sources.run_messages import CAMERA_SOURCE
from sensor_gateway.stereo.calibration import StereoCalibration
from sensor_gateway.stereo.health import Verdict
from sensor_gateway.stereo.odometry import StereoOdometry


def odometry_of(stereo: StereoSeries, path: Path) -> StereoOdometry:
    """Odometry for a recording's camera; RecordingError if its calibration is of no stereo pair."""
    try:
        calibration = StereoCalibration.of_projections(stereo.left_projection, stereo.right_projection)
    except ValueError as error:
        raise RecordingError(f"{path}: calibration: {error}") from error
    return StereoOdometry(calibration)


class CameraRecording:
    """A camera folder that is played: images are read and followed as their messages become due."""

    def __init__(self, stereo: StereoSeries, path: Path, identity: Identity) -> None:
        self.counts: Counter[str] = Counter()
        self._stereo, self._path = stereo, path
        self._address = identity.address("camera_motion", CAMERA_SOURCE)
        odometry_of(stereo, path)  # a calibration that is wrong is said at once

    def messages(self, start_ns: int) -> Iterator[Envelope]:
        """The motions, with the first pair at ``start_ns``; verdicts are counted."""
        odometry = odometry_of(self._stereo, self._path)
        for pair in pairs(self._stereo):
            told = odometry.feed(start_ns + round(pair.time_s * 1e9), pair.left, pair.right)
            if isinstance(told, Verdict):
                self.counts[f"verdict_{told.condition}"] += 1
            else:
                yield Envelope(self._address, told)
