"""How alike two strides are: what tells legs, which repeat, from a road, which does not.

A stride is a left and a right step. Walking, every axis of acceleration and rate of turn repeats with it: the trunk
bounces and surges with each step, sways, twists and rolls with each stride (stride regularity by autocorrelation,
Moe-Nilssen and Helbostad 2004). A vehicle on its springs keeps a rhythm of sorts, but shakes anew each time.
"""

import math

import numpy as np

from bootprint.messages import Float64Array

_PHASES = 8  # of a stride: two steps up and down; what is quicker jitters with the heel and proves nothing
_KINDS = (slice(0, 3), slice(3, 6))  # accelerations and rates weigh the same, whatever their units
_LEAST = 1e-9


def likeness(one: Float64Array, other: Float64Array) -> float:
    """Correlation, −1 to 1, of two strides of level accelerations and rates (n, 6) and (m, 6), by phase."""
    first, second = _by_phase(one), _by_phase(other)
    return sum(_correlation(first[:, kind], second[:, kind]) for kind in _KINDS) / len(_KINDS)


def _by_phase(values: Float64Array) -> Float64Array:
    """Means over equal parts of the stride (`_PHASES`, 6), free of the stride's own mean."""
    count = len(values)
    edges = np.linspace(0.0, count, _PHASES + 1)
    sums = np.vstack([np.zeros(values.shape[1]), np.cumsum(values, axis=0)])
    at_edges = np.column_stack([np.interp(edges, np.arange(count + 1), column) for column in sums.T])
    parts = np.diff(at_edges, axis=0)
    return np.asarray(parts - parts.mean(axis=0))


def _correlation(one: Float64Array, other: Float64Array) -> float:
    size = math.sqrt(float(np.sum(one**2)) * float(np.sum(other**2)))
    return float(np.sum(one * other)) / size if size > _LEAST else 0.0
