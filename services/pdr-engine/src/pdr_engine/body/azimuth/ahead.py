"""Which way the person walks, seen from the unit: found from the steps of a walk (`Gait.push`).

The directions of the pushes (of weak ones less) are summed over steady walking straight on (a run's push comes
after its bounce). A unit whose x axis is level is taken to have it ahead until the steps clearly say otherwise. A
sum within 40° of one of the unit's own axes means that axis: units are worn and held straight ahead more often than
not, and an arm that swings turns the push (hand-held phones: 10° to 30°). After enough steps the direction holds:
what turns later is the person. People begin by going forward: until the direction is `known` every step counts as
one forward, later those aside and back are turned first.
"""

import cmath
import math

from bootprint.messages import Direction
from pdr_engine.body.settings import Forward
from pdr_engine.body.steps.attitude import Rows
from pdr_engine.body.steps.gait import Gait

STEPS = 60
PRIOR_STEPS = 20.0
KNOWN_STEPS = 6.0
SNAP_RAD = math.radians(40.0)
STRAIGHT_RAD_S = 0.3
STEADY = 0.12  # of the interval
SMALL_PUSH = 1.0  # m²/s⁴: what shuffling reaches, and does not tell much
_STEEP = math.sqrt(0.5)
_AXES = {"x": (0, 1.0), "y": (1, 1.0), "z": (2, 1.0), "-x": (0, -1.0), "-y": (1, -1.0), "-z": (2, -1.0)}

# What turns a push in each direction to one forward.
_BACK: dict[Direction, complex] = {"forward": 1.0 + 0j, "backward": -1.0 + 0j, "left": -1j, "right": 1j}


class Ahead:
    """The direction of walking against a reference axis of the unit, counter-clockwise."""

    def __init__(self, forward: Forward, misalignment_rad: float) -> None:
        self._forward = forward
        self._axis: tuple[int, float] | None = None if forward == "auto" else _AXES[forward]
        self._misalignment_rad = misalignment_rad
        self._sum = [0.0, 0.0]  # of pushes, and of what is believed beforehand
        self._seen = 0j  # of pushes alone
        self._steps = 0
        self._interval_s = 0.0
        self.angle_rad = -misalignment_rad

    def reference(self, rows: Rows) -> tuple[float, float]:
        """East and north part of the reference axis in the nav frame; without one told: x, or y if x is steep."""
        if self._axis is None:
            is_flat = abs(rows[2][0]) < _STEEP
            self._axis = _AXES["x" if is_flat else "y"]
            self._sum[0] = PRIOR_STEPS if is_flat else 0.0
        index, sign = self._axis
        return sign * rows[0][index], sign * rows[1][index]

    @property
    def known(self) -> bool:
        """Whether enough steps agree with the direction as it is taken to be."""
        if self._forward != "auto":
            return True
        apart = cmath.phase(self._seen) - self.angle_rad - self._misalignment_rad
        return abs(self._seen) > KNOWN_STEPS and abs(math.remainder(apart, math.tau)) < SNAP_RAD

    def learn(self, gait: Gait, turn_rate_rad_s: float, rows: Rows, direction: Direction, runs: bool) -> None:
        """Take another step in, which went in this direction."""
        before_s, self._interval_s = self._interval_s, gait.interval_s
        is_steady = abs(gait.interval_s - before_s) < STEADY * gait.interval_s
        is_walk = abs(turn_rate_rad_s) < STRAIGHT_RAD_S and not runs
        if self._forward == "auto" and self._steps < STEPS and is_steady and is_walk:
            self._steps += 1
            push = complex(*gait.push) * _BACK[direction] / (math.hypot(*gait.push) + SMALL_PUSH)
            self._seen += push
            self._sum[0] += push.real
            self._sum[1] += push.imag
            self._decide(rows)

    def _decide(self, rows: Rows) -> None:
        found = math.atan2(self._sum[1], self._sum[0])
        nearest = min(self._own_axes(rows), key=lambda axis: abs(math.remainder(axis - found, math.tau)))
        snaps = abs(math.remainder(nearest - found, math.tau)) < SNAP_RAD
        self.angle_rad = (nearest if snaps else found) - self._misalignment_rad

    def _own_axes(self, rows: Rows) -> list[float]:
        """The directions of the unit's axes that are not steep, and their opposites, from the reference axis."""
        x, y = self.reference(rows)
        zero = math.atan2(y, x)
        flat = [i for i in range(3) if abs(rows[2][i]) < _STEEP]
        ways = [math.atan2(rows[1][i], rows[0][i]) - zero for i in flat]
        return ways + [way + math.pi for way in ways]
