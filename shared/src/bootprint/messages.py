"""Every message on the bus: msgspec structs, MessagePack maps on the wire, SI units in the field names.

Unknown is None, never a magic number. Arrays travel as little-endian bytes whose dtype and shape are fixed by
the field: ``*_time_ns`` is ``<i8 (n,)``, vectors are ``<f8 (n, 3)``. A new field is always optional; a breaking
change is a new version of the key space. Each struct checks itself when it is built *and* when it is decoded,
so what passes here is finite and of the right shape.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import Annotated, Literal

import msgspec
import numpy as np
import numpy.typing as npt

from bootprint import constraints

Float64Array = npt.NDArray[np.float64]
Int64Array = npt.NDArray[np.int64]

Latitude = Annotated[float, msgspec.Meta(ge=-90.0, le=90.0)]
Longitude = Annotated[float, msgspec.Meta(ge=-180.0, le=180.0)]
NonNegative = Annotated[float, msgspec.Meta(ge=0.0)]
Positive = Annotated[float, msgspec.Meta(gt=0.0)]
Percent = Annotated[float, msgspec.Meta(ge=0.0, le=100.0)]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
TimeNs = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1)]
Vector3 = tuple[float, float, float]
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=64)]

FixKind = Literal["none", "2d", "3d", "dgnss", "rtk_float", "rtk_fixed", "dead_reckoning"]
MotionClass = Literal["standing", "walking", "running", "stairs", "crawling", "unknown"]
Direction = Literal["forward", "left", "backward", "right"]
Mode = Literal["unplaced", "gnss", "boots", "body", "camera", "coasting", "lost"]
ObservationCode = Literal[
    "infantry",
    "vehicle",
    "armour",
    "artillery",
    "aircraft",
    "drone",
    "sniper",
    "ied",
    "mine",
    "obstacle",
    "casualty",
    "civilian",
    "rally_point",
    "landing_zone",
    "supply",
    "entrance",
    "building",
    "route",
    "friendly",
]
HARMLESS_CODES: frozenset[ObservationCode] = frozenset(
    (
        "casualty",
        "civilian",
        "rally_point",
        "landing_zone",
        "supply",
        "entrance",
        "building",
        "route",
        "friendly",
    )
)
"""Things observed that nobody means to shoot at."""
TrackState = Literal["fresh", "stale", "lost"]
ServiceState = Literal["starting", "ok", "degraded", "failed", "stopped"]


class Message(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """What all messages carry: the event's time (UTC ns, by the sensor's stamp) and a count per source."""

    time_ns: TimeNs
    sequence: Count = 0

    def __post_init__(self) -> None:
        constraints.check(self)


def _packed(values: npt.ArrayLike, dtype: str, columns: int | None) -> bytes:
    array = np.ascontiguousarray(values, dtype=dtype)
    if columns is not None and (array.ndim != 2 or array.shape[1] != columns):
        raise ValueError(f"expected shape (n, {columns}), got {array.shape}")
    return array.tobytes()


class ImuBatch(Message, frozen=True):
    """About ten consecutive samples of one inertial unit, in its own axes as mounted.

    ``time_ns`` is the first sample's time. Specific force in m/s², angular rate in rad/s, field in µT.
    """

    sample_time_ns: bytes
    accel_m_s2: bytes
    gyro_rad_s: bytes
    mag_ut: bytes | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        count, rest = divmod(len(self.sample_time_ns), 8)
        if rest or count == 0:
            raise ValueError(f"sample_time_ns has {len(self.sample_time_ns)} bytes, want a multiple of 8")
        for name in ("accel_m_s2", "gyro_rad_s", "mag_ut"):
            data: bytes | None = getattr(self, name)
            if data is None:
                continue
            if len(data) != count * 24:
                raise ValueError(f"{name} has {len(data)} bytes, want {count * 24} for {count} samples")
            if not np.isfinite(np.frombuffer(data, "<f8")).all():
                raise ValueError(f"{name} has values that are not finite")

    @classmethod
    def from_arrays(
        cls,
        sequence: int,
        sample_time_ns: npt.ArrayLike,
        accel_m_s2: npt.ArrayLike,
        gyro_rad_s: npt.ArrayLike,
        mag_ut: npt.ArrayLike | None = None,
    ) -> "ImuBatch":
        """Build from arrays (n,), (n, 3), (n, 3) and optionally (n, 3)."""
        times = np.ascontiguousarray(sample_time_ns, dtype="<i8")
        return cls(
            time_ns=int(times[0]),
            sequence=sequence,
            sample_time_ns=times.tobytes(),
            accel_m_s2=_packed(accel_m_s2, "<f8", 3),
            gyro_rad_s=_packed(gyro_rad_s, "<f8", 3),
            mag_ut=None if mag_ut is None else _packed(mag_ut, "<f8", 3),
        )

    @property
    def times(self) -> Int64Array:
        """Sample times, UTC ns, shape (n,), read-only."""
        return np.frombuffer(self.sample_time_ns, "<i8")

    @property
    def accel(self) -> Float64Array:
        """Specific force, m/s², shape (n, 3), read-only."""
        return np.frombuffer(self.accel_m_s2, "<f8").reshape(-1, 3)

    @property
    def gyro(self) -> Float64Array:
        """Angular rate, rad/s, shape (n, 3), read-only."""
        return np.frombuffer(self.gyro_rad_s, "<f8").reshape(-1, 3)

    @property
    def mag(self) -> Float64Array | None:
        """Magnetic field, µT, shape (n, 3), read-only, or None."""
        return None if self.mag_ut is None else np.frombuffer(self.mag_ut, "<f8").reshape(-1, 3)


class Pressure(Message, frozen=True):
    """Absolute air pressure."""

    pressure_pa: Annotated[float, msgspec.Meta(gt=0.0)]
    temperature_c: float | None = None


class GnssFix(Message, frozen=True):
    """One solution of a satellite receiver, accuracies in metres (one sigma), height above the ellipsoid."""

    fix_kind: FixKind
    latitude_deg: Latitude | None = None
    longitude_deg: Longitude | None = None
    height_m: float | None = None
    horizontal_accuracy_m: NonNegative | None = None
    vertical_accuracy_m: NonNegative | None = None
    satellites: Count | None = None
    hdop: NonNegative | None = None
    speed_m_s: NonNegative | None = None
    speed_accuracy_m_s: NonNegative | None = None
    course_rad: float | None = None


class CameraMotion(Message, frozen=True):
    """Motion of a camera between ``start_time_ns`` and ``time_ns``, in the camera body's axes at the start.

    Axes forward, left, up. A motion that starts where the one before it started replaces it (odometry tells what
    happened since its key frame); a gap between one's end and the next one's start is time that nobody saw.
    ``covariance`` is the upper triangle (21 numbers, row by row) of the 6x6 matrix of
    (translation m, rotation vector rad), None if unknown. ``up``: where up is at the start, in the same axes, if an
    inertial unit tells it. ``landmarks_m``: points seen at the start, in the same axes, well placed ones only; told
    once a start, for maps of rooms.
    """

    start_time_ns: TimeNs
    translation_m: Vector3
    rotation_rad: Vector3
    covariance: Annotated[tuple[float, ...], msgspec.Meta(min_length=21, max_length=21)] | None = None
    confidence_pct: Percent | None = None
    up: Vector3 | None = None
    landmarks_m: Annotated[tuple[Vector3, ...], msgspec.Meta(max_length=40)] | None = None


class Range(Message, frozen=True):
    """Measured distance to another unit (soldier id, ``soldier/left_foot``, beacon)."""

    peer: Name
    distance_m: NonNegative
    sigma_m: NonNegative | None = None


class FootStep(Message, frozen=True):
    """One stance of one foot: what happened since the stance before (``start_time_ns``).

    ``displacement_m`` is forward, left, up in the foot's heading at the *start* of the step, and
    ``heading_change_rad`` is counter-clockwise positive (a yaw). ``covariance`` is the upper triangle (10 numbers,
    row by row) of the 4x4 matrix of (forward m, left m, up m, heading rad). A stance that goes on is reported
    every half second as a step of (nearly) zero displacement with motion class "standing". Stairs and ladders are
    up or down by the sign of the displacement.

    ``direction`` is that of the displacement against where the toes point, None while that is not known.
    ``clearance_m`` is the largest height of the sensor above the line between the two stances, ``swing_s`` the time
    in which the foot moved, ``stance_s`` how long it had stood by ``time_ns``. ``landing_nis`` is the largest
    normalised innovation squared (3 components) of the stance's zero-velocity updates; ``quality_pct`` counts it
    together with ``stance_quality``, the detector's own.

    The covariance holds noise and what a foot's steps have in common: a scale error of ``common_scale_sigma`` of
    the displacement, a rise of ``common_slope_sigma`` of its horizontal length and a turn of
    ``common_turn_sigma_rad_s`` of the duration (1 σ). Over many steps the common part grows with their sum, not
    with its root.

    ``magnetic_azimuth_rad``: azimuth from *true* north of the axis that is "forward" at the step's end (not of the
    boot's toe: the axis is the sensor's, as mounted), as the magnetometer alone saw it in this stance. Only where
    the field could be trusted; errs alike over some metres and by what calibration left, and its sigma says so.
    """

    start_time_ns: TimeNs
    displacement_m: Vector3
    heading_change_rad: float
    covariance: Annotated[tuple[float, ...], msgspec.Meta(min_length=10, max_length=10)]
    motion: MotionClass = "unknown"
    stance_quality: Percent | None = None
    realigned: bool = False
    direction: Direction | None = None
    length_m: NonNegative | None = None
    horizontal_length_m: NonNegative | None = None
    clearance_m: NonNegative | None = None
    swing_s: NonNegative | None = None
    stance_s: NonNegative | None = None
    landing_nis: NonNegative | None = None
    quality_pct: Percent | None = None
    common_scale_sigma: NonNegative | None = None
    common_slope_sigma: NonNegative | None = None
    common_turn_sigma_rad_s: NonNegative | None = None
    magnetic_azimuth_rad: float | None = None
    magnetic_azimuth_sigma_rad: NonNegative | None = None


class FootPose(Message, frozen=True):
    """Where a foot is now, relative to its last FootStep (``step_sequence``), in that step's end heading."""

    step_sequence: Count
    displacement_m: Vector3
    heading_change_rad: float
    speed_m_s: NonNegative
    in_stance: bool


class BodyStep(Message, frozen=True):
    """One step seen by a body-worn unit (compass, gyro, barometer).

    ``azimuth_rad`` is where the step led, ``track_azimuth_rad`` the same in the track's own frame: by these, steps
    add up to a track of the right shape that may be turned as a whole. ``direction`` is how the feet went against
    where the body faces; ``class_pct`` is the probability of motion and direction. ``settled_…`` tells what the
    step that ended at that time, some steps earlier, was by all that followed. ``floor`` counts from where the walk
    began. Redundancy percentages say how much of the information is checked by other information;
    ``external_reliability_m`` what disturbances that nobody noticed may have done to the place since the last
    absolute fix. ``taught_scale`` and ``taught_turn_rad`` (clockwise) are what satellites have taught of the
    person's steps and of how the unit sits: length and azimuth hold them.
    """

    start_time_ns: TimeNs
    length_m: NonNegative
    length_sigma_m: NonNegative
    azimuth_rad: float
    azimuth_sigma_rad: NonNegative
    motion: MotionClass = "unknown"
    height_m: float | None = None
    compass_azimuth_rad: float | None = None
    gyro_azimuth_rad: float | None = None
    gnss_azimuth_rad: float | None = None
    azimuth_redundancy_pct: Percent | None = None
    direction: Direction | None = None
    class_pct: Percent | None = None
    height_sigma_m: NonNegative | None = None
    floor: int | None = None
    floor_pct: Percent | None = None
    planimetry_redundancy_pct: Percent | None = None
    altimetry_redundancy_pct: Percent | None = None
    external_reliability_m: NonNegative | None = None
    settled_time_ns: TimeNs | None = None
    settled_motion: MotionClass | None = None
    settled_direction: Direction | None = None
    track_azimuth_rad: float | None = None
    taught_scale: Positive = 1.0
    taught_turn_rad: float = 0.0


class Fix(Message, frozen=True):
    """A person says where a soldier is (known point, doorway), and perhaps which way they face."""

    latitude_deg: Latitude
    longitude_deg: Longitude
    height_m: float | None = None
    accuracy_m: NonNegative = 1.0
    azimuth_rad: float | None = None
    azimuth_sigma_rad: NonNegative | None = None


class Position(Message, frozen=True):
    """A soldier's position: WGS84 with ellipsoidal height, and local ENU around the realm's origin.

    ``covariance_m2`` is (ee, en, eu, nn, nu, uu). ``course_rad`` is the direction of motion, ``facing_rad`` the
    direction of the body; azimuths clockwise from true north.

    ``rejections`` tells of each source that is left out why: ``innovation`` (its newest value is too far off),
    ``diverged`` (a foot that contradicts the other and looks wrong by itself),
    ``spoofed`` (it has walked away from dead reckoning, and is not believed until it is back), ``contradicted`` (a
    peer whose range and place do not fit the other peers'). ``protection_m``:
    the horizontal error stays within with 95 %, even if a disturbance of the size that no check would notice has
    moved the position by ``external_reliability_m`` (METHODS A9).
    """

    mode: Mode
    latitude_deg: Latitude
    longitude_deg: Longitude
    height_m: float
    east_m: float
    north_m: float
    up_m: float
    covariance_m2: tuple[float, float, float, float, float, float]
    velocity_m_s: Vector3 = (0.0, 0.0, 0.0)
    speed_m_s: NonNegative = 0.0
    course_rad: float | None = None
    course_sigma_rad: NonNegative | None = None
    facing_rad: float | None = None
    facing_sigma_rad: NonNegative | None = None
    floor: int | None = None
    motion: MotionClass = "unknown"
    sources: tuple[str, ...] = ()
    rejected: tuple[str, ...] = ()
    reliability_pct: Percent | None = None
    rejections: dict[str, str] = {}
    protection_m: NonNegative | None = None
    external_reliability_m: NonNegative | None = None


class Track(Message, frozen=True):
    """A hub's knowledge of one soldier; ``time_ns`` is the time of the position, not of its arrival.

    ``held_m`` and ``held_s``: how well (one sigma), up to which age, reports of late have kept the prediction of
    this net's soldiers right; what that means for the doubt at an age, `bootprint.display` tells.
    ``facing_rad``: of the body, clockwise from true north; over narrow radios it is known of some who stand.
    """

    soldier: Name
    number: Annotated[int, msgspec.Meta(ge=0, le=1023)]
    state: TrackState
    latitude_deg: Latitude
    longitude_deg: Longitude
    height_m: float | None
    accuracy_m: NonNegative
    east_velocity_m_s: float = 0.0
    north_velocity_m_s: float = 0.0
    mode: Mode = "boots"
    floor: int | None = None
    callsign: str | None = None
    received_ns: TimeNs | None = None
    via: Name = "own"
    hops: Count = 0
    held_m: NonNegative | None = None
    held_s: NonNegative | None = None
    facing_rad: float | None = None


class LinkReport(Message, frozen=True):
    """What one radio link carried; bits of the air, the link's header bytes included, in event time.

    ``drops``: what was refused, by cause. ``airtime_share``: of the last hour. ``duty_left_s``: airtime that a duty
    cycle still allows in this hour; None without one. ``frames_waiting``: 1 while one waits for its bits or modem.
    By soldier: ``ages_s``, how old the net's newest report is, and ``expected_errors_m``, how far off receivers are
    believed to show them now (None: some of them do not know the soldier).
    """

    link: Name
    budget_bits_per_s: NonNegative
    bits_per_s: NonNegative
    frames_sent: Count
    frames_received: Count
    frames_rejected: Count
    frames_lost: Count
    bytes_sent: Count
    bytes_received: Count
    drops: dict[str, Count] = {}
    airtime_share: NonNegative | None = None
    duty_left_s: NonNegative | None = None
    frames_waiting: Count | None = None
    ages_s: dict[str, float] = {}
    expected_errors_m: dict[str, NonNegative | None] = {}


class Alert(Message, frozen=True):
    """Something the squad must see now."""

    soldier: Name
    kind: Literal["contact", "casualty", "help", "fire", "withdraw", "other"]
    text: Annotated[str, msgspec.Meta(max_length=200)] = ""


class Observation(Message, frozen=True):
    """A thing seen, with its place: what it is by a code, or by the text, or both."""

    soldier: Name
    latitude_deg: Latitude
    longitude_deg: Longitude
    accuracy_m: NonNegative
    text: Annotated[str, msgspec.Meta(max_length=200)] = ""
    code: ObservationCode | None = None


class Status(Message, frozen=True):
    """How a soldier is."""

    soldier: Name
    condition: Literal["ok", "busy", "wounded", "out"] = "ok"
    battery_pct: Percent | None = None


class Health(Message, frozen=True):
    """How a process is: its state, counts since start (faults included) and gauges."""

    service: Name
    state: ServiceState
    counters: dict[str, int] = {}
    gauges: dict[str, float] = {}
    note: str = ""


@cache
def _triangle(size: int) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Rows and columns of an upper triangle; kept, for making them costs more than using them."""
    rows, columns = np.triu_indices(size)
    return rows, columns


def upper_triangle(matrix: npt.ArrayLike) -> tuple[float, ...]:
    """The upper triangle of a symmetric matrix (n, n), row by row, as a tuple of n(n+1)/2 floats."""
    square = np.asarray(matrix, dtype=np.float64)
    rows, columns = _triangle(square.shape[0])
    return tuple(square[rows, columns].tolist())


def symmetric(triangle: Sequence[float]) -> Float64Array:
    """The symmetric matrix (n, n) whose upper triangle, row by row, is given (inverse of `upper_triangle`)."""
    size = int((math.isqrt(8 * len(triangle) + 1) - 1) // 2)
    if size * (size + 1) // 2 != len(triangle):
        raise ValueError(f"{len(triangle)} numbers are no triangle of a square matrix")
    matrix = np.zeros((size, size))
    rows, columns = _triangle(size)
    matrix[rows, columns] = triangle
    matrix[columns, rows] = triangle
    return matrix
