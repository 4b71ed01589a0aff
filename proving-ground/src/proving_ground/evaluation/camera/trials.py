"""Rendered walks over two floors: a camera alone, feet alone and both, through the same cores as on the bus.

Sixty metres: a corridor, a stair, a landing that may be dark, a second corridor around the corner. Images are
rendered once into a folder of their own and read again, as camera folders are.

python -m proving_ground.evaluation.camera.trials FOLDER [SEED ...]
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from bootprint import logs
from bootprint.bus import Envelope
from bootprint.config import Origin, convert
from bootprint.topics import Identity
from fusion.config import FusionConfig
from pdr_engine.config import PdrConfig
from pdr_engine.foot import warm_up
from proving_ground.evaluation.alignment import Align, Track
from proving_ground.evaluation.camera.recorded_run import Walked, walk_camera
from proving_ground.evaluation.scoring import Score, score_track
from proving_ground.inprocess import play_run, positions_of
from proving_ground.people import INSTEP_M, Itinerary, Leg, Person, PersonMotion, move
from proving_ground.sensors import (
    Area,
    CameraWorld,
    LightZone,
    Mounting,
    Slab,
    StereoCamera,
    Walls,
    imu_class,
    measure_imu,
    write_camera_folder,
)
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import ImuSeries, Run, Truth
from sensor_gateway.sources.run_messages import CAMERA_SOURCE

SEEDS = (1, 3, 5)
CAMERA = StereoCamera(width_px=320, height_px=240, focal_px=200.0)
HELMET = Mounting(np.array([0.05, 0.0, 0.65]))
RISE_M = 3.2
_HALF_M, _STAIR, _TREADS = 1.2, (24.0, 30.0), 8
_TRUTH_FEET = ("left_foot", "right_foot")
_WAY = ((-6.0, 0.0, 0.0), (24.0, 0.0, 0.0), (30.0, 0.0, RISE_M), (33.0, 0.0, RISE_M), (33.0, 21.0, RISE_M))
_LANDING = Area.box(29.0, -2.0, 36.0, 3.0, (RISE_M - 0.5, RISE_M + 3.0))
_IDENTITY = Identity("trials", "trials", "trials")
_ORIGIN = Origin(latitude_deg=0.0, longitude_deg=0.0)


def building(dark_landing: bool, seed: int) -> CameraWorld:
    """Two corridors, 2.4 m wide, with a stair between them; ``seed`` chooses what hangs on the walls."""
    ends, heights, slabs = _corridors()
    for number in range(_TREADS):
        start, end = (_STAIR[0] + (number + part) * 6.0 / _TREADS for part in (0, 1))
        rise = RISE_M * number / _TREADS
        slabs.append(Slab(rise, (start, -_HALF_M), (end, _HALF_M)))
        ends.append(((end, -_HALF_M), (end, _HALF_M)))
        heights.append((rise, rise + RISE_M / _TREADS))
    zones = (LightZone("dark", _LANDING, 0.995),) if dark_landing else ()
    walls = Walls(np.array(ends), np.array(heights))
    return CameraWorld(walls, tuple(slabs), zones=zones, seed=seed)


def _corridors() -> tuple[list[tuple[tuple[float, float], ...]], list[tuple[float, float]], list[Slab]]:
    """Walls with their heights, floors and ceilings, but for the stair."""
    near, above, top = (0.0, 2.8), (RISE_M, 6.0), 6.0
    plan: list[tuple[tuple[tuple[float, float], ...], tuple[float, float]]] = [
        (((-7.0, -_HALF_M), (24.0, -_HALF_M)), near),
        (((-7.0, _HALF_M), (24.0, _HALF_M)), near),
        (((-7.0, -_HALF_M), (-7.0, _HALF_M)), near),
        (((24.0, -_HALF_M), (24.0, _HALF_M)), (2.8, top)),
        (((24.0, -_HALF_M), (34.2, -_HALF_M)), (0.0, top)),
        (((24.0, _HALF_M), (31.8, _HALF_M)), (0.0, top)),
        (((34.2, -_HALF_M), (34.2, 22.0)), above),
        (((31.8, _HALF_M), (31.8, 22.0)), above),
        (((31.8, 22.0), (34.2, 22.0)), above),
    ]
    slabs = [
        Slab(0.0, (-7.0, -_HALF_M), (24.0, _HALF_M)),
        Slab(2.8, (-7.0, -_HALF_M), (24.0, _HALF_M)),
        Slab(RISE_M, (30.0, -_HALF_M), (34.2, 22.0)),
        Slab(top, (24.0, -_HALF_M), (34.2, 22.0)),
    ]
    return [ends for ends, _ in plan], [heights for _, heights in plan], slabs


def walk(seed: int) -> PersonMotion:
    """Somebody who walks all the way, standing for three seconds before and one after."""
    way = np.array(_WAY)
    legs = (
        Leg("stand", way[:1], 3.0),
        Leg("walk", way[:2]),
        Leg("stairs", way[1:3]),
        Leg("walk", way[2:]),
        Leg("stand", way[-1:], 1.0),
    )
    return move(Person(), Itinerary(legs), seed)


@dataclass(frozen=True, slots=True)
class Fused:
    """A fused track, the person's true one, and the mode at every position."""

    track: Track
    truth: Truth
    modes: tuple[str, ...]

    def score(self, align: Align = "best-fit") -> Score:
        """Against the truth."""
        return score_track(self.track, self.truth, align).score


@dataclass
class Trial:
    """One walk; images and feet are those of its seed."""

    seed: int
    dark_landing: bool
    folder: Path

    @cached_property
    def motion(self) -> PersonMotion:
        """How the person moves."""
        return walk(self.seed)

    @cached_property
    def images(self) -> Run:
        """The camera folder, rendered if it is not there yet."""
        name = f"{'dark' if self.dark_landing else 'lit'}-{self.seed}"
        path = self.folder / name
        if not (path / "poses.txt").exists():
            rng = np.random.default_rng([self.seed, 7])
            world = building(self.dark_landing, self.seed)
            write_camera_folder(path, world, CAMERA, self.motion.torso, HELMET, self.motion.duration_s, rng)
        return load_runs([path], "camera")[0]

    @cached_property
    def walked(self) -> Walked:
        """What odometry makes of the images."""
        return walk_camera(self.images)

    def camera_alone(self) -> Score:
        """The camera's track against its true poses, laid over their first metres."""
        return score_track(self.walked.track, self.images.truth["camera"], "start", self.walked.chain).score

    def feet(self, quality: str = "industrial") -> Run:
        """What units on both boots measure."""
        imus = {}
        for number, place in enumerate(_TRUTH_FEET):
            rng = np.random.default_rng([self.seed, 20 + number])
            mounting = Mounting(INSTEP_M, Rotation.from_euler("XYZ", rng.normal(0.0, 0.2, 3)))
            foot = self.motion.left_foot if number == 0 else self.motion.right_foot
            imus[place] = measure_imu(foot, self.motion.duration_s, mounting, imu_class(quality), None, rng)
        return Run("walk", "dual", Path(), imus, {"body": self.motion.truth()})

    def fused(self, feet: Sequence[str], camera: bool, silent_after_s: float = np.inf) -> Fused:
        """Boots and camera through pdr-engine and fusion, from a known start; boots fall silent when told to."""
        run = self.feet()
        run = replace(run, imus={place: _until(run.imus[place], silent_after_s) for place in feet})
        start = {"east_m": _WAY[0][0], "north_m": 0.0, "azimuth_deg": 90.0, "sigma_m": 0.1}
        fusion = convert(
            {"feet": list(feet) or ["left_foot"], "gnss_sources": [], "start": start},
            FusionConfig,
            where="trial",
        )
        pdr = convert({"places": list(feet) or ["left_foot"]}, PdrConfig, where="trial")
        told = self._motions() if camera else []
        bus = play_run(run, _IDENTITY, _ORIGIN, pdr, fusion, start_ns=0, others=told)
        positions = [one for one in positions_of(bus) if one.mode != "unplaced"]
        track = Track(
            np.array([one.time_ns for one in positions]) / 1e9,
            np.array([(one.east_m, one.north_m, one.up_m) for one in positions]),
        )
        return Fused(track, run.truth["body"], tuple(one.mode for one in positions))

    def _motions(self) -> list[Envelope]:
        address = _IDENTITY.address("camera_motion", CAMERA_SOURCE)
        return [Envelope(address, motion) for motion in self.walked.motions]


def _until(imu: ImuSeries, end_s: float) -> ImuSeries:
    kept = imu.time_s < end_s
    return ImuSeries(imu.time_s[kept], imu.accel_m_s2[kept], imu.gyro_rad_s[kept])


Row = dict[str, str | float | int | None]
FEET: dict[str, tuple[str, ...]] = {"left foot": ("left_foot",), "both feet": _TRUTH_FEET}


def rows_of(trial: Trial) -> list[Row]:
    """The camera alone, and each choice of feet without and with it."""
    rows = [row_of(trial, "camera", trial.camera_alone())]
    for name, feet in FEET.items():
        for camera in (False, True):
            sources = f"{name} and camera" if camera else name
            rows.append(row_of(trial, sources, trial.fused(feet, camera).score()))
    return rows


def row_of(trial: Trial, sources: str, score: Score) -> Row:
    """One line of figures."""
    return {
        "seed": trial.seed,
        "landing": "dark landing" if trial.dark_landing else "lit",
        "sources": sources,
        "distance_m": score.distance_m,
        "rmse_m": score.rmse_m,
        "p95_m": score.p95_m,
        "final_m": score.final_m,
        "final_pct": score.final_pct,
        "height_final_m": score.height_final_m,
        "inside_95_pct": score.inside_95_pct,
    }


def main(folder: Path, seeds: Sequence[int]) -> None:
    """Print a row for every walk, light and choice of sources, as JSON lines."""
    logs.configure("error")
    warm_up()
    for seed in seeds:
        for dark in (False, True):
            for row in rows_of(Trial(seed, dark, folder)):
                sys.stdout.write(json.dumps(row) + "\n")
                sys.stdout.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]), [int(seed) for seed in sys.argv[2:]] or SEEDS)
