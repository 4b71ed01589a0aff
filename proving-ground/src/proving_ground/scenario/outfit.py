"""A soldier's sensors on a soldier's motion: what the kit measures in the surroundings, as a `Run`."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from proving_ground.motion import Motion
from proving_ground.people import INSTEP_M, PersonMotion
from proving_ground.scenario.cast import Soldier
from proving_ground.scenario.schema.people import Imu
from proving_ground.scenario.surroundings import Surroundings
from proving_ground.sensors.air import BAROMETER_CLASSES, measure_pressure
from proving_ground.sensors.camera_folder import write_camera_folder
from proving_ground.sensors.camera_motion import OdometryQuality, measure_camera
from proving_ground.sensors.camera_render import StereoCamera
from proving_ground.sensors.camera_world import CameraWorld, Figure
from proving_ground.sensors.gnss import GNSS_CLASSES, measure_gnss
from proving_ground.sensors.imu import measure_imu
from proving_ground.sensors.imu_quality import imu_class
from proving_ground.sensors.mounting import Mounting
from proving_ground.sensors.ranges import RANGE_CLASSES, Peer, Ranging, measure_ranges
from sensor_gateway.recordings.run import (
    CameraSeries,
    GnssSeries,
    ImuSeries,
    PressureSeries,
    RangeSeries,
    Run,
)

# Metres forward, left and up of the belt.
_ON_HELMET = Mounting(np.array([0.05, 0.0, 0.65]))
_ON_SHOULDER = Mounting(np.array([0.0, 0.15, 0.45]))
_ON_CHEST = Mounting(np.array([0.12, 0.0, 0.3]))
_FEET = ("left_foot", "right_foot")
# Streams of random numbers of one soldier; the person and the motion take 0 and 1.
_IMU, _GNSS, _PRESSURE, _CAMERA, _RANGES, _MOUNTING = 10, 20, 30, 40, 50, 60


@dataclass(frozen=True)
class Outfit:
    """One soldier with motion, in surroundings, among ``others`` of the same unit (by id)."""

    soldier: Soldier
    motion: PersonMotion
    others: Mapping[str, tuple[Soldier, PersonMotion]]
    surroundings: Surroundings

    def run(self, source: str) -> Run:
        """Everything that the kit measures, and the truth."""
        origin = self.surroundings.scenario.file.origin
        return Run(
            name=self.soldier.id,
            kind="dual" if all(foot in self._imus for foot in _FEET) else "foot",
            path=Path(),
            imus={place: self._imu(imu) for place, imu in self._imus.items()},
            truth={"body": self.motion.truth()},
            pressure=self._pressure(),
            gnss=self._gnss(),
            camera=self._camera(),
            ranges=self._ranges(),
            origin=(origin.latitude_deg, origin.longitude_deg, origin.height_m),
            source=source,
        )

    def render(self, folder: Path) -> Path | None:
        """Image pairs, for kits whose camera is rendered; slow."""
        if self.soldier.kit.camera != "rendered":
            return None
        torso, duration_s, rng = self.motion.torso, self.motion.duration_s, self._rng(_CAMERA)
        return write_camera_folder(folder, self._view(), StereoCamera(), torso, _ON_HELMET, duration_s, rng)

    @property
    def _imus(self) -> dict[str, Imu]:
        return {imu.place: imu for imu in self.soldier.kit.imus}

    def _rng(self, *stream: int) -> np.random.Generator:
        return np.random.default_rng([self.surroundings.seed, self.soldier.number, *stream])

    def _part(self, place: str) -> Motion:
        parts: dict[str, Motion] = {
            "left_foot": self.motion.left_foot,
            "right_foot": self.motion.right_foot,
            "body": self.motion.torso,
        }
        return parts[place]

    def _imu(self, imu: Imu) -> ImuSeries:
        magnetics = self.surroundings.magnetics if imu.magnetometer else None
        rng = self._rng(_IMU, list(self._imus).index(imu.place))
        quality = imu_class(imu.quality)
        return measure_imu(
            self._part(imu.place), self.motion.duration_s, self._mounting(imu), quality, magnetics, rng
        )

    def _mounting(self, imu: Imu) -> Mounting:
        """Where a unit sits on this soldier's foot or body: nobody wears it quite as the next one does."""
        laces = INSTEP_M if imu.place in _FEET else np.zeros(3)
        offset = laces if imu.offset_m is None else np.array(imu.offset_m)
        rng = self._rng(_MOUNTING, list(self._imus).index(imu.place))
        roll, pitch, yaw = rng.normal(imu.mounting_deg, imu.askew_deg)
        return Mounting(offset, Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True))

    def _gnss(self) -> GnssSeries | None:
        kind = self.soldier.kit.gnss
        if kind == "none":
            return None
        on_since_long = replace(GNSS_CLASSES[kind], first_fix_s=0.0)
        return measure_gnss(
            self.motion.torso,
            self.motion.duration_s,
            _ON_SHOULDER,
            on_since_long,
            self.surroundings.sky,
            self.surroundings.scenario.file.origin,
            self._rng(_GNSS),
        )

    def _pressure(self) -> PressureSeries | None:
        kind = self.soldier.kit.barometer
        if kind == "none":
            return None
        quality, rng = BAROMETER_CLASSES[kind], self._rng(_PRESSURE)
        return measure_pressure(
            self.motion.torso, self.motion.duration_s, _ON_CHEST, quality, self.surroundings.air, rng
        )

    def _camera(self) -> CameraSeries | None:
        if self.soldier.kit.camera != "fast":
            return None
        return measure_camera(
            self.motion.torso,
            self.motion.duration_s,
            _ON_HELMET,
            StereoCamera(),
            OdometryQuality(),
            self._view(),
            self._rng(_CAMERA),
        )

    def _view(self) -> CameraWorld:
        return self.surroundings.view(tuple(Figure(motion.torso) for _, motion in self.others.values()))

    def _ranges(self) -> RangeSeries | None:
        """To the others of the unit that have a radio for it, and between the own feet, in order of time."""
        kit, series = self.soldier.kit, []
        if kit.uwb:
            peers = [
                Peer(name, motion.torso, _ON_SHOULDER)
                for name, (other, motion) in self.others.items()
                if other.kit.uwb
            ]
            series.append(self._ranged(self.motion.torso, _ON_SHOULDER, peers, "soldiers", 0))
        if kit.foot_ranging and all(foot in self._imus for foot in _FEET):
            left, right = (self._mounting(self._imus[foot]) for foot in _FEET)
            peers = [Peer(f"{self.soldier.id}/right_foot", self.motion.right_foot, right)]
            series.append(self._ranged(self.motion.left_foot, left, peers, "feet", 1))
        return merged(series) if series else None

    def _ranged(
        self, motion: Motion, mounting: Mounting, peers: list[Peer], kind: str, stream: int
    ) -> RangeSeries:
        between = Ranging(peers, self.surroundings.walls, self.surroundings.floors_m)
        rng = self._rng(_RANGES, stream)
        return measure_ranges(motion, self.motion.duration_s, mounting, RANGE_CLASSES[kind], between, rng)


def merged(series: list[RangeSeries]) -> RangeSeries:
    """Several series as one, in order of time."""
    time_s = np.concatenate([one.time_s for one in series])
    peers = [peer for one in series for peer in one.peer]
    order = np.argsort(time_s, kind="stable")
    return RangeSeries(
        time_s[order],
        tuple(peers[index] for index in order),
        np.concatenate([one.distance_m for one in series])[order],
        np.concatenate([one.sigma_m for one in series])[order],
    )
