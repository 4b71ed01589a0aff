"""Trains the step length network (METHODS C2) on walks with surveyed way-points, and says how it does on others.

    python -m proving_ground.evaluation.body.train DATA > .../pdr_engine/body/length/network_weights.py
    python -m proving_ground.evaluation.body.train DATA --cross-fit
    python -m proving_ground.evaluation.body.train DATA --slopes

Way-points tell no single step, but the distance between two of them: the lengths of the steps between, each times
the cosine of its direction against the chord, must sum to it. The error goes back through that sum and the network
to its weights (Levenberg–Marquardt, exact derivatives), with ridge on all weights, since a dozen walks of a mall
are few.

Floors are flat, so slopes are simulated (`slope_intervals`): what they tell is how a step changes by inclination
against the same person's steps on the level, whose gait and length are put in the place of the usual ones. Half of
the simulated people train, the others judge (``--slopes``).
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pdr_engine.body import BodySettings, BodyStepEstimate
from pdr_engine.body.length.network import MOST_LOG, USUAL, USUAL_LENGTH_M, Network, inputs_of, with_one
from proving_ground.evaluation.alignment import interpolated
from proving_ground.evaluation.body.recorded_run import body_track, walk_body
from proving_ground.people import Itinerary, Leg, Person, move
from proving_ground.sensors import Mounting, imu_class, measure_imu
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import FloatArray, Run

SET = "msindoor20"
HIDDEN = 4
SIGMA_M = 0.7  # of a distance between two way-points
RIDGE = 1.0
SEED = 6
GRADES = (-0.15, -0.1, -0.05, 0.05, 0.1, 0.15)
SLOPE_M = 40.0
TRAINING_SEEDS, JUDGING_SEEDS = range(2, 12, 2), range(1, 8, 2)
_LEAST_STEPS = 3


@dataclass(frozen=True, slots=True)
class Interval:
    """The steps between two way-points: network inputs (k, 3), cosines against the chord (k,), distance m."""

    inputs: FloatArray
    cosines: FloatArray
    distance_m: float


def intervals_of(run: Run) -> list[Interval]:
    """All intervals of a run that hold some steps."""
    steps = walk_body(run, BodySettings(azimuth="gyro")).steps
    truth, track = run.truth["body"], body_track(steps, run.imus["body"])
    chords = np.diff(interpolated(truth.time_s, track.time_s, track.position_m)[:, :2], axis=0)
    distances = np.linalg.norm(np.diff(truth.position_m[:, :2], axis=0), axis=1)
    ends = np.array([step.time_ns * 1e-9 for step in steps])
    found = []
    for index, (chord, distance) in enumerate(zip(chords, distances, strict=True)):
        inside = np.flatnonzero((ends > truth.time_s[index]) & (ends <= truth.time_s[index + 1]))
        if len(inside) >= _LEAST_STEPS:
            found.append(_interval([steps[i] for i in inside], chord, float(distance)))
    return found


def _interval(steps: Sequence[BodyStepEstimate], chord: FloatArray, distance_m: float) -> Interval:
    azimuth = np.array([step.azimuth_rad for step in steps])
    towards = np.arctan2(chord[0], chord[1])
    inputs = inputs_of(
        np.array([step.gait.frequency_hz for step in steps]),
        np.array([step.gait.variance_m2_s4 for step in steps]),
        np.zeros(len(steps)),
    )
    return Interval(inputs, np.cos(azimuth - towards), distance_m)


def slope_intervals(seeds: Sequence[int]) -> list[Interval]:
    """Simulated people up and down slopes and on the level; each slope's steps are one interval."""
    return [interval for seed in seeds for interval in _person_on_slopes(seed)]


def _person_on_slopes(seed: int) -> list[Interval]:
    person = Person.drawn(np.random.default_rng(seed))
    walks = {grade: _gaits_on(person, grade, seed) for grade in (0.0, *GRADES)}
    level, level_m = walks[0.0]
    usual = np.log(level).mean(axis=0) - USUAL
    found = []
    for grade, (gaits, step_m) in walks.items():
        relative = np.exp(np.log(gaits) - usual)
        inputs = inputs_of(relative[:, 0], relative[:, 1], np.full(len(gaits), np.arctan(grade)))
        found.append(Interval(inputs, np.ones(len(gaits)), len(gaits) * USUAL_LENGTH_M * step_m / level_m))
    return found


def _gaits_on(person: Person, grade: float, seed: int) -> tuple[FloatArray, float]:
    """Frequency and variance (n, 2) of the steps on a slope, and their mean length along it, m."""
    way = np.array([[0.0, 0.0, 0.0], [SLOPE_M, 0.0, grade * SLOPE_M]])
    motion = move(person, Itinerary((Leg("walk", way),), start_s=3.0), seed)
    imu = measure_imu(
        motion.torso,
        motion.duration_s,
        Mounting(),
        imu_class("industrial"),
        None,
        np.random.default_rng(seed),
    )
    run = Run("slope", "body", Path("slope"), {"body": imu})
    steps = walk_body(run, BodySettings(azimuth="gyro")).steps[4:-4]  # without starting and stopping
    times_s = [steps[0].start_ns * 1e-9, steps[-1].time_ns * 1e-9]
    begin, end = motion.torso.at(np.array(times_s))[0]
    gaits = np.array([[step.gait.frequency_hz, step.gait.variance_m2_s4] for step in steps])
    return gaits, float(np.linalg.norm(end - begin)) / len(steps)


def train(intervals: Sequence[Interval], seed: int = SEED) -> Network:
    """The network that fits these intervals best, from random weights of this seed."""
    from scipy.optimize import least_squares

    inputs = np.concatenate([interval.inputs for interval in intervals])
    owner = np.repeat(np.arange(len(intervals)), [len(interval.inputs) for interval in intervals])
    cosines = np.concatenate([interval.cosines for interval in intervals])
    distances = np.array([interval.distance_m for interval in intervals])

    def residuals(weights: FloatArray) -> FloatArray:
        lengths = USUAL_LENGTH_M * np.exp(_network(weights).log_length(inputs))
        sums = np.bincount(owner, lengths * cosines, len(intervals))
        return np.concatenate([(sums - distances) / SIGMA_M, np.sqrt(RIDGE) * weights])

    def derivatives(weights: FloatArray) -> FloatArray:
        rows = np.zeros((len(intervals), len(weights)))
        np.add.at(rows, owner, cosines[:, None] * length_gradients(_network(weights), inputs))
        return np.vstack([rows / SIGMA_M, np.sqrt(RIDGE) * np.eye(len(weights))])

    start = 0.1 * np.random.default_rng(seed).standard_normal(HIDDEN * 5 + 1)
    return _network(least_squares(residuals, start, derivatives, loss="soft_l1").x)


def length_gradients(network: Network, inputs: FloatArray) -> FloatArray:
    """∂ length / ∂ weights (hidden row by row, then output) of every step, (n, weights): back-propagation."""
    layer = np.tanh(with_one(inputs) @ network.hidden.T)
    out = with_one(layer) @ network.output
    squashed = np.tanh(out / MOST_LOG)
    by_out = USUAL_LENGTH_M * np.exp(MOST_LOG * squashed) * (1.0 - squashed**2)
    by_layer = by_out[:, None] * network.output[:-1] * (1.0 - layer**2)
    by_hidden = (by_layer[:, :, None] * with_one(inputs)[:, None, :]).reshape(len(inputs), -1)
    return np.column_stack([by_hidden, by_out[:, None] * with_one(layer)])


def _network(weights: FloatArray) -> Network:
    return Network(weights[: HIDDEN * 4].reshape(HIDDEN, 4), weights[HIDDEN * 4 :])


def cross_fit(runs: Sequence[Run]) -> list[float]:
    """Distance errors, in per cent of a whole walk's, of every run by the network that saw the other half."""
    intervals = [intervals_of(run) for run in runs]
    slopes = slope_intervals(TRAINING_SEEDS)
    errors = []
    for index, own in enumerate(intervals):
        others = [one for j, some in enumerate(intervals) if (j - index) % 2 for one in some]
        errors.append(distance_error_pct(train([*others, *slopes]), own))
    return errors


def distance_error_pct(network: Network, intervals: Sequence[Interval]) -> float:
    """Of the sum of the intervals' distances."""
    found = [
        float(USUAL_LENGTH_M * np.exp(network.log_length(one.inputs)) @ one.cosines) for one in intervals
    ]
    true = sum(one.distance_m for one in intervals)
    return 100.0 * (sum(found) - true) / true


def module_text(network: Network) -> str:
    """The weights as a module."""
    rows = ",\n        ".join(_row(row) for row in network.hidden)
    return (
        '"""Weights of `pdr_engine.body.length.network`, made by `proving_ground.evaluation.body.train` of '
        'recorded walks\n(msindoor20) and simulated slopes.\n"""\n\n'
        "import numpy as np\n\nfrom pdr_engine.body.length.network import Network\n\n"
        f"NETWORK = Network(\n    hidden=np.array([\n        {rows},\n    ]),\n"
        f"    output=np.array({_row(network.output)}),\n)\n"
    )


def _row(values: FloatArray) -> str:
    return "[" + ", ".join(f"{value:.6f}" for value in values) + "]"


def _slopes_text(networks: dict[str, Network]) -> str:
    """How far off networks are on the slopes of people who did not train them, per cent."""
    judged = slope_intervals(JUDGING_SEEDS)
    lines = []
    for name, network in networks.items():
        errors = np.abs([distance_error_pct(network, [one]) for one in judged])
        lines.append(
            f"{name}: mean |error| {errors.mean():.2f} %, worst {errors.max():.2f} % (n {len(errors)})"
        )
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str]) -> None:
    """The command."""
    runs = load_runs([Path(arguments[0]) / SET], "body")
    if arguments[1:2] == ["--cross-fit"]:
        errors = np.array(cross_fit(runs))
        sys.stdout.write(
            f"held-out halves: mean |distance error| {np.abs(errors).mean():.2f} %, worst "
            f"{np.abs(errors).max():.2f} %, mean {errors.mean():.2f} % (n {len(errors)})\n"
        )
        return
    intervals = [one for run in runs for one in intervals_of(run)]
    network = train([*intervals, *slope_intervals(TRAINING_SEEDS)])
    if arguments[1:2] == ["--slopes"]:
        sys.stdout.write(_slopes_text({"with inclination": network, "without": train(intervals)}))
        return
    sys.stdout.write(module_text(network))


if __name__ == "__main__":
    main(sys.argv[1:])
