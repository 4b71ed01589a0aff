"""`bootprint benchmark body`: what the body module costs, over a recorded run or a walk at a simulated belt."""

import time
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from bootprint.commands.options import Json
from proving_ground.performance.cores import one_core
from proving_ground.performance.limits import conclude
from sensor_gateway.recordings.run import ImuSeries

RATE_HZ = 100.0
MOST_SHARE_PCT = 1.0  # of a core, at 100 Hz
_LEG_M = 150.0
_BATCH = 10


@dataclass(frozen=True, slots=True)
class BodyFigures:
    """µs of processor time a sample in batches, and the share of a core that 100 samples a second take."""

    samples: int
    steps: int
    us_per_sample: float
    core_pct: float


def body(
    path: Annotated[
        Path | None, typer.Argument(help="A recorded run (default: a simulated walk).", metavar="[PATH]")
    ] = None,
    turns: Annotated[int, typer.Option(help="Best of this many turns.", min=1)] = 3,
    check: Annotated[bool, typer.Option("--check", help="Exit 1 if the limit is missed.")] = False,
    json: Json = None,
) -> None:
    """Measure the body module: µs a sample in batches of ten, and the share of a core at 100 Hz.

    Example: bootprint benchmark body --check
    """
    figures = measure_body(walk_of(path), turns)
    keeps_limits = figures.core_pct <= MOST_SHARE_PCT
    conclude(asdict(figures), partial(_show, figures), keeps_limits=keeps_limits, json=json, check=check)


def _show(figures: BodyFigures) -> None:
    verdict = "holds" if figures.core_pct <= MOST_SHARE_PCT else "missed"
    typer.echo(
        f"{figures.us_per_sample:.1f} µs a sample over {figures.samples} samples and {figures.steps} steps: "
        f"{figures.core_pct:.2f} % of a core at 100 Hz (limit {MOST_SHARE_PCT:g} %: {verdict})"
    )


def walk_of(path: Path | None) -> ImuSeries:
    """The longest body-worn unit of the recorded runs, or one at the belt of a simulated person."""
    if path is None:
        return simulated_belt(seed=1)
    from sensor_gateway.recordings import load_runs

    units = [run.imus["body"] for run in load_runs([path], "body")]
    return max(units, key=lambda imu: len(imu.time_s))


def simulated_belt(seed: int) -> ImuSeries:
    """A person who walks straight on, 100 Hz."""
    from dataclasses import replace

    from scipy.spatial.transform import Rotation

    from proving_ground.people import Itinerary, Leg, Person, move
    from proving_ground.sensors import Mounting, imu_class, measure_imu

    rng = np.random.default_rng(seed)
    way = np.array([[0.0, 0.0, 0.0], [_LEG_M, 0.0, 0.0]])
    motion = move(Person(), Itinerary((Leg("walk", way),)), seed)
    unit = replace(imu_class("consumer"), rate_hz=RATE_HZ, bandwidth_hz=0.4 * RATE_HZ)
    mounting = Mounting(np.array([0.12, 0.0, 0.0]), Rotation.from_euler("y", 0.1))
    return measure_imu(motion.torso, motion.duration_s, mounting, unit, None, rng)


def measure_body(imu: ImuSeries, turns: int) -> BodyFigures:
    """Least processor time of several turns."""
    with one_core():
        seconds, steps = min(_turn(imu) for _ in range(turns))
    us = 1e6 * seconds / len(imu.time_s)
    return BodyFigures(len(imu.time_s), steps, us, 100.0 * us * 1e-6 * RATE_HZ)


def _turn(imu: ImuSeries) -> tuple[float, int]:
    from pdr_engine.body import BodyNavigator

    navigator = BodyNavigator()
    time_ns = np.round(imu.time_s * 1e9).astype(np.int64)
    begin, steps = time.thread_time(), 0
    for start in range(0, len(time_ns), _BATCH):
        cut = slice(start, start + _BATCH)
        mag = None if imu.mag_ut is None else imu.mag_ut[cut]
        steps += len(navigator.process(time_ns[cut], imu.accel_m_s2[cut], imu.gyro_rad_s[cut], mag))
    return time.thread_time() - begin, steps
