"""The line under a cloud of clock offsets: what the offset would be if nothing were ever delayed.

Delays only ever add to (receive time - device time), so the true offset lies on or below every point. The line
is the edge of the points' lower convex hull over the middle of the window: S. Moon, P. Skelly, D. Towsley,
"Estimation and removal of clock skew from network delay measurements", INFOCOM 1999.
"""

from collections import deque
from itertools import pairwise

_BUCKET_NS = 1_000_000_000
_WINDOW_BUCKETS = 60
_MIN_SPAN_NS = 10_000_000_000
# No crystal is worse; a steeper line is noise.
_MAX_SLOPE = 200e-6

Point = tuple[int, int]


class MinimumDelayLine:
    """A line offset(t) = offset + slope · t under the least delayed point of every second of the last minute."""

    def __init__(self) -> None:
        self._points: deque[Point] = deque(maxlen=_WINDOW_BUCKETS)
        self._origin: Point = (0, 0)
        self._slope = 0.0

    def __bool__(self) -> bool:
        return bool(self._points)

    @property
    def slope(self) -> float:
        """How much faster the receiver's clock runs than the device's (1e-6 = 1 ppm)."""
        return self._slope

    def clear(self) -> None:
        """Forget everything."""
        self._points.clear()

    def add(self, time_ns: int, offset_ns: int) -> None:
        """A new point; one that is earlier than the last is passed over."""
        points = self._points
        if points and time_ns < points[-1][0]:
            return
        if not points or time_ns // _BUCKET_NS != points[-1][0] // _BUCKET_NS:
            points.append((time_ns, offset_ns))
            self._fit()
        elif offset_ns < self.at(time_ns):
            points[-1] = (time_ns, offset_ns)
            self._fit()
        elif offset_ns < points[-1][1]:
            points[-1] = (time_ns, offset_ns)

    def at(self, time_ns: int) -> int:
        """The undelayed offset at this device time."""
        origin_ns, offset_ns = self._origin
        return offset_ns + round(self._slope * (time_ns - origin_ns))

    def _fit(self) -> None:
        points = list(self._points)
        origin_ns, base_ns = points[-1]
        self._slope = max(-_MAX_SLOPE, min(_MAX_SLOPE, _middle_slope(points)))
        under = min(offset - base_ns - self._slope * (time - origin_ns) for time, offset in points)
        self._origin = (origin_ns, base_ns + int(under // 1))


def _middle_slope(points: list[Point]) -> float:
    """The slope of the lower hull's edge over the middle of the window; 0 while the window is short."""
    first_ns, last_ns = points[0][0], points[-1][0]
    if last_ns - first_ns < _MIN_SPAN_NS:
        return 0.0
    middle_ns = (first_ns + last_ns) // 2
    for (t1, o1), (t2, o2) in pairwise(_lower_hull(points)):
        if t2 >= middle_ns:
            return (o2 - o1) / (t2 - t1)
    return 0.0


def _lower_hull(points: list[Point]) -> list[Point]:
    """Andrew's monotone chain: the corners of the lower convex hull, by time."""
    hull: list[Point] = []
    for point in points:
        while len(hull) > 1 and _is_above(hull[-1], hull[-2], point):
            hull.pop()
        hull.append(point)
    return hull


def _is_above(middle: Point, left: Point, right: Point) -> bool:
    """Whether ``middle`` lies on or above the line from ``left`` to ``right``."""
    (t0, o0), (t1, o1), (t2, o2) = left, middle, right
    return (o1 - o0) * (t2 - t0) >= (o2 - o0) * (t1 - t0)
