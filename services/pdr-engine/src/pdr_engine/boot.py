"""One boot on the bus: its batches through the navigator, its steps and poses out as messages in event time."""

import math
from collections.abc import Iterable, Iterator
from typing import Any

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.geomagnetism import earth_field
from bootprint.messages import FootPose, FootStep, ImuBatch, Vector3, upper_triangle
from bootprint.topics import Address
from pdr_engine.foot import FootEstimates, FootNavigator, FootSettings, FootStepEstimate
from pdr_engine.foot_record import condensed, restored
from pdr_engine.memory import SavedBoot
from pdr_engine.rate import NS_PER_S, RateMeter
from pdr_engine.told_again import Had


class Boot:
    """The navigator of one place with the books that messages need.

    Steps are numbered from 0. Poses lie on a fixed grid of event time (the first sample at or after each of its
    points), begin with the first step, and are relative to the newest step at or before their time. With an
    ``origin`` azimuths are told, by the declination there when the first magnetic sample comes.
    """

    def __init__(
        self, settings: FootSettings, imu: Address, pose_interval_s: float, origin: Origin | None = None
    ) -> None:
        self._navigator = FootNavigator(settings, settings.magnetometer.calibration(imu.source))
        self._origin = origin
        self._declination_rad: float | None = None
        self._step_address = imu.with_subject("foot_step")
        self._pose_address = imu.with_subject("foot_pose")
        self._grid_ns = round(pose_interval_s * NS_PER_S)
        self._cell: int | None = None
        self._steps = 0
        self._poses = 0
        self._position: Vector3 = (0.0, 0.0, 0.0)  # where the newest step ended, nav frame
        self._yaw_rad = 0.0
        self._rate = RateMeter()
        self._had = Had()
        self._batch = -1  # number of the newest

    def handle(self, batch: ImuBatch) -> Iterable[Envelope]:
        """Take a batch in; steps and poses that it makes known come out."""
        if not self._had.is_new(batch):
            return ()
        self._batch = batch.sequence
        times = batch.times
        self._rate.count(int(times[-1]), len(times))
        mag = batch.mag
        if mag is not None and self._declination_rad is None:
            self._learn_earth_field(int(times[0]))
        return self._publish(self._navigator.process(times, batch.accel, batch.gyro, mag))

    def close(self) -> Iterable[Envelope]:
        """The end of the stream: what still waited."""
        return self._publish(self._navigator.finish())

    def remembered(self) -> SavedBoot | None:
        """What a restart could go on from; None before the first sample."""
        if self._rate.newest_ns is None:
            return None
        return SavedBoot(
            record=condensed(self._navigator.state),
            newest_ns=self._rate.newest_ns,
            batch=self._batch,
            steps=self._steps,
            poses=self._poses,
            cell=self._cell,
            position=self._position,
            yaw_rad=self._yaw_rad,
        )

    def go_on(self, saved: SavedBoot) -> None:
        """Be the boot that was saved; ValueError if its record is none."""
        self._navigator.go_on(restored(saved.record))
        self._steps, self._poses, self._cell = saved.steps, saved.poses, saved.cell
        self._position, self._yaw_rad = saved.position, saved.yaw_rad
        self._batch, self._had = saved.batch, Had(saved.newest_ns, saved.batch)

    def counters(self) -> dict[str, int]:
        """Counts since the start."""
        return {**self._navigator.counters(), "steps": self._steps}

    def _learn_earth_field(self, time_ns: int) -> None:
        """It changes too slowly to be asked for again."""
        if self._origin is not None:
            field = earth_field(self._origin, time_ns)
            self._navigator.know_earth_field(field)
            self._declination_rad = field.declination_rad

    @property
    def rate_hz(self) -> float:
        """Samples a second, of the newest second."""
        return self._rate.rate_hz

    @property
    def newest_ns(self) -> int | None:
        """Time of the newest sample."""
        return self._rate.newest_ns

    @property
    def contradicts_itself(self) -> bool:
        """Whether accelerometer and gyro do not fit together: wrong units, or axes that are not right-handed."""
        return self._navigator.contradicts_itself

    def _publish(self, estimates: FootEstimates) -> Iterator[Envelope]:
        """Steps and poses in the order of their times; a step goes before the pose of its own time."""
        steps = iter(estimates.steps)
        step = next(steps, None)
        for row in self._grid_rows(estimates):
            while step is not None and step.time_ns <= int(row["time_ns"]):
                yield self._step(step)
                step = next(steps, None)
            if self._steps:
                yield self._pose(row)
        while step is not None:
            yield self._step(step)
            step = next(steps, None)

    def _grid_rows(self, estimates: FootEstimates) -> Iterator[Any]:
        """The first estimate in each cell of the grid."""
        cells = (estimates.time_ns // self._grid_ns).tolist()
        for index, cell in enumerate(cells):
            if cell != self._cell:
                self._cell = cell
                yield estimates.rows[index]

    def _step(self, step: FootStepEstimate) -> Envelope:
        forward, left, up = (float(value) for value in step.displacement_m)
        message = FootStep(
            time_ns=step.time_ns,
            sequence=self._steps,
            start_time_ns=step.start_time_ns,
            displacement_m=(forward, left, up),
            heading_change_rad=step.heading_change_rad,
            covariance=upper_triangle(step.covariance),
            motion=step.motion,
            stance_quality=step.stance_quality,
            realigned=step.realigned,
            direction=step.direction,
            length_m=step.length_m,
            horizontal_length_m=step.horizontal_length_m,
            clearance_m=step.clearance_m,
            swing_s=step.swing_s,
            stance_s=step.stance_s,
            landing_nis=step.landing_nis,
            quality_pct=step.quality_pct,
            common_scale_sigma=step.common_scale_sigma,
            common_slope_sigma=step.common_slope_sigma,
            common_turn_sigma_rad_s=step.common_turn_sigma_rad_s,
            magnetic_azimuth_rad=self._true_azimuth(step),
            magnetic_azimuth_sigma_rad=step.magnetic_azimuth_sigma_rad,
        )
        self._steps += 1
        cosine, sine = math.cos(self._yaw_rad), math.sin(self._yaw_rad)
        x, y, z = self._position
        self._position = (x + cosine * forward - sine * left, y + sine * forward + cosine * left, z + up)
        self._yaw_rad += step.heading_change_rad
        return Envelope(self._step_address, message)

    def _true_azimuth(self, step: FootStepEstimate) -> float | None:
        if step.magnetic_azimuth_rad is None or self._declination_rad is None:
            return None
        return (step.magnetic_azimuth_rad + self._declination_rad) % (2.0 * math.pi)

    def _pose(self, row: Any) -> Envelope:
        cosine, sine = math.cos(self._yaw_rad), math.sin(self._yaw_rad)
        x, y, z = (float(here - there) for here, there in zip(row["position_m"], self._position, strict=True))
        message = FootPose(
            time_ns=int(row["time_ns"]),
            sequence=self._poses,
            step_sequence=self._steps - 1,
            displacement_m=(cosine * x + sine * y, cosine * y - sine * x, z),
            heading_change_rad=math.remainder(float(row["yaw_rad"]) - self._yaw_rad, 2.0 * math.pi),
            speed_m_s=float(row["speed_m_s"]),
            in_stance=bool(row["stance"]),
        )
        self._poses += 1
        return Envelope(self._pose_address, message)
