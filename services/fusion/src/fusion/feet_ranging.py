"""A range between the own two feet, as a measurement of how far apart they stand (METHODS D10).

Taken while both stand only: poses of a swinging foot are a tenth of a second apart, in which it goes half a metre.
"""

from collections import Counter

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.messages import Range
from fusion.boots import Boots
from fusion.config import FusionConfig
from fusion.feet import Foot
from fusion.filter import Measurement
from fusion.models import body

_FRESH_NS = NS_PER_S // 5
_REPEATS = 10.0  # where the radios sit errs alike over so many


def is_between_feet(message: Range, soldier: str) -> bool:
    """Whether the range is to a foot of the soldier's own: ``soldier/right_foot``."""
    return message.peer.startswith(f"{soldier}/")


def hold_feet(boots: Boots, message: Range, config: FusionConfig, counters: Counter[str]) -> None:
    """Correct the boots by a range between the feet, if both stand, in the filter."""
    standing = [foot for foot in boots.feet.values() if foot.active and _stands(foot, message.time_ns)]
    if len(standing) != 2:
        return
    state = boots.filter.state
    one, other = ([(foot.block, foot.offset)] for foot in standing)
    way = body.position(state, one) - body.position(state, other)
    apart_m = float(np.linalg.norm(way))
    if apart_m <= config.peers.feet_sigma_m:
        return
    jacobian = way / apart_m @ (body.position_jacobian(state, one) - body.position_jacobian(state, other))
    noise = np.array([[config.peers.feet_sigma_m**2 + (message.sigma_m or 0.0) ** 2]])
    found = boots.correct(
        Measurement(
            "range",
            np.array([message.distance_m - apart_m]),
            jacobian[None, :],
            _REPEATS * noise,
            gate_noise=noise,
            gate_probability=config.boots.gate_probability,
            relative=True,
        )
    )
    counters["feet_ranges" if found.accepted else "feet_ranges_refused"] += 1


def _stands(foot: Foot, now_ns: int) -> bool:
    return (
        foot.pose is not None
        and foot.pose.in_stance
        and foot.heard_ns is not None
        and now_ns - foot.heard_ns <= _FRESH_NS
    )
