"""The first hop's score: what the foot steps alone say, without satellites, the other foot or anything else.

Steps know neither where they start nor which way, so the chain is laid over the truth by a rigid fit of yaw and
offset, as `bootprint evaluate` does.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.messages import FootStep
from proving_ground.evaluation.alignment import fit_rigid, interpolated
from proving_ground.exercises.scoring.score import FloatArray, Row
from sensor_gateway.recordings.run import Truth

_NAMES = ("dead_reckoning_error_p50_m", "dead_reckoning_error_p95_m", "dead_reckoning_final_m")


def chain(steps: Sequence[FootStep], start_ns: int) -> tuple[FloatArray, FloatArray]:
    """Times s (n + 1,) and places m (n + 1, 2) of a foot's stances, from (0, 0) and heading along x."""
    ordered = sorted(steps, key=lambda step: step.time_ns)
    times = [ordered[0].start_time_ns]
    east, north, heading = 0.0, 0.0, 0.0
    places = [(east, north)]
    for step in ordered:
        forward, left, _ = step.displacement_m
        east += forward * math.cos(heading) - left * math.sin(heading)
        north += forward * math.sin(heading) + left * math.cos(heading)
        heading += step.heading_change_rad
        times.append(step.time_ns)
        places.append((east, north))
    return (np.array(times) - start_ns) / NS_PER_S, np.array(places)


def errors_m(steps: Sequence[FootStep], truth: Truth, start_ns: int) -> tuple[FloatArray, FloatArray] | None:
    """Times s (k,) and horizontal errors m (k,) of one foot's chain after the fit; None if nothing is shared."""
    if not steps:
        return None
    time_s, places_m = chain(steps, start_ns)
    at_s = truth.time_s[(truth.time_s >= time_s[0]) & (truth.time_s <= time_s[-1])]
    if at_s.size < 2:
        return None
    stepped = interpolated(at_s, time_s, places_m)
    true = interpolated(at_s, truth.time_s, truth.position_m[:, :2])
    return at_s, np.linalg.norm(fit_rigid(stepped, true).apply(stepped) - true, axis=1)


def dead_reckoning_row(steps: Mapping[str, Sequence[FootStep]], truth: Truth, start_ns: int) -> Row:
    """A soldier's figures, the mean of both feet; None where no foot was heard."""
    found = [errors_m(foot, truth, start_ns) for _, foot in sorted(steps.items())]
    feet = [error for each in found if each is not None for error in (each[1],)]
    if not feet:
        return dict.fromkeys(_NAMES)
    figures = [(np.percentile(foot, 50), np.percentile(foot, 95), foot[-1]) for foot in feet]
    return {name: float(value) for name, value in zip(_NAMES, np.mean(figures, axis=0), strict=True)}
