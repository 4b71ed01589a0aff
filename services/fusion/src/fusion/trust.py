"""Whether a receiver is to be believed: its fixes against shadows that have not heard satellites (METHODS D9, A10).

A fix is *astray* if it is further from some shadow than both their errors explain. One is an outlier; when most of
the last few are, the receiver is spoofed or broken, and distrusted until its fixes agree with dead reckoning again
for a while. How large a receiver's errors are is its own word, or how much its fixes have scattered of late about a
line against dead reckoning, whichever is more: receivers near walls promise too much, and a drag is no scatter.
"""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from bootprint.clock import NS_PER_S
from fusion.boots import Boots
from fusion.filter import invert_spd
from fusion.models import body
from fusion.state import Array

T = TypeVar("T")
_FEWEST = 6  # fixes, for a scatter


def residual(boots: Boots, enu: Array, time_ns: int) -> tuple[Array, Array]:
    """A place (2,) against where the boots say the body is, and the covariance (2, 2) of the latter."""
    stands, state = boots.stands(time_ns), boots.filter.state
    jacobian = body.position_jacobian(state, stands)[:2]
    return enu - body.position(state, stands)[:2], jacobian @ boots.filter.covariance @ jacobian.T


def normalised_squared(boots: Boots, enu: Array, sigma_m: float, time_ns: int) -> float:
    """The same in units of both errors, squared: chi-square of 2 degrees of freedom."""
    away, covariance = residual(boots, enu, time_ns)
    return float(away @ invert_spd(covariance + sigma_m**2 * np.eye(2)) @ away)


def heading_sigma_rad(boots: Boots) -> float:
    """How sure the heading of the surest foot is, 1 sigma; infinite without any."""
    covariance = boots.filter.covariance
    variances = (
        float(covariance[foot.block.yaw, foot.block.yaw]) for foot in boots.feet.values() if foot.carries
    )
    return math.sqrt(min(variances, default=math.inf))


@dataclass(slots=True)
class Receiver:
    """What is remembered of one receiver."""

    distrusted_ns: int | None = None  # since when
    trusted_ns: int | None = None  # since when again
    agreeing_ns: int | None = None  # since when all fixes of a distrusted one have agreed
    astray: deque[tuple[int, bool]] = field(default_factory=deque)
    misses: deque[tuple[int, Array]] = field(default_factory=deque)
    heard_at: Array | None = None  # (2,) m, where the newest accepted fix was, by the boots

    def scatter_m(self, miss: Array, time_ns: int, window_s: float) -> float:
        """Standard deviation of a fix's axes about a straight line through those of the window, m."""
        _add(self.misses, time_ns, miss, window_s)
        if len(self.misses) < _FEWEST:
            return 0.0
        times = np.array([(at - time_ns) / NS_PER_S for at, _ in self.misses])
        values = np.array([value for _, value in self.misses])
        design = np.column_stack([np.ones(len(times)), times])
        fitted = design @ np.linalg.lstsq(design, values, rcond=None)[0]
        return float(np.sqrt(np.sum((values - fitted) ** 2) / (2.0 * (len(times) - 2))))

    def moved_m(self, here: Array) -> float:
        """How far the boots have gone since the newest accepted fix; to ``here`` (2,)."""
        return math.inf if self.heard_at is None else float(np.hypot(*(here - self.heard_at)))

    def strays(self, astray: bool, time_ns: int, window_s: float) -> bool:
        """Whether most of the last fixes, over all of the window, were astray."""
        _add(self.astray, time_ns, astray, window_s)
        covered = time_ns - self.astray[0][0] >= 0.8 * window_s * NS_PER_S
        return covered and sum(was for _, was in self.astray) >= 0.8 * len(self.astray)

    def agrees(self, agreeing: bool, time_ns: int, for_s: float) -> bool:
        """Whether fixes have agreed without a break for so long."""
        if not agreeing:
            self.agreeing_ns = None
            return False
        self.agreeing_ns = self.agreeing_ns or time_ns
        return time_ns - self.agreeing_ns >= for_s * NS_PER_S

    def distrust(self, time_ns: int) -> None:
        """It has been found out."""
        self.distrusted_ns, self.agreeing_ns = time_ns, None
        self.astray.clear()

    def trust(self, time_ns: int) -> None:
        """It may be believed again."""
        self.distrusted_ns, self.agreeing_ns, self.trusted_ns = None, None, time_ns
        self.astray.clear()

    def is_settled(self, time_ns: int, after_s: float) -> bool:
        """Whether it has corrected dead reckoning for so long since it was last distrusted."""
        return self.trusted_ns is None or time_ns - self.trusted_ns > after_s * NS_PER_S


def _add(window: deque[tuple[int, T]], time_ns: int, value: T, window_s: float) -> None:
    window.append((time_ns, value))
    while time_ns - window[0][0] > window_s * NS_PER_S:
        window.popleft()
