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


@dataclass(frozen=True, slots=True)
class ImuSeries:
    """One inertial unit: ``time_s`` (n,), ``accel_m_s2`` (n, 3), ``gyro_rad_s`` (n, 3), ``mag_ut`` (n, 3) or None."""

    time_s: FloatArray
    accel_m_s2: FloatArray
    gyro_rad_s: FloatArray
    mag_ut: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Truth:
    """A reference track: ``time_s`` (k,), ``position_m`` (k, 3) right-handed, z up (NaN where unknown).

    ``at_stances``: truth and sensor are different points of the foot, so compare only while the foot stands.
    """

    time_s: FloatArray
    position_m: FloatArray
    at_stances: bool = False

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
    """Camera motions: start and end ``(n,)`` s, translation (n, 3) m, rotation vector (n, 3) rad (axes of CameraMotion)."""

    start_time_s: FloatArray
    time_s: FloatArray
    translation_m: FloatArray
    rotation_rad: FloatArray


@dataclass(frozen=True, slots=True)
class Run:
    """One recording. ``imus`` and ``truth`` are keyed by place: left_foot, right_foot, body."""

    name: str
    kind: Kind
    path: Path
    imus: dict[str, ImuSeries]
    truth: dict[str, Truth] = field(default_factory=dict)
    pressure: PressureSeries | None = None
    gnss: GnssSeries | None = None
    camera: CameraSeries | None = None
    origin: tuple[float, float, float] | None = None
    source: str = ""

    @property
    def duration_s(self) -> float:
        """From the first inertial sample to the last."""
        starts = [imu.time_s[0] for imu in self.imus.values()]
        ends = [imu.time_s[-1] for imu in self.imus.values()]
        return float(max(ends) - min(starts)) if starts else 0.0
