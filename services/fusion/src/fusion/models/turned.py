"""Where a body may be whose heading is doubtful: on an arc, not on the tangent that a linear filter sees.

A filter tells how a position errs with yaw, ``a = Cov(p, ψ)/σ²`` (m/rad). That is a turn about a point which is
``l = (a_north, −a_east)`` away: ``δp = a·sin δψ − l·(1 − cos δψ)``. With δψ normal its second moments are exact,

    E[sin²] = (1 − e^(−2σ²))/2,        E[(1 − cos)²] = 3/2 − 2·e^(−σ²/2) + e^(−2σ²)/2,

so a heading that nobody knows any more gives a full circle of radius |l|. A few degrees change nothing.
"""

import math

import numpy as np

from fusion.state import Array


def on_the_arc(covariance: Array, with_yaw: Array, yaw_rad2: float) -> Array:
    """The covariance (3, 3) of a position, m², with its share by yaw (``with_yaw`` (3,) m·rad) bent to an arc.

    About the filter's position, which is where the arc passes: the bias of its mean counts as error.
    """
    if yaw_rad2 <= 0.0:
        return covariance
    east, north = (float(part) / yaw_rad2 for part in with_yaw[:2])
    along, lever = np.array([east, north, 0.0]), np.array([north, -east, 0.0])
    aside = 0.5 * -math.expm1(-2.0 * yaw_rad2)
    short = -2.0 * math.expm1(-0.5 * yaw_rad2) + 0.5 * math.expm1(-2.0 * yaw_rad2)
    bent: Array = covariance + (aside - yaw_rad2) * np.outer(along, along) + short * np.outer(lever, lever)
    return bent
