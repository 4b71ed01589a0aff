"""The body-worn unit on the bus: its batches through the navigator, its steps out as messages in event time."""

import math
from collections.abc import Iterable, Iterator

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from bootprint.geomagnetism import earth_field
from bootprint.messages import BodyStep, GnssFix, ImuBatch, Pressure
from bootprint.topics import Address
from pdr_engine.body import BodyNavigator, BodySettings, BodyStepEstimate
from pdr_engine.body.azimuth.deviation import Deviation
from pdr_engine.body.length.personal import Person
from pdr_engine.memory import SavedTrunk
from pdr_engine.rate import RateMeter
from pdr_engine.told_again import Had
from pdr_engine.trunk_record import frozen, thawed

_SAVED = ("_navigator", "_declination_rad", "_frame", "_steps")


class Trunk:
    """The navigator of the body-worn unit with the books that messages need.

    Steps are numbered from 0. With an ``origin`` azimuths are from true north, by the declination there when the
    first sample comes; without one from magnetic north.
    """

    def __init__(self, settings: BodySettings, imu: Address, origin: Origin | None = None) -> None:
        self._navigator = BodyNavigator(settings)
        self._origin = origin
        self._declination_rad: float | None = None
        self._address = imu.with_subject("body_step")
        self._frame: LocalFrame | None = None
        self._steps = 0
        self._rate = RateMeter()
        self._had = Had()
        self._batch = -1  # number of the newest

    @property
    def rate_hz(self) -> float:
        """Samples a second, of the newest second."""
        return self._rate.rate_hz

    @property
    def newest_ns(self) -> int | None:
        """Time of the newest sample."""
        return self._rate.newest_ns

    def handle(self, batch: ImuBatch) -> Iterable[Envelope]:
        """Take a batch in; steps that it makes known come out."""
        return self._publish(self.estimates(batch))

    def estimates(self, batch: ImuBatch) -> list[BodyStepEstimate]:
        """The same, with all that the navigator says of the steps."""
        if not self._had.is_new(batch):
            return []
        self._batch = batch.sequence
        times = batch.times
        self._rate.count(int(times[-1]), len(times))
        if self._declination_rad is None:
            self._learn_earth_field(int(times[0]))
        return self._navigator.process(times, batch.accel, batch.gyro, batch.mag)

    def hear_pressure(self, pressure: Pressure) -> None:
        """The soldier's barometer, wherever it is worn."""
        self._navigator.hear_pressure(pressure.time_ns, pressure.pressure_pa)

    def hear_fix(self, fix: GnssFix) -> None:
        """A satellite fix with a place and an accuracy, in the navigator's frame of magnetic north."""
        if fix.height_m is not None and fix.vertical_accuracy_m:
            self._navigator.hear_height(fix.time_ns, fix.height_m, fix.vertical_accuracy_m)
        declination = self._declination_rad
        if fix.latitude_deg is None or fix.longitude_deg is None or fix.horizontal_accuracy_m is None:
            return
        if declination is None:
            return
        if self._frame is None:
            here = Origin(latitude_deg=fix.latitude_deg, longitude_deg=fix.longitude_deg)
            self._frame = LocalFrame(here if self._origin is None else self._origin)
        east, north, _ = self._frame.to_enu(fix.latitude_deg, fix.longitude_deg, 0.0)
        cosine, sine = math.cos(declination), math.sin(declination)
        east, north = cosine * east - sine * north, cosine * north + sine * east
        self._navigator.hear_fix(fix.time_ns, east, north, fix.horizontal_accuracy_m)

    def remembered(self) -> SavedTrunk | None:
        """What a restart could go on from; None before the first sample."""
        if self._rate.newest_ns is None:
            return None
        parts = {name: getattr(self, name) for name in _SAVED}
        return SavedTrunk(record=frozen(parts), newest_ns=self._rate.newest_ns, batch=self._batch)

    def go_on(self, saved: SavedTrunk) -> None:
        """Be the unit that was saved; ValueError if its record is none."""
        parts = thawed(saved.record)
        if set(parts) != set(_SAVED) or not isinstance(parts["_navigator"], BodyNavigator):
            raise ValueError("no body navigator")
        for name, part in parts.items():
            setattr(self, name, part)
        self._batch, self._had = saved.batch, Had(saved.newest_ns, saved.batch)

    @property
    def person(self) -> Person | None:
        """What is known of the person's step length; None before a fix has told any of it."""
        return self._navigator.person if self._navigator.knows_person else None

    @property
    def deviations(self) -> tuple[Deviation, ...]:
        """Compass deviations by place (METHODS B5); none without an origin: then every walk has its own frame."""
        return () if self._origin is None else self._navigator.deviations

    def counters(self) -> dict[str, int]:
        """Counts since the start."""
        return self._navigator.counters()

    def _learn_earth_field(self, time_ns: int) -> None:
        """It changes too slowly to be asked for again."""
        self._declination_rad = 0.0
        if self._origin is not None:
            field = earth_field(self._origin, time_ns)
            self._navigator.know_earth_field(field)
            self._declination_rad = field.declination_rad

    def _publish(self, steps: Iterable[BodyStepEstimate]) -> Iterator[Envelope]:
        for step in steps:
            yield Envelope(self._address, self._message(step))
            self._steps += 1

    def _message(self, step: BodyStepEstimate) -> BodyStep:
        compass, satellites = step.compass_azimuth_rad, step.satellite_azimuth_rad
        height, reliability, settled = step.height, step.reliability, step.settled
        return BodyStep(
            time_ns=step.time_ns,
            sequence=self._steps,
            start_time_ns=step.start_ns,
            length_m=step.length_m,
            length_sigma_m=step.length_sigma_m,
            azimuth_rad=self._true(step.azimuth_rad),
            azimuth_sigma_rad=step.azimuth_sigma_rad,
            track_azimuth_rad=self._true(step.track_azimuth_rad),
            motion=step.motion,
            direction=step.direction,
            class_pct=100.0 * step.class_probability,
            settled_time_ns=None if settled is None else settled.time_ns,
            settled_motion=None if settled is None else settled.motion,
            settled_direction=None if settled is None else settled.direction,
            height_m=None if height is None else height.height_m,
            height_sigma_m=None if height is None else height.sigma_m,
            floor=None if height is None else height.floor,
            floor_pct=None if height is None else 100.0 * height.floor_probability,
            compass_azimuth_rad=None if compass is None else self._true(compass),
            gyro_azimuth_rad=self._true(step.gyro_azimuth_rad),
            gnss_azimuth_rad=None if satellites is None else self._true(satellites),
            azimuth_redundancy_pct=reliability.azimuth_pct,
            planimetry_redundancy_pct=reliability.planimetry_pct,
            altimetry_redundancy_pct=reliability.altimetry_pct,
            external_reliability_m=reliability.external_m,
            taught_scale=step.taught_scale,
            taught_turn_rad=step.taught_turn_rad,
        )

    def _true(self, magnetic_rad: float) -> float:
        return (magnetic_rad + (self._declination_rad or 0.0)) % math.tau
