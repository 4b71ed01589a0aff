"""How well is the heading known at the door? ``python -m proving_ground.evaluation.fusion.door_heading``.

Soldiers without a start walk in the open with a receiver for some metres, then no satellite is seen any more. The
same messages are fused with the receiver's speed and course and without them; seeds are odd (choices were made on
even ones). Boots have no compass here: it would tell the heading by itself.
"""

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.geodesy import wrap_angle
from bootprint.messages import GnssFix
from fusion.config import FusionConfig
from fusion.engine import FusionCore
from proving_ground.evaluation.fusion.spoofing import (
    FEET,
    ORIGIN,
    SPEED_M_S,
    T0,
    WHO,
    Trial,
    Walk,
    fixes_told,
    stance,
    steps_told,
)

SEEDS = tuple(range(1, 21, 2))
DOORS_M = (10.0, 20.0, 40.0, 80.0)
_FIRST_FIX_S = 31.0  # the receiver's own start
_INSIDE_S = 10.0


@dataclass(frozen=True, slots=True)
class AtDoor:
    """Heading error, degrees; None if the soldier was not placed. ``sigma_deg``: what fusion says of it."""

    error_deg: float | None
    sigma_deg: float | None


def at_door(seed: int, door_m: float, *, courses: bool) -> AtDoor:
    """One soldier who stands until the receiver has its first fix, and then walks ``door_m`` to the door."""
    until_s = _FIRST_FIX_S + door_m / SPEED_M_S
    trial = Trial(seed, until_s + _INSIDE_S, 0.0, math.inf, compass=False)
    rng = np.random.default_rng([seed, 11])
    walk = Walk.drawn(trial.duration_s, rng)
    core = FusionCore(FusionConfig(rate_hz=1.0), WHO, ORIGIN, patient=True)
    for envelope in _heard(walk, trial, until_s, courses, rng):
        list(core.handle(envelope))
    list(core.close())
    if not core.estimator.placed:
        return AtDoor(None, None)
    return _error(core, walk)


def _heard(
    walk: Walk, trial: Trial, until_s: float, courses: bool, rng: np.random.Generator
) -> Iterator[Envelope]:
    """Steps from the receiver's first fix on, fixes until the door."""
    first_ns, door_ns = (T0 + round(at_s * NS_PER_S) for at_s in (_FIRST_FIX_S, until_s))
    steps = [one for one in steps_told(walk, trial, rng) if one.message.time_ns >= first_ns]
    fixes = [one for one in fixes_told(walk, trial, rng) if one.message.time_ns <= door_ns]
    yield from sorted(
        [*steps, *(one if courses else _without_course(one) for one in fixes)],
        key=lambda one: (one.message.time_ns, one.address.key),
    )


def _without_course(envelope: Envelope) -> Envelope:
    message = envelope.message
    if isinstance(message, GnssFix):
        message = msgspec.structs.replace(message, speed_m_s=None, course_rad=None)
    return Envelope(envelope.address, message)


def _error(core: FusionCore, walk: Walk) -> AtDoor:
    """Of the feet's mean yaw, at their last steps."""
    boots = core.estimator.boots
    errors, yaws = [], []
    for place, mounting, beside, _ in FEET:
        foot = boots.feet[place]
        if not foot.active or foot.end_ns is None:
            continue
        true = stance(walk, (foot.end_ns - T0) / NS_PER_S, mounting, beside)[2]
        errors.append(wrap_angle(float(boots.filter.state[foot.block.yaw]) - true))
        yaws.append(foot.block.yaw)
    variance = float(np.mean(boots.filter.covariance[np.ix_(yaws, yaws)]))
    return AtDoor(math.degrees(float(np.mean(errors))), math.degrees(math.sqrt(variance)))


def table(seeds: Sequence[int] = SEEDS) -> list[str]:
    """Lines of a Markdown table."""
    lines = [
        "| walked in the open, m | courses | placed | heading error °, median | worst | σ told, mean |",
        "|--:|---|--:|--:|--:|--:|",
    ]
    for door_m in DOORS_M:
        for courses in (False, True):
            found = [at_door(seed, door_m, courses=courses) for seed in seeds]
            lines.append(_row(door_m, courses, found))
    return lines


def _row(door_m: float, courses: bool, found: Sequence[AtDoor]) -> str:
    errors = np.abs([one.error_deg for one in found if one.error_deg is not None])
    sigmas = [one.sigma_deg for one in found if one.sigma_deg is not None]
    told = " | – | – | – |"
    if sigmas:
        told = f" | {np.median(errors):.1f} | {errors.max():.1f} | {np.mean(sigmas):.1f} |"
    return f"| {door_m:.0f} | {'yes' if courses else 'no'} | {len(sigmas)} of {len(found)}{told}"


if __name__ == "__main__":
    sys.stdout.write("\n".join(table()) + "\n")
