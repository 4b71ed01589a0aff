"""A person's word about a placed soldier: believed, whatever the estimate says; it was not that sure, then."""

import numpy as np

from fusion.boots import Boots
from fusion.filter import Measurement
from fusion.models import body
from fusion.placement import UNKNOWN_UP_SIGMA_M, HeadingHint, Place
from fusion.state import Array


def believe(boots: Boots, place: Place, expected: Array) -> None:
    """They are there; ``expected`` (3, 3) m² is how sure the estimate thought it was."""
    stands = boots.stands(place.time_ns)
    residual = np.array(place.enu) - body.position(boots.filter.state, stands)
    axes = 2 if place.up_sigma_m is None else 3
    surprise = np.zeros(3)
    surprise[:axes] = np.maximum(0.0, residual**2 - np.diag(expected))[:axes]
    boots.filter.widen_together(np.diag(surprise))
    noise = np.diag([place.sigma_m**2, place.sigma_m**2, (place.up_sigma_m or UNKNOWN_UP_SIGMA_M) ** 2])
    jacobian = body.position_jacobian(boots.filter.state, stands)
    boots.correct(
        Measurement("fix", residual[:axes], jacobian[:axes], np.ascontiguousarray(noise[:axes, :axes]))
    )


def turn(boots: Boots, hint: HeadingHint) -> None:
    """They have walked off in a named direction: correct the yaw of the foot that was watched."""
    foot = boots.reference
    if foot is None:
        return
    jacobian = np.zeros((1, boots.filter.state.size))
    jacobian[0, foot.block.yaw] = 1.0
    boots.filter.widen_together(np.zeros((3, 3)), hint.turn_rad**2)
    noise = np.array([[hint.turn_sigma_rad**2]])
    boots.correct(Measurement("azimuth", np.array([hint.turn_rad]), jacobian, noise, directs=True))
