"""Trains the learned stance detector of the foot INS on motion capture and writes its weights.

python -m proving_ground.evaluation.foot.train_stance DATA [--half even|odd] > weights.py  (of `pdr_engine.foot`)

First the network learns ln σ, the scale of a foot's velocity v, from pyshoe-vicon by maximum likelihood under
Student's t in three dimensions, ν = 3: a sample's loss is

    3 ln σ + (ν + 3)/2 · ln(1 + |v|²/(ν σ²)),

whose heavy tails forgive the truth's glitches. Then, with that σ as it is, two more outputs of the same hidden
units learn the mean of the sole's v/σ along the step's way and up (`fit_motion`), from all sets whose truth follows
the foot (`stance_examples.SETS`). The truth's own noise, 1 cm/s, is added to |v|², and long standing weighs less
than motion. Features and size were chosen by training on the feet of even number in each set and looking at those
of odd number, and the other way round (``--half``).
"""

import argparse
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from pdr_engine.foot.memory import FEATURES, HIDDEN
from proving_ground.evaluation.foot.stance_examples import (
    SETS,
    Examples,
    examples_of,
    speed_examples_of,
    training_feet,
)

FloatArray = npt.NDArray[np.float64]
NU = 3.0
TRUTH_NOISE_M_S = 0.01
DECAY, MOTION_DECAY = 1e-4, 1e-3
ITERATIONS = 400


@dataclass(frozen=True, slots=True)
class Network:
    """ln σ = bias + output·h, mean/σ = motion_bias + motion·h with h = u/(1 + |u|), u = hidden_bias + inputs·x.

    ``inputs`` (HIDDEN, FEATURES), ``hidden_bias`` and ``output`` (HIDDEN,), ``motion`` (2, HIDDEN): along and up.
    """

    inputs: FloatArray
    hidden_bias: FloatArray
    output: FloatArray
    bias: float
    motion: FloatArray
    motion_bias: FloatArray

    @staticmethod
    def unpacked(vector: FloatArray) -> "Network":
        """From the vector that is optimised first, without motion."""
        inputs, hidden, output = np.split(vector[:-1], [HIDDEN * FEATURES, HIDDEN * (FEATURES + 1)])
        none = np.zeros((2, HIDDEN)), np.zeros(2)
        return Network(inputs.reshape(HIDDEN, FEATURES), hidden, output, float(vector[-1]), *none)

    def behind(self, mean: FloatArray, scale: FloatArray) -> "Network":
        """The network of raw features that equals this one of features less ``mean``, over ``scale``."""
        inputs = self.inputs / scale
        return replace(self, inputs=inputs, hidden_bias=self.hidden_bias - inputs @ mean)

    def hidden(self, features: FloatArray) -> FloatArray:
        """h, (n, HIDDEN)."""
        u = features @ self.inputs.T + self.hidden_bias
        return np.asarray(u / (1.0 + np.abs(u)))

    def sigma(self, features: FloatArray) -> FloatArray:
        """σ, m/s, (n,)."""
        return np.asarray(np.exp(self.hidden(features) @ self.output + self.bias))


def loss(vector: FloatArray, examples: Examples) -> tuple[float, FloatArray]:
    """Mean loss of the examples by σ, with weight decay, and its gradient."""
    net, x = Network.unpacked(vector), examples.features
    u = x @ net.inputs.T + net.hidden_bias
    slope = 1.0 / (1.0 + np.abs(u))
    log_sigma = (u * slope) @ net.output + net.bias
    square = (examples.velocity_m_s**2).sum(axis=1) + TRUTH_NOISE_M_S**2
    ratio = square * np.exp(-2.0 * log_sigma) / NU
    share = examples.weight / examples.weight.sum()
    value = share @ (3.0 * log_sigma + (NU + 3.0) / 2.0 * np.log1p(ratio))
    pull = share * (3.0 - (NU + 3.0) * ratio / (1.0 + ratio))
    by_hidden = np.outer(pull, net.output) * slope**2
    by_inputs = by_hidden.T @ x + 2.0 * DECAY * net.inputs
    by_output = (u * slope).T @ pull + 2.0 * DECAY * net.output
    decay = DECAY * float((net.inputs**2).sum() + (net.output**2).sum())
    gradient = np.concatenate([by_inputs.ravel(), by_hidden.sum(axis=0), by_output, [pull.sum()]])
    return float(value) + decay, gradient


def motion_loss(vector: FloatArray, net: Network, examples: Examples) -> tuple[float, FloatArray]:
    """Mean loss of the examples by the mean motion (``vector``: rows of motion and its bias), and its gradient."""
    rows, h, sigma = (
        vector.reshape(2, HIDDEN + 1),
        net.hidden(examples.features),
        net.sigma(examples.features),
    )
    mean = h @ rows[:, :HIDDEN].T + rows[:, HIDDEN]
    mean[:, 0] *= examples.way
    left = examples.velocity_m_s / sigma[:, None]
    left[:, [0, 2]] -= mean
    ratio = ((left**2).sum(axis=1) + (TRUTH_NOISE_M_S / sigma) ** 2) / NU
    share = examples.weight / examples.weight.sum()
    pull = -share * (NU + 3.0) / NU / (1.0 + ratio)
    by_mean = np.column_stack([pull * left[:, 0] * examples.way, pull * left[:, 2]])
    by_motion = by_mean.T @ h + 2.0 * MOTION_DECAY * rows[:, :HIDDEN]
    value = share @ ((NU + 3.0) / 2.0 * np.log1p(ratio)) + MOTION_DECAY * (rows[:, :HIDDEN] ** 2).sum()
    return float(value), np.column_stack([by_motion, by_mean.sum(axis=0)]).ravel()


def train(examples: Examples) -> Network:
    """The network whose σ explains the examples, without motion; the same for the same examples."""
    mean, scale = examples.features.mean(axis=0), examples.features.std(axis=0)
    normal = replace(examples, features=(examples.features - mean) / scale)
    rng = np.random.default_rng(0)
    start = np.concatenate(
        [
            rng.normal(size=HIDDEN * FEATURES) / np.sqrt(FEATURES),
            0.3 * rng.normal(size=2 * HIDDEN),
            [-1.0],
        ]
    )
    found = minimize(
        loss, start, args=(normal,), jac=True, method="L-BFGS-B", options={"maxiter": ITERATIONS}
    )
    return Network.unpacked(np.asarray(found.x)).behind(mean, scale)


def fit_motion(net: Network, examples: Examples) -> Network:
    """The network with the mean motion that explains the examples best; its σ stays."""
    start = np.zeros(2 * (HIDDEN + 1))
    found = minimize(motion_loss, start, args=(net, examples), jac=True, method="L-BFGS-B")
    rows = np.asarray(found.x).reshape(2, HIDDEN + 1)
    return replace(net, motion=rows[:, :HIDDEN], motion_bias=rows[:, HIDDEN])


def source_of(net: Network) -> str:
    """The weights as a module."""
    lines = [
        '"""Weights of the learned stance detector, by `python -m proving_ground.evaluation.foot.train_stance`.',
        "",
        "Trained on pyshoe-vicon (Wagstaff, Peretroukhin and Kelly, University of Toronto), gaitmap-example",
        "(MaD Lab, FAU) and dualfoot-fgo (Hu and Hu), all under the MIT licence.",
        '"""',
        "",
        "import numpy as np",
        "",
        f"BIAS = {net.bias:.6g}",
        f"MOTION_BIAS = np.array({_row(net.motion_bias)})",
    ]
    for name, values in (("HIDDEN_BIAS", net.hidden_bias), ("OUTPUT", net.output)):
        lines += [f"{name} = np.array(", f"    {_row(values)}", ")"]
    for name, table in (("MOTION", net.motion), ("INPUT", net.inputs)):
        lines += [f"{name} = np.array(", "    [", *(f"        {_row(row)}," for row in table), "    ]", ")"]
    return "\n".join([*lines, ""])


def _row(values: FloatArray) -> str:
    return "[" + ", ".join(f"{value:.6g}" for value in values) + "]"


def main(data: Path, half: str | None) -> None:
    """Train on the sets' feet (of even or odd number, if asked) and write the module to standard output."""
    first, step = {"even": (0, 2), "odd": (1, 2), None: (0, 1)}[half]
    feet = {name: training_feet(data, name)[first::step] for name in SETS}
    speeds = [speed_examples_of(run, place) for run, place in feet[SETS[0]]]
    motions = [examples_of(run, place) for name in SETS for run, place in feet[name]]
    net = fit_motion(train(Examples.joined(speeds)), Examples.joined(motions))
    sys.stdout.write(source_of(net))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Train the learned stance detector.")
    parser.add_argument("data", type=Path)
    parser.add_argument("--half", choices=("even", "odd"))
    options = parser.parse_args()
    main(options.data, options.half)
