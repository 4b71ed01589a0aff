"""Where a body may be whose heading is doubtful: on an arc, not on the tangent that a linear filter sees.

Published is the arc. Inside the filter the tangent stays, and comparisons of walkers with each other must not read
more into it than there is (`unturned`).

A filter tells how a position errs with yaw, ``a = Cov(p, ψ)/σ²`` (m/rad). That is a turn about a point which is
``l = (a_north, −a_east)`` away: ``δp = a·sin δψ − l·(1 − cos δψ)``. With δψ normal its second moments are exact,

    E[sin²] = (1 − e^(−2σ²))/2,        E[(1 − cos)²] = 3/2 − 2·e^(−σ²/2) + e^(−2σ²)/2,

so a heading that nobody knows any more gives a full circle of radius |l|. A few degrees change nothing.
"""

import math

import numpy as np

from fusion.state import Array


def chord_of(turn_rad: float) -> Array:
    """From the tangent of an arc, as long as it, to its chord: (3, 3), heights as they are.

    The left Jacobian of SO(2), which makes the exponential of a planar motion (Barfoot 2017, 7.1).
    """
    along = float(np.sinc(turn_rad / math.pi))
    aside = 0.5 * turn_rad * float(np.sinc(0.5 * turn_rad / math.pi)) ** 2  # (1 − cos ψ)/ψ
    return np.array([[along, -aside, 0.0], [aside, along, 0.0], [0.0, 0.0, 1.0]])


def beside_the_tangent(with_yaw: Array, yaw_rad2: float) -> Array:
    """What of the arc lies beside its tangent, (3, 3) m²: what a linear filter knows nothing of."""
    if yaw_rad2 <= 0.0:
        return np.zeros((3, 3))
    east, north = (float(part) / yaw_rad2 for part in with_yaw[:2])
    lever = np.array([north, -east, 0.0])
    return np.asarray(_short(yaw_rad2) * np.outer(lever, lever))


def _short(yaw_rad2: float) -> float:
    """``E[(1 − cos δψ)²]``."""
    return -2.0 * math.expm1(-0.5 * yaw_rad2) + 0.5 * math.expm1(-2.0 * yaw_rad2)


def on_the_arc(covariance: Array, with_yaw: Array, yaw_rad2: float) -> Array:
    """The covariance (3, 3) of a position, m², with its share by yaw (``with_yaw`` (3,) m·rad) bent to an arc.

    About the filter's position, which is where the arc passes: the bias of its mean counts as error.
    """
    if yaw_rad2 <= 0.0:
        return covariance
    east, north = (float(part) / yaw_rad2 for part in with_yaw[:2])
    along = np.array([east, north, 0.0])
    aside = 0.5 * -math.expm1(-2.0 * yaw_rad2)
    bent: Array = covariance + (aside - yaw_rad2) * np.outer(along, along)
    return bent + beside_the_tangent(with_yaw, yaw_rad2)


def unturned(jacobian: Array, apart: Array, heading: Array) -> Array:
    """Jacobian (3, n) of two places that are ``apart`` (3,) m, as seen by somebody who turns with the walkers.

    ``jacobian`` is that in fixed axes, ``heading`` (n,) how they are turned, ``∂ψ/∂x``. How far they are apart is
    the same whichever way all is turned; on the tangent it is not. Compared in fixed axes, places that ought to
    coincide and do not would say, by the second order of what nobody knows, that nothing is turned.
    """
    east, north, _ = (float(part) for part in apart)
    seen: Array = jacobian - np.outer((-north, east, 0.0), heading)
    return seen
