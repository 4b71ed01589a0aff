"""The navigator of one body-worn unit: samples in, steps with length, azimuth, class and height out.

A sample's way: `intake` (usable?) → `attitude` (level, turned) → `grid` (50 Hz) → `footfalls` (steps) → `strides`
(cut out) → `gait`. A step's: `heights` (climb), `feet` (class, direction), `ahead` and `bearings` (azimuth),
`step_length`, `retrace` → `BodyStepEstimate`.
"""

import math
from itertools import repeat

from bootprint.geomagnetism import EarthField
from bootprint.messages import Direction, Float64Array, Int64Array, MotionClass
from pdr_engine.body.altitude.heights import Height, Heights
from pdr_engine.body.altitude.stairways import Stairways
from pdr_engine.body.azimuth.ahead import Ahead
from pdr_engine.body.azimuth.bearings import Bearing, Bearings
from pdr_engine.body.azimuth.deviation import Deviation
from pdr_engine.body.azimuth.misalignment import Misalignment
from pdr_engine.body.estimate import BodyStepEstimate
from pdr_engine.body.length.personal import PRIOR_SIGMA, Person, PersonalScale
from pdr_engine.body.length.step_length import StepLengths, projected
from pdr_engine.body.movement.classes import Movement
from pdr_engine.body.movement.feet import Feet
from pdr_engine.body.movement.posture import Posture
from pdr_engine.body.pieces import Stride
from pdr_engine.body.settings import BodySettings
from pdr_engine.body.steps.attitude import Attitude, Rows, rotated
from pdr_engine.body.steps.footfalls import Footfalls
from pdr_engine.body.steps.grid import CELL_S, Cell, Grid
from pdr_engine.body.steps.intake import Intake, Sample, Vector
from pdr_engine.body.steps.strides import WIDTH, Cut, Strides
from pdr_engine.body.track.cross_check import CrossCheck
from pdr_engine.body.track.honesty import Honesty
from pdr_engine.body.track.reliability import Reliance
from pdr_engine.body.track.retrace import Retrace

STANDARD_GRAVITY_M_S2 = 9.80665
_GRAVITY_S = 10.0  # how slowly the mean vertical force is followed: scale errors, not motion
_NAN3 = (math.nan, math.nan, math.nan)


class BodyNavigator:
    """Dead reckoning of one person by a unit on trunk or in hand, step by step.

    Steps come about 0.2 s after their end, those that begin a bout when the third has made it one. Results do not
    depend on how the samples are cut into batches.
    """

    def __init__(self, settings: BodySettings | None = None) -> None:
        self.settings = settings or BodySettings()
        length = self.settings.length
        self._intake = Intake()
        self._attitude = Attitude(self.settings.attitude)
        self._ahead = Ahead(self.settings.forward, self.settings.misalignment_rad)
        self._grid = Grid(WIDTH)
        self._strides = Strides(self.settings.heading.denoising)
        self._footfalls = Footfalls(self.settings.steps, self._strides)
        self._bearings = Bearings(self.settings)
        self._heights = Heights(self.settings.altitude)
        self._stairways = Stairways()
        self._posture, self._feet = Posture(), Feet()
        self._lengths = StepLengths(self.settings.step_length, length)
        self._personal = PersonalScale(
            length.scale, length.common_sigma_share, self._lengths.refined(length.refinement)
        )
        self._misalignment = Misalignment()
        self._honesty = Honesty()
        self._retrace = Retrace() if self.settings.retrace else None
        self._reliance = Reliance(calibrated=length.common_sigma_share < PRIOR_SIGMA)
        self._cross_check = CrossCheck()
        self._pressure_pa: float | None = None
        self._gravity_m_s2 = STANDARD_GRAVITY_M_S2
        self._yaw_rad = 0.0
        self._steps = self._still_steps = 0

    def process(
        self,
        time_ns: Int64Array,
        accel: Float64Array,
        gyro: Float64Array,
        mag: Float64Array | None = None,
    ) -> list[BodyStepEstimate]:
        """Take a batch of any size: ``time_ns`` (n,) UTC, ``accel`` (n, 3) m/s², ``gyro`` (n, 3) rad/s.

        ``mag`` (n, 3) µT, in the axes of the other two. The steps that became known.
        """
        fields = repeat(None) if mag is None else map(tuple, mag.tolist())
        rows = zip(time_ns.tolist(), accel.tolist(), gyro.tolist(), fields, strict=False)
        found: list[BodyStepEstimate] = []
        for stamp, force, rate, field in rows:
            sample = self._intake.judge(stamp, tuple(force), tuple(rate), field)
            if sample is not None:
                found.extend(self._take(sample))
        return found

    def know_earth_field(self, field: EarthField) -> None:
        """What the field should be here."""
        self._bearings.know_earth_field(field)

    def hear_pressure(self, time_ns: int, pressure_pa: float) -> None:
        """A sample of the air pressure, in order of time."""
        self._pressure_pa = pressure_pa
        self._heights.pressure(time_ns, pressure_pa)

    def hear_fix(self, time_ns: int, east_m: float, north_m: float, accuracy_m: float) -> None:
        """A satellite fix in a local frame of magnetic north: good ones tell step length and misalignment."""
        stretches = self._personal.stretches
        accuracy_m = self._honesty.accuracy(time_ns, east_m, north_m, accuracy_m)
        self._personal.fix(time_ns, east_m, north_m, accuracy_m)
        self._misalignment.fix(time_ns, east_m, north_m, accuracy_m)
        self._reliance.fix(time_ns, accuracy_m)
        if self._bearings.repeated is not None:
            self._bearings.repeated.fix(east_m, north_m, accuracy_m)
        if self._personal.stretches > stretches:
            self._reliance.calibrated()

    def hear_height(self, time_ns: int, height_m: float, sigma_m: float) -> None:
        """A height from satellites or of a known place; those of steps are above the same zero from then on."""
        self._heights.reference(time_ns, height_m, sigma_m)

    @property
    def person(self) -> Person:
        """What is known of the person's step length, to be begun with the next time."""
        return self._personal.person

    @property
    def deviations(self) -> tuple[Deviation, ...]:
        """What is known of the compass by place, to be begun with the next time."""
        return () if self._bearings.repeated is None else tuple(self._bearings.repeated.cells())

    @property
    def knows_person(self) -> bool:
        """Whether fixes have told anything of the person's step length."""
        return self._personal.stretches > 0

    def counters(self) -> dict[str, int]:
        """Counts since the start."""
        refused = self._footfalls.refused + self._still_steps
        rejected = {f"{name}_azimuths_rejected": count for name, count in self._cross_check.rejected.items()}
        return {**self._intake.counters, "false_steps": refused, "body_steps": self._steps, **rejected}

    @property
    def gyro_bias_rad_s(self) -> Vector:
        """The gyro bias as it is known now, device axes."""
        return self._attitude.bias_rad_s

    @property
    def ahead_rad(self) -> float:
        """The walking direction as it is known now, counter-clockwise of the unit's reference axis."""
        return self._ahead.angle_rad

    def _take(self, sample: Sample) -> list[BodyStepEstimate]:
        rows = self._attitude.follow(sample)
        if sample.breaks:
            self._break()
        found: list[BodyStepEstimate] = []
        for cell in self._grid.add(sample.time_ns, self._level(sample, rows)):
            self._strides.add(cell)
            self._heights.accelerate(cell.time_ns, cell.values[2])
            vertical = self._free_of_gravity(cell)
            for start_ns, end_ns in self._footfalls.take(cell.time_ns, vertical):
                found.extend(self._step(start_ns, end_ns))
        return found

    def _break(self) -> None:
        self._grid.restart()
        self._footfalls.restart()
        self._strides.restart()
        self._bearings.lose()

    def _level(self, sample: Sample, rows: Rows) -> tuple[float, ...]:
        """Force, rate and field in the nav frame, and the yaw of the reference axis, unwrapped."""
        x, y = self._ahead.reference(rows)
        self._yaw_rad += math.remainder(math.atan2(y, x) - self._yaw_rad, math.tau)
        bx, by, bz = self._attitude.bias_rad_s
        p, q, r = sample.gyro_rad_s
        field = _NAN3 if sample.field_ut is None else self._bearings.compass.level(rows, sample.field_ut)
        rate = rotated(rows, (p - bx, q - by, r - bz))
        return (*rotated(rows, sample.accel_m_s2), *rate, *field, self._yaw_rad)

    def _free_of_gravity(self, cell: Cell) -> float:
        vertical = cell.values[2]
        self._gravity_m_s2 += (vertical - self._gravity_m_s2) * CELL_S / _GRAVITY_S
        return vertical - self._gravity_m_s2

    def _step(self, start_ns: int, end_ns: int) -> list[BodyStepEstimate]:
        """Judge a step; none if too little of it is at hand, or nothing moves."""
        cut = self._strides.cut(start_ns, end_ns)
        if cut is None:
            return []
        stride = cut.stride(self._ahead.angle_rad, self._gravity_m_s2, self._pressure_pa)
        height = self._heights.step(end_ns)
        movement = self._judge(cut, stride, height)
        rows = self._attitude.rows
        bearing = self._bearings.step(cut, self._attitude.rest_turn_rad_s, rows, self._ahead.reference(rows))
        if movement.name == "standing":
            self._still_steps += 1
            return []
        return [self._estimate(cut, stride, movement, bearing, height)]

    def _judge(self, cut: Cut, stride: Stride, height: Height | None) -> Movement:
        rows = self._attitude.rows
        movement = self._feet.judge(
            stride,
            cut.yaw_rad,
            None if height is None else height.climb,
            self._posture.tilt_rad(rows, self._lengths.on_trunk),
            self.settings.classes and self._ahead.known,
        )
        runs = movement.name == "running"
        self._ahead.learn(cut.gait, cut.turn_rate_rad_s, rows, movement.direction, runs)
        if movement.name == "forward":
            self._lengths.learn(cut.gait)
        return movement

    def _estimate(
        self, cut: Cut, stride: Stride, movement: Movement, bearing: Bearing, height: Height | None
    ) -> BodyStepEstimate:
        settings, sway = self.settings, self.settings.heading.sway_sigma_rad
        ahead_rad = self._ahead.angle_rad - self._misalignment.angle_rad
        turn = 0.0 if self._misalignment.stretches else bearing.turn_rad  # satellites have told north better
        length, azimuth = self._way(cut, movement, bearing, height, turn)
        if not bearing.disturbed:
            self._reliance.bias_updated(cut.end_ns)
        satellites = self._misalignment.satellite_azimuth(cut.end_ns)
        disturbed = bearing.disturbed or "compass" in self._rejected(cut.end_ns, bearing, satellites)
        reliability = self._reliance.step(
            cut.end_ns, length, disturbed, satellites is not None, self._heights.reference_ns
        )
        reading = bearing.reading
        return BodyStepEstimate(
            start_ns=cut.start_ns,
            time_ns=cut.end_ns,
            length_m=length,
            length_sigma_m=math.hypot(settings.length.sigma_share, self._personal.sigma) * length,
            azimuth_rad=azimuth % math.tau,
            track_azimuth_rad=(azimuth - turn) % math.tau,
            azimuth_sigma_rad=math.hypot(self._heading_sigma(cut.end_ns, bearing), sway),
            motion=movement.motion,
            direction=movement.direction,
            class_probability=movement.probability[movement.name],
            settled=self._feet.settled(self._heights.climb_at),
            compass_azimuth_rad=None if reading is None else (reading.azimuth_rad - ahead_rad) % math.tau,
            gyro_azimuth_rad=(bearing.gyro.azimuth_rad - ahead_rad) % math.tau,
            satellite_azimuth_rad=satellites,
            common_scale_sigma=self._personal.sigma,
            common_turn_sigma_rad_s=settings.heading.gyro_drift_rad_s,
            own_turn_sigma_rad=sway,
            azimuth_walk_rad=settings.heading.gyro_noise_rad_sqrt_s * math.sqrt(cut.gait.interval_s),
            height=height,
            reliability=reliability,
            disturbed=disturbed,
            gait=cut.gait,
            turn_rate_rad_s=cut.turn_rate_rad_s,
            taught_scale=self._personal.factor,
            taught_turn_rad=self._misalignment.angle_rad,
            stride=stride,
        )

    def _rejected(self, time_ns: int, bearing: Bearing, satellites_rad: float | None) -> tuple[str, ...]:
        """The azimuths that the others contradict."""
        ahead_rad, reading = self._ahead.angle_rad - self._misalignment.angle_rad, bearing.reading
        sigma = self._misalignment.sigma_at(time_ns, self.settings.heading.gyro_drift_rad_s)
        return self._cross_check.step(
            None if reading is None else (reading.azimuth_rad - ahead_rad, reading.sigma_rad),
            (bearing.gyro.azimuth_rad - ahead_rad, bearing.gyro.sigma_rad),
            None if satellites_rad is None else (satellites_rad, sigma),
        )

    def _heading_sigma(self, time_ns: int, bearing: Bearing) -> float:
        """Of the unit's azimuth; once satellites have told, of the track's or of what they told."""
        if not self._misalignment.stretches:
            return bearing.heading.sigma_rad
        drift = self.settings.heading.gyro_drift_rad_s
        return min(bearing.track.sigma_rad, self._misalignment.sigma_at(time_ns, drift))

    def _way(
        self, cut: Cut, movement: Movement, bearing: Bearing, height: Height | None, turn_rad: float
    ) -> tuple[float, float]:
        """Length and azimuth of a step as it is published, ``turn_rad`` from the track's frame.

        Those who compare tracks, with satellites or the way out, are told in that frame.
        """
        on_stairs = self._stairways.step(
            movement.motion == "stairs", None if height is None else height.height_m
        )

        motion = "walking" if movement.motion == "stairs" and on_stairs < 0.5 else movement.motion

        def length_m(direction: Direction) -> float:
            level_m, slope_rad = self._meet(cut, motion, direction, height)
            along_m = self._lengths.on_slope(level_m, cut.gait, slope_rad)
            return self._personal.factor * projected(along_m, slope_rad)

        told_rad = bearing.track.azimuth_rad - self._ahead.angle_rad
        length, azimuth = self._feet.go(movement, told_rad, length_m)
        self._meet(cut, motion, movement.direction, height)  # the one that fixes are to judge
        self._steps += 1
        self._personal.walk(length, azimuth)
        self._misalignment.walk(length, azimuth)
        self._honesty.walk(length, azimuth)
        azimuth += self._misalignment.angle_rad
        if self._retrace is not None:
            learned = self._personal.factor * self._lengths.learned
            length, azimuth = self._retrace.published(length, azimuth, learned)
        if self._bearings.repeated is not None:
            self._bearings.repeated.walk(length, azimuth)
        return length, azimuth + turn_rad

    def _meet(
        self, cut: Cut, motion: MotionClass, direction: Direction, height: Height | None
    ) -> tuple[float, float]:
        """Go on to a step with the person's factor on such steps; its length on the level, m, and slope, rad."""
        level_m = self._lengths.length(cut.gait, cut.turn_rate_rad_s, motion, direction)
        slope_rad = 0.0 if height is None else height.slope_rad(level_m / cut.gait.interval_s)
        own_model = motion if direction in ("forward", "backward") else "unknown"
        self._personal.meet(self._lengths.features(cut.gait, slope_rad), own_model)
        return level_m, slope_rad
