"""Stereo odometry by cameras that are not as their calibration says: rendered walks and a drive, a defect each.

A walk of 21 m round the corner of a corridor, and a drive of 50 m down a street with a camera as cars carry. Images
are rendered once into a folder of their own. Figures are of the camera alone, laid over the first 5 m.

python -m proving_ground.evaluation.camera.defects FOLDER [--seeds N ...] [--only NAME ...]
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from bootprint import logs
from proving_ground.evaluation.alignment import FloatArray
from proving_ground.evaluation.camera.recorded_run import walk_camera
from proving_ground.evaluation.scoring import score_track
from proving_ground.motion import Motion
from proving_ground.people import Itinerary, Leg, Person, move
from proving_ground.sensors import (
    CameraWorld,
    Figure,
    Mounting,
    Slab,
    StereoCamera,
    Walls,
    write_camera_folder,
)
from proving_ground.sensors.camera_defects import Bursts, Defects
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import Run, Truth

SEEDS = (1, 3)
HELMET = Mounting(np.array([0.05, 0.0, 0.65]))
ROOF = Mounting(np.array([1.5, 0.0, 1.6]))
SMALL = StereoCamera()
CAR = StereoCamera(width_px=1226, height_px=370, focal_px=707.0, baseline_m=0.537)
_WAY = ((-4.0, 0.0, 0.0), (8.0, 0.0, 0.0), (8.0, 9.0, 0.0))
_HALF_M, _UP_M = 1.2, 2.8
_DRIVE_S, _DRIVE_M_S, _BEND_RAD_S = 5.0, 10.0, 0.04


@dataclass(frozen=True)
class Case:
    """One defect, in a corridor on foot or in a street by car.

    ``missing``: the images of the case of that name, from which pairs are missing: one in ten, or every second.
    """

    name: str
    defects: Defects = field(default_factory=Defects)
    tile_m: float | None = None
    street: bool = False
    missing: tuple[str, int] | None = None

    @property
    def images(self) -> str:
        """Name of the case whose images these are."""
        return self.name if self.missing is None else self.missing[0]


CASES = (
    Case("none"),
    Case("shutter rolls, 20 ms", Defects(rolling_s=0.02)),
    Case("exposures of 15 ms", Defects(exposure_s=0.015)),
    Case("blur of 45 ms for 0.5 s in 3", Defects(bursts=Bursts(3.0, 0.5, 0.045))),
    Case("blur of 60 ms for 1.2 s in 5", Defects(bursts=Bursts(5.0, 1.2, 0.06))),
    Case("right eye turned up by 2 px", Defects(right_turn_rad=(0.01, 0.0, 0.0))),
    Case("right eye rolled by 0.5 deg", Defects(right_turn_rad=(0.0, 0.0, 0.0087))),
    Case("right eye turned in by 0.3 px", Defects(right_turn_rad=(0.0, -0.0015, 0.0))),
    Case("right eye knocked on the way", Defects(right_turn_rad=(0.008, 0.0, 0.005), from_s=8.0)),
    Case("right focal length 0.5 % longer", Defects(right_focal=1.005)),
    Case("distortion left in both lenses", Defects(radial=-0.01)),
    Case("dark corners, gains that flicker", Defects(vignetting=0.6, flicker=0.2, right_gain=0.8)),
    Case("walls tiled alike every 0.6 m", tile_m=0.6),
    Case(
        "a little of everything",
        Defects(0.015, 0.008, Bursts(4.0, 0.4, 0.03), (0.004, -0.0005, 0.003), 1.002, -0.004, 0.4, 0.1, 0.9),
    ),
    Case("one pair in ten is missing", missing=("none", 10)),
    Case("street", street=True),
    Case("street, one pair in ten is missing", street=True, missing=("street", 10)),
    Case("street, every second pair is missing", street=True, missing=("street", 2)),
    Case(
        "street, a little of everything",
        Defects(0.0, 0.006, None, (0.001, -0.0003, 0.001), 1.001, -0.003, 0.3, 0.05, 0.95),
        street=True,
    ),
)


@dataclass(frozen=True)
class Drive:
    """A car in a slight bend, with the pitch and roll of a road."""

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Position (n, 3) and attitude."""
        yaw = _BEND_RAD_S * time_s
        radius_m = _DRIVE_M_S / _BEND_RAD_S
        place = np.column_stack(
            [radius_m * np.sin(yaw), radius_m * (1.0 - np.cos(yaw)), 0.02 * np.sin(9.0 * time_s)]
        )
        angles = np.column_stack([yaw, 0.006 * np.sin(8.0 * time_s), 0.008 * np.sin(5.0 * time_s)])
        return place, Rotation.from_euler("ZYX", angles)


@dataclass(frozen=True)
class _Going:
    """Somebody else in the street, at a constant velocity."""

    start_m: tuple[float, float, float]
    velocity_m_s: tuple[float, float, float]

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Position (n, 3) and attitude."""
        return np.array(self.start_m) + np.outer(time_s, self.velocity_m_s), Rotation.identity(len(time_s))


def corridor(seed: int, tile_m: float | None) -> CameraWorld:
    """A corridor with a corner, 2.4 m wide."""
    east, north = _WAY[1][0], _WAY[2][1] + 2.0
    plan = [
        ((-5.0, -_HALF_M), (east + _HALF_M, -_HALF_M)),
        ((-5.0, _HALF_M), (east - _HALF_M, _HALF_M)),
        ((-5.0, -_HALF_M), (-5.0, _HALF_M)),
        ((east + _HALF_M, -_HALF_M), (east + _HALF_M, north)),
        ((east - _HALF_M, _HALF_M), (east - _HALF_M, north)),
        ((east - _HALF_M, north), (east + _HALF_M, north)),
    ]
    walls = Walls(np.array(plan), np.tile([0.0, _UP_M], (len(plan), 1)))
    return CameraWorld(walls, (Slab(0.0), Slab(_UP_M)), seed=seed, tile_m=tile_m)


def street(seed: int) -> CameraWorld:
    """Fronts of houses that leap to and fro, a road, a car ahead, one that comes and one that parks."""
    rng = np.random.default_rng([seed, 31])
    ends, heights = [], []
    for side in (-1.0, 1.0):
        for start in np.arange(-20.0, 140.0, 12.0):
            front = side * rng.uniform(7.0, 11.0) + 0.0008 * start**2
            ends.append(((start, front), (start + 12.0, front + 0.02 * start)))
            heights.append((0.0, rng.uniform(4.0, 9.0)))
    cars = (
        Figure(_Going((22.0, 0.6, 0.0), (9.0, 0.7, 0.0)), 0.9, 1.5, 0.0),
        Figure(_Going((70.0, 4.5, 0.0), (-9.0, 0.0, 0.0)), 0.9, 1.5, 0.0),
        Figure(_Going((30.0, -3.5, 0.0), (0.0, 0.0, 0.0)), 0.9, 1.5, 0.0),
    )
    return CameraWorld(Walls(np.array(ends), np.array(heights)), (Slab(0.0),), cars, seed=seed)


def _scene(case: Case, seed: int) -> tuple[CameraWorld, StereoCamera, Motion, Mounting, float]:
    if case.street:
        return street(seed), CAR, Drive(), ROOF, _DRIVE_S
    way = np.array(_WAY)
    walked = move(Person(), Itinerary((Leg("stand", way[:1], 1.0), Leg("walk", way))), seed)
    return corridor(seed, case.tile_m), SMALL, walked.torso, HELMET, walked.duration_s


@dataclass(frozen=True, slots=True)
class Found:
    """What odometry made of one case and seed: errors, % of the way, RMSE, pairs without a motion, time a pair."""

    name: str
    seed: int
    final_pct: float
    rmse_m: float
    inside_95_pct: float | None
    blind_pct: float
    ms: float


def measure(case: Case, seed: int, folder: Path) -> Found:
    """Render it if it is not there yet, and walk it."""
    path = folder / f"{case.images.replace(' ', '-').replace(',', '').replace('%', '')}-{seed}"
    if not (path / "poses.txt").exists():
        rng = np.random.default_rng([seed, 8])
        world, camera, motion, mounting, duration_s = _scene(case, seed)
        write_camera_folder(path, world, camera, motion, mounting, duration_s, rng, case.defects)
    run = _thinned(load_runs([path], "camera")[0], case)
    walked = walk_camera(run)
    score = score_track(walked.track, run.truth["camera"], "start", walked.chain).score
    blind = sum(count for verdict, count in walked.verdicts.items() if verdict != "starting")
    pairs = len(walked.time_s)
    return Found(
        case.name,
        seed,
        score.final_pct or float("nan"),
        score.rmse_m or float("nan"),
        score.inside_95_pct,
        100.0 * blind / pairs,
        1e3 * walked.seconds / pairs,
    )


def _thinned(run: Run, case: Case) -> Run:
    """Without the pairs that are missing: nothing tells so, the rest comes at the usual rate."""
    if case.missing is None or run.stereo is None:
        return run
    number = np.arange(len(run.stereo.left))
    kept = np.flatnonzero(number % case.missing[1] != case.missing[1] - 1)
    time_s = run.stereo.time_s[: len(kept)]
    left, right = (tuple(eye[at] for at in kept) for eye in (run.stereo.left, run.stereo.right))
    truth = Truth(time_s, run.truth["camera"].position_m[kept])
    stereo = replace(run.stereo, time_s=time_s, left=left, right=right)
    return replace(run, stereo=stereo, truth={"camera": truth})


def table(found: Sequence[Found]) -> Iterator[str]:
    """Lines of a Markdown table: a row a case."""
    yield "| defect | end, % of the way: median / worst | RMSE m | pairs without a motion % |"
    yield "|---|--:|--:|--:|"
    by_name: Mapping[str, list[Found]] = {name: [] for name in dict.fromkeys(one.name for one in found)}
    for one in found:
        by_name[one.name].append(one)
    for name, runs in by_name.items():
        ends, errors = ([getattr(one, key) for one in runs] for key in ("final_pct", "rmse_m"))
        blind = np.mean([one.blind_pct for one in runs])
        yield (
            f"| {name} | {np.median(ends):.2f} / {max(ends):.2f}"
            f" | {np.median(errors):.2f} / {max(errors):.2f} | {blind:.0f} |"
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description="stereo odometry by defective cameras")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(SEEDS))
    parser.add_argument("--only", nargs="+", default=[case.name for case in CASES])
    chosen = parser.parse_args(arguments)
    logs.configure("error")
    found = []
    for case in (case for case in CASES if case.name in chosen.only):
        for seed in chosen.seeds:
            found.append(measure(case, seed, chosen.folder))
            sys.stderr.write(f"{found[-1]}\n")
    sys.stdout.write("\n".join(table(found)) + "\n")


if __name__ == "__main__":
    main()
