"""Trains the step length network (METHODS C2) on walks with surveyed way-points, and says how it does on others.

    python -m proving_ground.evaluation.train_body DATA > .../pdr_engine/body/length/network_weights.py
    python -m proving_ground.evaluation.train_body DATA --cross-fit

Way-points tell no single step, but the distance between two of them: the lengths of the steps between, each times
the cosine of its direction against the chord, must sum to it. The error goes back through that sum and the network
to its weights (Levenberg–Marquardt, exact derivatives), with ridge on all weights, since a dozen walks of a mall
are few. Floors are flat: the inclination is only held at zero, its weights stay what the ridge makes them.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pdr_engine.body import BodySettings, BodyStepEstimate
from pdr_engine.body.length.network import MOST_LOG, USUAL_LENGTH_M, Network, inputs_of, with_one
from proving_ground.evaluation.alignment import interpolated
from proving_ground.evaluation.body import body_track, walk_body
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import FloatArray, Run

SET = "msindoor20"
HIDDEN = 4
SIGMA_M = 0.7  # of a distance between two way-points
RIDGE = 1.0
SEED = 6
_LEAST_STEPS = 3


@dataclass(frozen=True, slots=True)
class Interval:
    """The steps between two way-points: network inputs (k, 3), cosines against the chord (k,), distance m."""

    inputs: FloatArray
    cosines: FloatArray
    distance_m: float


def intervals_of(run: Run) -> list[Interval]:
    """All intervals of a run that hold some steps."""
    steps = walk_body(run.imus["body"], BodySettings(azimuth="gyro")).steps
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
    errors = []
    for index, own in enumerate(intervals):
        others = [one for j, some in enumerate(intervals) if (j - index) % 2 for one in some]
        errors.append(distance_error_pct(train(others), own))
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
        '"""Weights of `pdr_engine.body.length.network`; made of msindoor20 by '
        '`proving_ground.evaluation.train_body`."""\n\n'
        "import numpy as np\n\nfrom pdr_engine.body.length.network import Network\n\n"
        f"NETWORK = Network(\n    hidden=np.array([\n        {rows},\n    ]),\n"
        f"    output=np.array({_row(network.output)}),\n)\n"
    )


def _row(values: FloatArray) -> str:
    return "[" + ", ".join(f"{value:.6f}" for value in values) + "]"


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
    sys.stdout.write(module_text(train([one for run in runs for one in intervals_of(run)])))


if __name__ == "__main__":
    main(sys.argv[1:])
