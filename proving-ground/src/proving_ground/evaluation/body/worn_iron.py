"""A compass whose wearer has put on iron (METHODS A5 on line): around blocks with and without calibrating itself.

The iron is there from the first step, of a size that gear at a vest makes. Errors are of the compass and of the
default azimuth, from the second half of the walk on: the first is what there is to learn from.

python -m proving_ground.evaluation.body.worn_iron
"""

import math

import numpy as np
import typer

from pdr_engine.body import BodyNavigator, BodySettings
from pdr_engine.body.pieces import FloatArray
from proving_ground.evaluation.body.azimuth import CENTRAL_EUROPE, calibrated_unit, torso_azimuths
from proving_ground.evaluation.body.azimuth_chain import rms_deg, scored, through
from proving_ground.people import Itinerary, Leg, Person, move
from proving_ground.sensors import DeviceIron, Magnetics, Mounting, measure_imu
from sensor_gateway.recordings.run import ImuSeries

HARD_UT = (0.0, 3.0, 6.0)  # level, in directions drawn by the seed
_SOFT_SIGMA = 0.01
_BLOCK_M, _ROUNDS = 50.0, 2


def around_blocks(seed: int, hard_ut: float) -> tuple[ImuSeries, FloatArray]:
    """A unit on the trunk around blocks outdoors, iron worn with it, and the torso's true azimuths (n,)."""
    rng = np.random.default_rng(seed)
    person, towards = Person.drawn(rng), rng.uniform(0.0, 2.0 * math.pi)
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    way = _BLOCK_M * np.vstack([np.tile(corners, (_ROUNDS, 1)), corners[:1]])
    motion = move(person, Itinerary((Leg("walk", way),), start_s=3.0), seed)
    hard = hard_ut * np.array([math.cos(towards), math.sin(towards), 0.5])
    soft = np.eye(3) + np.diag(rng.normal(0.0, _SOFT_SIGMA, 3))
    magnetics = Magnetics(CENTRAL_EUROPE, device=DeviceIron(hard, soft))
    imu = measure_imu(motion.torso, motion.duration_s, Mounting(), calibrated_unit(), magnetics, rng)
    return imu, torso_azimuths(motion.torso, imu.time_s)


def worn_iron_deg(seed: int, hard_ut: float) -> FloatArray:
    """RMS error (2, 2), degrees: without and with on-line calibration; of the compass, of the default azimuth."""
    imu, truth = around_blocks(seed, hard_ut)
    errors = []
    for learns in (False, True):
        navigator = BodyNavigator(BodySettings(retrace=False, classes=False, online_calibration=learns))
        navigator.know_earth_field(CENTRAL_EUROPE)
        walk = scored(through(navigator, imu), imu, truth)
        late = walk.end_s > 0.5 * walk.end_s[-1]
        errors.append([rms_deg(walk.compass_error_rad[late]), rms_deg(walk.error_rad[late])])
    return np.array(errors)


def worn_iron_table(seeds: range = range(1, 6, 2)) -> str:
    """Markdown: a row for each size of iron."""
    lines = [
        "| iron put on µT | walks | compass ° | default ° | compass calibrated on line ° | default then ° |",
        "|--:|--:|---|---|---|---|",
    ]
    for hard_ut in HARD_UT:
        errors = np.array([worn_iron_deg(seed, hard_ut).ravel() for seed in seeds])
        cells = (f"{error.mean():.1f} ({error.max():.1f})" for error in errors.T)
        lines.append(f"| {hard_ut:g} | {len(errors)} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    typer.echo(worn_iron_table())
