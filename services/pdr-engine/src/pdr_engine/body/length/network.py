"""METHODS C2: step length by a small neural network of frequency, variance of acceleration, and inclination.

One hidden layer of tanh units on logarithms; the output is the logarithm of the length against a usual step. Inputs
are held within what the network was trained on, so that it can never run away; the output is bounded besides.
Weights: `network_weights`, made by ``python -m proving_ground.evaluation.body.train DATA``.
"""

import math
from dataclasses import dataclass

import numpy as np

from bootprint.messages import Float64Array

USUAL_LENGTH_M = 0.68
USUAL = np.log([1.9, 8.0])  # frequency Hz, variance m²/s⁴
SPREAD = np.array([0.15, 0.8, 0.1])
MOST_SPREADS = 2.5
MOST_LOG = math.log(2.0)  # the length is within half and twice the usual


@dataclass(frozen=True, slots=True)
class Network:
    """``hidden`` (h, 4) and ``output`` (h + 1,): weights with the constant last."""

    hidden: Float64Array
    output: Float64Array

    def log_length(self, inputs: Float64Array) -> Float64Array:
        """Logarithm of length over usual length, (n,), of inputs (n, 3) as `inputs_of` gives them."""
        layer = np.tanh(with_one(inputs) @ self.hidden.T)
        return bounded(np.asarray(with_one(layer) @ self.output, dtype=np.float64))

    def length_m(self, frequency_hz: float, variance_m2_s4: float, inclination_rad: float) -> float:
        """Of one step."""
        inputs = inputs_of(np.array([frequency_hz]), np.array([variance_m2_s4]), np.array([inclination_rad]))
        return USUAL_LENGTH_M * math.exp(float(self.log_length(inputs)[0]))

    def layer(self, frequency_hz: float, variance_m2_s4: float, inclination_rad: float) -> tuple[float, ...]:
        """The hidden layer's outputs (h,) for one step."""
        inputs = inputs_of(np.array([frequency_hz]), np.array([variance_m2_s4]), np.array([inclination_rad]))
        return tuple(np.tanh(with_one(inputs) @ self.hidden.T)[0].tolist())


def bounded(log_length: Float64Array) -> Float64Array:
    """The same within ±`MOST_LOG`, smoothly."""
    return np.multiply(MOST_LOG, np.tanh(log_length / MOST_LOG))


def inputs_of(
    frequency_hz: Float64Array, variance_m2_s4: Float64Array, inclination_rad: Float64Array
) -> Float64Array:
    """Standardised and bounded inputs (n, 3)."""
    logs = np.log(np.column_stack([frequency_hz, np.maximum(variance_m2_s4, 1e-3)])) - USUAL
    inputs = np.column_stack([logs, inclination_rad]) / SPREAD
    return np.asarray(np.clip(inputs, -MOST_SPREADS, MOST_SPREADS), dtype=np.float64)


def with_one(values: Float64Array) -> Float64Array:
    """A column of ones after (n, k) values."""
    return np.column_stack([values, np.ones(len(values))])
