"""What every recorded data set becomes: a `Run` of sensor series and, where it exists, truth.

Readers (one module a format) translate units, axes and handedness; beyond this model nobody knows where a run
came from. Times are seconds from the run's own zero.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Kind = Literal["foot", "dual", "body", "camera"]
FEET = ("left_foot", "right_foot")


@dataclass(frozen=True, slots=True)
class ImuSeries:
    """One inertial unit: ``time_s`` (n,), ``accel_m_s2``, ``gyro_rad_s`` and, if known, ``mag_ut`` (n, 3)."""

    time_s: FloatArray
    accel_m_s2: FloatArray
    gyro_rad_s: FloatArray
    mag_ut: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Truth:
    """A reference track: ``time_s`` (k,), ``position_m`` (k, 3) right-handed, z up (NaN where unknown).

    ``at_stances``: truth and sensor are different points of the foot, so compare only while the foot stands.
    ``strides``: how many strides the walk has, where the source counted them. ``floor`` (k,): by number, NaN where
    unknown.
    """

    time_s: FloatArray
    position_m: FloatArray
    at_stances: bool = False
    strides: int | None = None
    floor: FloatArray | None = None

    @property
    def has_height(self) -> bool:
        """Whether the track knows heights."""
        return bool(np.isfinite(self.position_m[:, 2]).all())


@dataclass(frozen=True, slots=True)
class PressureSeries:
    """Air pressure: ``time_s`` (n,), ``pressure_pa`` (n,)."""

    time_s: FloatArray
    pressure_pa: FloatArray


@dataclass(frozen=True, slots=True)
class GnssSeries:
    """Satellite fixes, every column (n,), NaN where unknown; heights above the ellipsoid."""

    time_s: FloatArray
    lat_deg: FloatArray
    lon_deg: FloatArray
    alt_m: FloatArray
    h_acc_m: FloatArray
    v_acc_m: FloatArray
    satellites: FloatArray
    speed_m_s: FloatArray
    course_deg: FloatArray


@dataclass(frozen=True, slots=True)
class CameraSeries:
    """Camera motions: start and end (n,) s, translation m and rotation vector rad (n, 3), as in CameraMotion.

    ``translation_sigma_m`` and ``rotation_sigma_rad`` (n,), of every axis, and ``confidence_pct`` (n,) if known.
    """

    start_time_s: FloatArray
    time_s: FloatArray
    translation_m: FloatArray
    rotation_rad: FloatArray
    translation_sigma_m: FloatArray | None = None
    rotation_sigma_rad: FloatArray | None = None
    confidence_pct: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class StereoSeries:
    """Rectified stereo pairs as files: ``time_s`` (n,), paths, projection matrices (3, 4).

    ``attitude`` (3, 3): of the camera's body (forward, left, up) in the run's frame at the start.
    """

    time_s: FloatArray
    left: tuple[Path, ...]
    right: tuple[Path, ...]
    left_projection: FloatArray
    right_projection: FloatArray
    attitude: FloatArray


@dataclass(frozen=True, slots=True)
class RangeSeries:
    """Ranges: ``time_s`` (n,), the ``peer`` of each, ``distance_m`` and ``sigma_m`` (n,), NaN if unknown."""

    time_s: FloatArray
    peer: tuple[str, ...]
    distance_m: FloatArray
    sigma_m: FloatArray


@dataclass(frozen=True, slots=True)
class Run:
    """One recording. ``imus`` and ``truth`` are keyed by place: left_foot, right_foot, body.

    ``origin`` is (latitude deg, longitude deg, ellipsoidal height m) of the truth's zero, ``source`` who recorded
    it and under which licence.
    """

    name: str
    kind: Kind
    path: Path
    imus: dict[str, ImuSeries]
    truth: dict[str, Truth] = field(default_factory=dict)
    pressure: PressureSeries | None = None
    gnss: GnssSeries | None = None
    camera: CameraSeries | None = None
    ranges: RangeSeries | None = None
    stereo: StereoSeries | None = None
    origin: tuple[float, float, float] | None = None
    source: str = ""

    @staticmethod
    def worn(
        path: Path,
        imu: ImuSeries,
        source: str,
        truth: Truth | None = None,
        pressure: PressureSeries | None = None,
        gnss: GnssSeries | None = None,
    ) -> "Run":
        """A walk with one unit on the body, named as its file or folder."""
        name = path.stem if path.is_file() else path.resolve().name
        known = {} if truth is None else {"body": truth}
        return Run(name, "body", path, {"body": imu}, known, pressure, gnss, source=source)

    @property
    def duration_s(self) -> float:
        """From the first inertial sample (of a camera: pair, or motion) to the last."""
        starts = [imu.time_s[0] for imu in self.imus.values()]
        ends = [imu.time_s[-1] for imu in self.imus.values()]
        if not starts and self.stereo is not None:
            starts, ends = [self.stereo.time_s[0]], [self.stereo.time_s[-1]]
        if not starts and self.camera is not None and len(self.camera.time_s):
            starts, ends = [self.camera.start_time_s[0]], [self.camera.time_s[-1]]
        return float(max(ends) - min(starts)) if starts else 0.0

    def offers(self, kind: Kind) -> bool:
        """Whether an estimator of this kind finds its sensors here (a dual run offers both single feet too)."""
        feet = sum(place in self.imus for place in FEET)
        wanted = {
            "foot": feet > 0,
            "dual": feet == 2,
            "body": "body" in self.imus,
            "camera": self.camera is not None or self.stereo is not None,
        }
        return wanted[kind]

    def truth_of(self, place: str) -> Truth | None:
        """The truth of a place; of the body between two feet, or of a foot where only the person's is known."""
        if place in self.truth:
            return self.truth[place]
        if place == "body":
            return self._midway()
        return self.truth.get("body")

    def _midway(self) -> Truth | None:
        left, right = (self.truth.get(place) for place in FEET)
        if left is None or right is None or not np.array_equal(left.time_s, right.time_s):
            return None
        middle = (left.position_m + right.position_m) / 2.0
        return Truth(left.time_s, middle, at_stances=left.at_stances or right.at_stances)
