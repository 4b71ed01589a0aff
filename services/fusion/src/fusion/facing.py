"""Where the body faces: by the feet that stand, else by the body-worn unit's last step.

A foot's yaw is that of its sensor's axis. Where ahead lies from that axis the steps tell: whoever steps forward
goes where the body faces, as the mean of the headings before and after the step has it. So a toe that points
outwards is learned with the mounting.
"""

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from bootprint.geodesy import wrap_angle, yaw_of_azimuth
from bootprint.messages import BodyStep, Direction, FootStep
from fusion.boots import Boots
from fusion.feet import Foot

_LEAST_M, _MOST_TURN_RAD = 0.5, 0.3  # of a step that tells where ahead is
_UPRIGHT = ("walking", "running", "stairs")
_MEMORY = 0.95  # of a step: soles and straps shift within some tens of them
_FEWEST = 3.0  # steps, weighed by their memory
_STEP_SIGMA_RAD = 0.15  # of one step's direction against the body's
_TRUNK_SIGMA_RAD = 0.2  # of the trunk's direction against that of the feet it stands on
_BODY_HOLDS_NS = 5_000_000_000
_TURNED_RAD: dict[Direction, float] = {
    "forward": 0.0,
    "left": 0.5 * math.pi,
    "backward": math.pi,
    "right": -0.5 * math.pi,
}  # from where the body faces to where the step leads, counter-clockwise

Direct = tuple[float, float]
"""A yaw, rad counter-clockwise from the first axis, and its sigma, rad."""


@dataclass(slots=True)
class _Ahead:
    """Sum of unit vectors from a foot's axis to where its steps led, fading, and how many they are."""

    total: complex = 0j
    steps: float = 0.0

    def hear(self, angle_rad: float) -> None:
        self.total = _MEMORY * self.total + cmath.rect(1.0, angle_rad)
        self.steps = _MEMORY * self.steps + 1.0


@dataclass(slots=True)
class Facing:
    """Learns where ahead is of each foot, and tells where the body faces."""

    _ahead: dict[str, _Ahead] = field(default_factory=dict)
    _by_body: tuple[int, Direct] | None = None  # when, and what it was

    def step(self, place: str, step: FootStep) -> None:
        """A foot has made a step."""
        if step.direction != "forward" or step.motion not in _UPRIGHT:
            return
        forward, left, _ = step.displacement_m
        turn_rad = step.heading_change_rad
        if math.hypot(forward, left) >= _LEAST_M and abs(turn_rad) <= _MOST_TURN_RAD:
            self._ahead.setdefault(place, _Ahead()).hear(math.atan2(left, forward) - 0.5 * turn_rad)

    def body_step(self, step: BodyStep, turn: Direct) -> None:
        """The body-worn unit has seen a step; it sits at a ``turn`` (counter-clockwise) against the boots."""
        if step.direction is None:
            return
        yaw = yaw_of_azimuth(step.azimuth_rad) + turn[0] - _TURNED_RAD[step.direction]
        self._by_body = step.time_ns, (yaw, math.hypot(step.azimuth_sigma_rad, turn[1]))

    def at(self, boots: Boots, now_ns: int, turn: Direct | None) -> Direct | None:
        """Azimuth and sigma, rad; ``turn``: of the filter's directions into ENU, None while that is not known."""
        if turn is None:
            return None
        heard = boots.heard_feet(now_ns)
        direct = self._by_feet(boots, heard) if heard else self._of_body(now_ns)
        if direct is None:
            return None
        azimuth_rad = yaw_of_azimuth(direct[0] + turn[0]) % math.tau
        return azimuth_rad, math.hypot(direct[1], turn[1], _TRUNK_SIGMA_RAD)

    def _by_feet(self, boots: Boots, heard: Sequence[Foot]) -> Direct | None:
        """In the filter's frame; None while no foot that stands has told where ahead is."""
        told = [direct for foot in heard if _stands(foot) and (direct := self._of(boots, foot)) is not None]
        if not told:
            return None
        mean = sum((cmath.rect(1.0 / sigma**2, yaw) for yaw, sigma in told), 0j)
        # Both feet share what errs in the heading: the surer one's doubt stays.
        return cmath.phase(mean), min(sigma for _, sigma in told)

    def _of_body(self, now_ns: int) -> Direct | None:
        """By the unit's newest step: who stands makes none, and may turn unseen."""
        if self._by_body is None or abs(now_ns - self._by_body[0]) > _BODY_HOLDS_NS:
            return None
        return self._by_body[1]

    def _of(self, boots: Boots, foot: Foot) -> Direct | None:
        ahead = self._ahead.get(foot.place)
        if ahead is None or ahead.steps < _FEWEST:
            return None
        turned = foot.pose.heading_change_rad if foot.pose is not None else 0.0
        block, state = foot.block, boots.filter
        yaw = float(state.state[block.yaw]) + turned + cmath.phase(ahead.total)
        learned = _STEP_SIGMA_RAD / math.sqrt(ahead.steps)
        variance = max(0.0, float(state.covariance[block.yaw, block.yaw]))
        return wrap_angle(yaw), math.hypot(math.sqrt(variance), learned)


def _stands(foot: Foot) -> bool:
    return foot.pose is None or foot.pose.in_stance
