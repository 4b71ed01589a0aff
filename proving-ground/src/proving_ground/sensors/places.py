"""Plan geometry of the surroundings: polygons and walls, and what lies between two points. Vectorised, no state."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from proving_ground.motion import FloatArray

BoolArray = npt.NDArray[np.bool_]
_EVERYWHERE = (-np.inf, np.inf)


@dataclass(frozen=True)
class Area:
    """A prism: polygon ``corners_m`` (k, 2) ENU, either way round, between two heights."""

    corners_m: FloatArray
    heights_m: tuple[float, float] = _EVERYWHERE

    @staticmethod
    def box(
        west_m: float,
        south_m: float,
        east_m: float,
        north_m: float,
        heights_m: tuple[float, float] = _EVERYWHERE,
    ) -> "Area":
        """A rectangle along the axes."""
        corners = [[west_m, south_m], [east_m, south_m], [east_m, north_m], [west_m, north_m]]
        return Area(np.array(corners), heights_m)

    @staticmethod
    def disc(centre_m: tuple[float, float], radius_m: float, corners: int = 32) -> "Area":
        """A circle's polygon, up and down without end."""
        turn = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
        return Area(np.array(centre_m) + radius_m * np.column_stack([np.cos(turn), np.sin(turn)]))

    @property
    def sides_m(self) -> FloatArray:
        """The polygon's sides (k, 2, 2)."""
        return np.stack([self.corners_m, np.roll(self.corners_m, -1, axis=0)], axis=1)

    def holds(self, place_m: FloatArray) -> BoolArray:
        """Whether places (n, 3) lie inside, (n,): even-odd rule."""
        east, north = place_m[:, 0, None], place_m[:, 1, None]
        start, end = self.sides_m[:, 0], self.sides_m[:, 1]
        crosses = (start[:, 1] > north) != (end[:, 1] > north)
        rise = np.where(end[:, 1] == start[:, 1], 1.0, end[:, 1] - start[:, 1])
        at = start[:, 0] + (north - start[:, 1]) / rise * (end[:, 0] - start[:, 0])
        inside = (crosses & (east < at)).sum(axis=1) % 2 == 1
        low, high = self.heights_m
        return np.asarray(inside & (place_m[:, 2] >= low) & (place_m[:, 2] < high), dtype=np.bool_)

    def depth_m(self, place_m: FloatArray) -> FloatArray:
        """How far inside places (n, 3) are from the nearest side, m, (n,); 0 outside."""
        return np.where(self.holds(place_m), distance_to(self.sides_m, place_m), 0.0)


@dataclass(frozen=True)
class Walls:
    """Upright walls: ``ends_m`` (k, 2, 2) their plan, ``heights_m`` (k, 2) lower and upper edge."""

    ends_m: FloatArray = field(default_factory=lambda: np.zeros((0, 2, 2)))
    heights_m: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))

    def __len__(self) -> int:
        return len(self.ends_m)

    def near(self, place_m: FloatArray, reach_m: float) -> npt.NDArray[np.int64]:
        """The numbers of the walls that come within reach, in plan, of any of the places (n, 3), and some more."""
        low_m, high_m = place_m[:, :2].min(axis=0), place_m[:, :2].max(axis=0)
        middle_m, spread_m = 0.5 * (low_m + high_m), 0.5 * float(np.linalg.norm(high_m - low_m))
        return np.flatnonzero(_apart(self.ends_m, middle_m[None])[0] <= reach_m + spread_m)

    def between(self, from_m: FloatArray, to_m: FloatArray) -> npt.NDArray[np.int64]:
        """How many walls the straight lines from (n, 3) to (n, 3) pass through, (n,)."""
        if not len(self):
            return np.zeros(len(from_m), dtype=np.int64)
        ray = (to_m - from_m)[:, None]
        start, along = self.ends_m[:, 0], self.ends_m[:, 1] - self.ends_m[:, 0]
        apart = start - from_m[:, None, :2]
        turn = _cross(ray[..., :2], along)
        safe = np.where(np.abs(turn) < 1e-12, np.inf, turn)
        share, place = _cross(apart, along) / safe, _cross(apart, ray[..., :2]) / safe
        height = from_m[:, None, 2] + share * ray[..., 2]
        through = (share > 0.0) & (share < 1.0) & (place >= 0.0) & (place <= 1.0)
        through &= (
            (np.abs(turn) >= 1e-12) & (height >= self.heights_m[:, 0]) & (height <= self.heights_m[:, 1])
        )
        return np.asarray(through.sum(axis=1), dtype=np.int64)


def distance_to(segments_m: FloatArray, place_m: FloatArray) -> FloatArray:
    """Horizontal distance from places (n, 2 or 3) to the nearest of segments (k, 2, 2), m, (n,); inf if none."""
    if not len(segments_m):
        return np.full(len(place_m), np.inf)
    return np.asarray(_apart(segments_m, place_m).min(axis=1))


def _apart(segments_m: FloatArray, place_m: FloatArray) -> FloatArray:
    """Horizontal distances (n, k) from places to segments."""
    start, along = segments_m[:, 0], segments_m[:, 1] - segments_m[:, 0]
    apart = place_m[:, None, :2] - start
    length = np.maximum((along**2).sum(axis=1), 1e-12)
    share = np.clip((apart * along).sum(axis=2) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(apart - share[..., None] * along, axis=2))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
