"""Where and when the steps of a leg fall: arcs along its way, places beside it, yaws, times; scatter included."""

from dataclasses import dataclass

import numpy as np

from proving_ground.people.gaits import Pace, stair_steps
from proving_ground.people.legs import FloatArray, Leg
from proving_ground.people.person import Person
from proving_ground.people.route import Route

TURN_PER_STEP_RAD = 1.1  # a body that has to face about does so over several steps
_ACROSS_SIGMA_M, _YAW_SIGMA_RAD = 0.012, 0.03
_ON_STAIRS = 0.3  # of the usual scatter of steps: the treads rule
_RUN_WIDTH = 0.5  # runners set their feet nearly on one line


@dataclass(frozen=True)
class Steps:
    """The n steps of a leg: centre of the body as each foot stands ``centre_m`` (n, 3) and its ``yaw_rad`` (n,);
    ``slope`` (n,) there, ``boundary_s`` (n + 2,): step k swings from boundary k to k + 2 (0-based) and its foot is
    amid its swing at k + 1; ``closing`` (n,) steps end beside the other foot."""

    centre_m: FloatArray
    yaw_rad: FloatArray
    slope: FloatArray
    boundary_s: FloatArray
    closing: FloatArray


def step_arcs(leg: Leg, pace: Pace) -> FloatArray:
    """Length walked when each step falls, (n,); the last step joins the other foot."""
    route = Route(leg.points_m)
    if leg.gait == "stairs":
        counts = stair_steps(leg, pace.length_m).astype(int)
        pieces = [
            begin + (end - begin) * np.arange(1, count + 1) / count
            for begin, end, count in zip(route.arc_m[:-1], route.arc_m[1:], counts, strict=True)
        ]
        forward = np.concatenate(pieces)
        return np.append(forward, forward[-1])
    count = max(1, round(route.length_m / pace.length_m))
    forward = route.length_m * np.arange(1, count + 1) / count
    return np.repeat(forward, 2) if pace.pairs else np.append(forward, forward[-1])


def facing(leg: Leg, pace: Pace, arcs: FloatArray, start_yaw: float) -> FloatArray:
    """Yaw of the body at each step (n,), unwrapped from ``start_yaw``, turning no faster than feet can."""
    along = Route(leg.points_m).yaw_at(arcs)
    if leg.facing_rad is not None:
        wanted = np.full(len(arcs), leg.facing_rad)
    elif leg.gait.startswith("side_step"):
        wanted = along + (-0.5 if leg.gait == "side_step_left" else 0.5) * np.pi
    else:
        wanted = along + (np.pi if pace.backward else 0.0)
    yaw, faced = start_yaw, []
    for target in wanted:
        yaw += float(np.clip(_wrapped(target - yaw), -TURN_PER_STEP_RAD, TURN_PER_STEP_RAD))
        faced.append(yaw)
    return np.array(faced)


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def step_times(
    start_s: float, count: int, period_s: float, first_side: int, person: Person, rng: np.random.Generator
) -> FloatArray:
    """Boundaries (count + 2,) of steps: uneven by habit and chance, ``(count + 1) · period_s`` in all."""
    parity = np.where(np.arange(count + 1) % 2 == 0, 1.0, -1.0) * (-first_side)
    share = 1.0 + person.asymmetry * parity + rng.normal(0.0, person.time_variability, count + 1)
    share = np.clip(share, 0.8, 1.2)
    ends = np.cumsum(share) * (count + 1) / share.sum()
    return start_s + period_s * np.concatenate([[0.0], ends])


def places(
    steps: Steps, sides: FloatArray, pace: Pace, person: Person, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Place (n, 3) and yaw (n,) of each footfall; those of closing steps are exact."""
    loose = 1.0 - steps.closing
    going = _RUN_WIDTH if pace.shape == "run" else 1.0
    width = person.step_width_m * np.where(steps.closing > 0.0, 1.0, going)
    aside = 0.5 * width * sides + loose * rng.normal(0.0, _ACROSS_SIGMA_M, len(sides))
    spread = person.length_variability * (_ON_STAIRS if pace.shape in ("stairs_up", "stairs_down") else 1.0)
    ahead = loose * rng.normal(0.0, spread * pace.length_m, len(sides))
    way = np.arctan2(*np.gradient(np.vstack([steps.centre_m[:1], steps.centre_m]), axis=0)[1:, 1::-1].T)
    cosine, sine = np.cos(steps.yaw_rad), np.sin(steps.yaw_rad)
    place = steps.centre_m + np.column_stack([-aside * sine, aside * cosine, np.zeros(len(sides))])
    place[:, :2] += ahead[:, None] * np.column_stack([np.cos(way), np.sin(way)])
    toes = sides * person.toe_out_rad
    return place, steps.yaw_rad + toes + loose * rng.normal(0.0, _YAW_SIGMA_RAD, len(sides))
