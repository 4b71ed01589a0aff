"""Trains the learned stance detector of the foot INS on motion capture and writes its weights.

python -m proving_ground.evaluation.train_stance DATA [--half even|odd] > weights.py  (of `pdr_engine.foot`)

Training data: pyshoe-vicon (Wagstaff, Peretroukhin and Kelly, University of Toronto; MIT licence), whose truth
gives the foot's velocity at every sample. The network learns ln σ, the scale of that velocity v, by maximum
likelihood under Student's t in three dimensions, ν = 3: the loss of a sample is

    3 ln σ + (ν + 3)/2 · ln(1 + |v|²/(ν σ²)),

whose heavy tails forgive the truth's glitches. The truth's own noise, 1 cm/s, is added to |v|², and long standing
weighs less than motion. Features and size were chosen by training on the trials of even number and looking at those
of odd number, and the other way round (``--half``).
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.signal import savgol_filter

from pdr_engine.foot import FootNavigator, FootSettings
from pdr_engine.foot.learned import tabulate
from pdr_engine.foot.memory import FEATURES, HIDDEN, SAMPLE, fresh_state, parameters
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import ImuSeries, Run

FloatArray = npt.NDArray[np.float64]
SET = "pyshoe-vicon"
NU = 3.0
TRUTH_NOISE_M_S = 0.01
AHEAD_S = 0.041  # what the features look ahead, and a little
STRIDE_RATE_FEATURE, STANDING_BELOW, STANDING_WEIGHT = 11, -6.0, 0.15
EVERY = 3  # neighbours tell the same
DECAY = 1e-4
ITERATIONS = 400
VELOCITY_SAMPLES = 11  # of the truth's smoothed derivative: 55 ms


@dataclass(frozen=True, slots=True)
class Examples:
    """``features`` (n, FEATURES), ``speed_m_s`` (n,) of the foot by the truth, ``weight`` (n,)."""

    features: FloatArray
    speed_m_s: FloatArray
    weight: FloatArray

    @staticmethod
    def joined(parts: Sequence["Examples"]) -> "Examples":
        """All in one table."""
        return Examples(
            np.vstack([part.features for part in parts]),
            np.concatenate([part.speed_m_s for part in parts]),
            np.concatenate([part.weight for part in parts]),
        )


@dataclass(frozen=True, slots=True)
class Network:
    """ln σ = bias + Σ output_k · u/(1 + |u|), u = hidden_bias_k + inputs_k · x."""

    inputs: FloatArray
    hidden_bias: FloatArray
    output: FloatArray
    bias: float

    @staticmethod
    def unpacked(vector: FloatArray) -> "Network":
        """From the vector that is optimised."""
        inputs, hidden, output = np.split(vector[:-1], [HIDDEN * FEATURES, HIDDEN * (FEATURES + 1)])
        return Network(inputs.reshape(HIDDEN, FEATURES), hidden, output, float(vector[-1]))

    def behind(self, mean: FloatArray, scale: FloatArray) -> "Network":
        """The network of raw features that equals this one of features less ``mean``, over ``scale``."""
        inputs = self.inputs / scale
        return Network(inputs, self.hidden_bias - inputs @ mean, self.output, self.bias)


def training_runs(data: Path) -> list[Run]:
    """The runs of the training set that know every foot's own way; none if the set is not there."""
    runs = load_runs([data / SET]) if (data / SET).is_dir() else []
    return [run for run in runs if set(run.imus) <= set(run.truth)]


def examples_of(run: Run, place: str) -> Examples:
    """Features of every third sample of a foot, and its true speed there."""
    imu, truth = run.imus[place], run.truth[place]
    position = np.column_stack([np.interp(imu.time_s, truth.time_s, axis) for axis in truth.position_m.T])
    interval_s = float(np.median(np.diff(imu.time_s)))
    velocity = savgol_filter(position, VELOCITY_SAMPLES, 2, deriv=1, delta=interval_s, axis=0)
    features = features_of(imu)
    weight = np.where(features[:, STRIDE_RATE_FEATURE] < STANDING_BELOW, STANDING_WEIGHT, 1.0)
    speed = np.linalg.norm(velocity, axis=1)
    return Examples(features[::EVERY], speed[::EVERY], weight[::EVERY])


def features_of(imu: ImuSeries) -> FloatArray:
    """What the kernel sees at every sample, (n, FEATURES), with the gyro bias that the run ends with."""
    settings = FootSettings(method="adaptive")
    batch = np.zeros(len(imu.time_s), SAMPLE)
    batch["time_ns"] = np.round((imu.time_s - imu.time_s[0]) * 1e9)
    batch["accel"], batch["gyro"] = imu.accel_m_s2, imu.gyro_rad_s
    navigator = FootNavigator(settings)
    navigator.process(batch["time_ns"], imu.accel_m_s2, imu.gyro_rad_s)
    navigator.finish()
    rows = np.zeros((len(batch), FEATURES))
    ahead = int(np.ceil(AHEAD_S / np.median(np.diff(imu.time_s))))
    tabulate(fresh_state(settings), parameters(settings), batch, navigator.gyro_bias_rad_s, ahead, rows)
    return rows


def loss(vector: FloatArray, examples: Examples) -> tuple[float, FloatArray]:
    """Mean loss of the examples, with weight decay, and its gradient."""
    net, x = Network.unpacked(vector), examples.features
    u = x @ net.inputs.T + net.hidden_bias
    slope = 1.0 / (1.0 + np.abs(u))
    log_sigma = (u * slope) @ net.output + net.bias
    ratio = (examples.speed_m_s**2 + TRUTH_NOISE_M_S**2) * np.exp(-2.0 * log_sigma) / NU
    share = examples.weight / examples.weight.sum()
    value = share @ (3.0 * log_sigma + (NU + 3.0) / 2.0 * np.log1p(ratio))
    pull = share * (3.0 - (NU + 3.0) * ratio / (1.0 + ratio))
    by_hidden = np.outer(pull, net.output) * slope**2
    by_inputs = by_hidden.T @ x + 2.0 * DECAY * net.inputs
    by_output = (u * slope).T @ pull + 2.0 * DECAY * net.output
    decay = DECAY * float((net.inputs**2).sum() + (net.output**2).sum())
    gradient = np.concatenate([by_inputs.ravel(), by_hidden.sum(axis=0), by_output, [pull.sum()]])
    return float(value) + decay, gradient


def train(examples: Examples) -> Network:
    """The network that explains the examples; the same for the same examples."""
    mean, scale = examples.features.mean(axis=0), examples.features.std(axis=0)
    normal = Examples((examples.features - mean) / scale, examples.speed_m_s, examples.weight)
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


def source_of(net: Network) -> str:
    """The weights as a module."""
    lines = [
        '"""Weights of the learned stance detector. Made by `python -m proving_ground.evaluation.train_stance`.',
        "",
        f"Trained on {SET} (Wagstaff, Peretroukhin and Kelly, University of Toronto; MIT licence).",
        '"""',
        "",
        "import numpy as np",
        "",
        f"BIAS = {net.bias:.6g}",
    ]
    for name, values in (("HIDDEN_BIAS", net.hidden_bias), ("OUTPUT", net.output)):
        lines += [f"{name} = np.array(", f"    {_row(values)}", ")"]
    rows = [f"        {_row(row)}," for row in net.inputs]
    return "\n".join([*lines, "INPUT = np.array(", "    [", *rows, "    ]", ")", ""])


def _row(values: FloatArray) -> str:
    return "[" + ", ".join(f"{value:.6g}" for value in values) + "]"


def main(data: Path, half: str | None) -> None:
    """Train on the set's runs (of even or odd number, if asked) and write the module to standard output."""
    runs = training_runs(data)
    first, step = {"even": (0, 2), "odd": (1, 2), None: (0, 1)}[half]
    parts = [examples_of(run, place) for run in runs[first::step] for place in run.imus]
    sys.stdout.write(source_of(train(Examples.joined(parts))))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Train the learned stance detector.")
    parser.add_argument("data", type=Path)
    parser.add_argument("--half", choices=("even", "odd"))
    options = parser.parse_args()
    main(options.data, options.half)
