"""What a person is told to do: legs of an itinerary, one after the other, each with its gait and way-points."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from bootprint.errors import ConfigError

FloatArray = npt.NDArray[np.float64]
GaitName = Literal[
    "stand",
    "kneel",
    "prone",
    "walk",
    "run",
    "sprint",
    "crawl",
    "side_step_left",
    "side_step_right",
    "backward",
    "stairs",
    "lift",
    "turn",
]
TRAVELLING: tuple[GaitName, ...] = (
    "walk",
    "run",
    "sprint",
    "crawl",
    "side_step_left",
    "side_step_right",
    "backward",
    "stairs",
)
HOLDING: tuple[GaitName, ...] = ("stand", "kneel", "prone")


@dataclass(frozen=True)
class Leg:
    """One stretch of an itinerary.

    ``points_m`` (k, 3): way-points in ENU, the first where the leg before ended; (1, 3) for standing, kneeling,
    lying and turning; (2, 3) for a lift, from and to. ``duration_s``: of standing, kneeling, lying (required), of a
    lift's ride or a turn (None: as long as it needs). ``speed_m_s``: None is the person's own for the gait.
    ``facing_rad``: yaw of the body, counter-clockwise from east, where it is not the direction of motion; for a
    turn the yaw to turn to. ``riser_m``: about how high the steps of stairs are. A travelling leg starts and ends
    standing, the feet side by side.
    """

    gait: GaitName
    points_m: FloatArray
    duration_s: float | None = None
    speed_m_s: float | None = None
    facing_rad: float | None = None
    riser_m: float = 0.16

    def __post_init__(self) -> None:
        object.__setattr__(self, "points_m", np.atleast_2d(np.asarray(self.points_m, dtype=np.float64)))
        trouble = _trouble(self)
        if trouble is not None:
            raise ConfigError(f"leg {self.gait!r}: {trouble}")

    @property
    def travels(self) -> bool:
        """Whether steps carry the person along the way-points."""
        return self.gait in TRAVELLING


def _trouble(leg: Leg) -> str | None:
    """What is wrong with a leg, and what would be right."""
    if leg.gait not in get_args(GaitName):
        return f"unknown gait; known: {', '.join(get_args(GaitName))}"
    if leg.points_m.ndim != 2 or leg.points_m.shape[1] != 3 or not np.isfinite(leg.points_m).all():
        return f"points_m must be finite rows of (east, north, up), not of shape {leg.points_m.shape}"
    if leg.travels and _way_m(leg.points_m) < 0.1:
        return "needs way-points at least 0.1 m apart"
    if leg.gait == "lift" and len(leg.points_m) != 2:
        return "needs two points, from and to"
    if leg.gait in HOLDING and leg.duration_s is None:
        return "needs duration_s"
    if leg.gait == "turn" and leg.facing_rad is None:
        return "needs facing_rad, the yaw to turn to"
    if any(value is not None and not value > 0.0 for value in (leg.duration_s, leg.speed_m_s, leg.riser_m)):
        return "duration_s, speed_m_s and riser_m must be above zero"
    return None


def _way_m(points_m: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(points_m[:, :2], axis=0), axis=1).sum())


@dataclass(frozen=True)
class Itinerary:
    """Legs in order from ``start_s``; before it the person stands at the first point, facing ``start_yaw_rad``."""

    legs: tuple[Leg, ...]
    start_s: float = 0.0
    start_yaw_rad: float = 0.0

    def __post_init__(self) -> None:
        if not self.legs:
            raise ConfigError("itinerary: needs at least one leg")
        if self.start_s < 0.0:
            raise ConfigError(f"itinerary: start_s must not be below zero, not {self.start_s:g}")


@dataclass(frozen=True, slots=True)
class Activity:
    """What a person did from ``start_s`` to ``end_s``."""

    start_s: float
    end_s: float
    gait: GaitName
