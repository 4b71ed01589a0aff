"""The four-direction course of METHODS A3: 62 m forward, aside, backward, aside, facing the same way all along.

Every step's class against truth, and how far from the start the course ends. Five body types, each person's step
lengths by class learned on three other walks, the side steps' rotation on the course itself.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import typer

from bootprint.geomagnetism import EarthField
from bootprint.messages import Direction
from pdr_engine.body.movement.classes import MovementClassifier
from pdr_engine.body.movement.direction import LAG
from pdr_engine.body.movement.settlement import Settlement
from pdr_engine.body.movement.side_step import SideStepRotation
from pdr_engine.body.pieces import FloatArray, Stride
from proving_ground.evaluation.body.strides import cut_strides, heading_rad
from proving_ground.people import GaitName, Itinerary, Leg, Person, PersonMotion, move
from proving_ground.sensors import Magnetics, Mounting, imu_class, measure_imu

SIDE_M = 15.5
COURSE_M = 4.0 * SIDE_M
BODY_TYPES = {
    "average": Person(),
    "tall": Person(leg_length_m=1.04, walk_ratio_m_s=0.42),
    "short": Person(leg_length_m=0.80, walk_ratio_m_s=0.35, walk_speed_m_s=1.2),
    "quick": Person(walk_speed_m_s=1.6, walk_ratio_m_s=0.36, strike_m_s2=32.0, time_variability=0.035),
    "heavy": Person(walk_speed_m_s=1.1, step_width_m=0.14, sway_m=0.006, strike_m_s2=38.0, asymmetry=0.02),
}
_CENTRAL_EUROPE = EarthField(1.1, 21.4, -43.2)
_DIRECTION: dict[GaitName, Direction] = {
    "walk": "forward",
    "backward": "backward",
    "side_step_left": "left",
    "side_step_right": "right",
}
COURSES: dict[str, tuple[tuple[GaitName, float, float], ...]] = {
    # gait, and the way ahead and to the left of one who faces east
    "forward first": (
        ("walk", 1.0, 0.0),
        ("side_step_right", 0.0, -1.0),
        ("backward", -1.0, 0.0),
        ("side_step_left", 0.0, 1.0),
    ),
    "backward first": (
        ("backward", -1.0, 0.0),
        ("side_step_left", 0.0, 1.0),
        ("walk", 1.0, 0.0),
        ("side_step_right", 0.0, -1.0),
    ),
}


@dataclass(frozen=True, slots=True)
class CourseScore:
    """How one person's course was understood: steps ``right`` at once and as ``settled`` by those that followed.

    ``rotation_deg`` was learned in the side steps.
    """

    person: str
    course: str
    steps: int
    right: int
    settled: int
    closing_m: float
    rotation_deg: float


def run_course(name: str, course: str, seed: int, quality: str = "industrial") -> CourseScore:
    """One person on one course; the same for the same seed."""
    person = BODY_TYPES[name]
    lengths_m = _lengths(person, course, [seed + 1000 * number for number in (1, 2, 3)], quality)
    motion, strides = _walked(person, course, seed, quality)
    classifier, rotation = MovementClassifier(), SideStepRotation()
    place, heading, settlement = np.zeros(2), 0.0, Settlement()
    truths, at_once = [_truth(motion, stride) for stride in strides], list[Direction]()
    for stride in strides:
        found = classifier.update(stride).direction
        at_once.append(found)
        heading += stride.turn_rad
        rotation.update(found, heading - 0.5 * stride.turn_rad, stride.end_ns * 1e-9)
        ways = {way: length * _towards(stride, rotation, way) for way, length in lengths_m.items()}
        place += settlement.step(ways, classifier.directions)
    right, settled = (_right(told, truths) for told in (at_once, _settled(strides)))
    rotation_deg = float(np.degrees(rotation.rotation_rad))
    return CourseScore(name, course, len(truths), right, settled, float(np.hypot(*place)), rotation_deg)


def _right(told: Sequence[Direction], truths: Sequence[set[Direction]]) -> int:
    return sum(one in allowed for one, allowed in zip(told, truths, strict=True))


def _share(right: Sequence[int], steps: FloatArray) -> str:
    """Percent of all steps, and of the worst course's."""
    return f"{100.0 * sum(right) / steps.sum():.1f} | {float((100.0 * np.array(right) / steps).min()):.1f}"


def _towards(stride: Stride, rotation: SideStepRotation, direction: Direction) -> FloatArray:
    """The unit vector east, north (2,) of a step that goes in this direction."""
    azimuth = heading_rad(stride) + rotation.correction_rad(direction)
    return np.array([np.sin(azimuth), np.cos(azimuth)])


def course_table(seeds: range = range(1, 10, 2)) -> str:
    """Markdown: a row for each body type, over both courses and these seeds."""
    lines = [
        "| body type | courses | steps right at once % | worst course % | settled % | worst course % "
        "| closing error %, mean | worst |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in BODY_TYPES:
        scores = [run_course(name, course, seed) for course in COURSES for seed in seeds]
        steps = np.array([score.steps for score in scores])
        at_once, settled = (
            _share([getattr(score, when) for score in scores], steps) for when in ("right", "settled")
        )
        closing = np.array([100.0 * score.closing_m / COURSE_M for score in scores])
        errors = f"{closing.mean():.2f} | {closing.max():.2f}"
        lines.append(f"| {name} | {len(scores)} | {at_once} | {settled} | {errors} |")
    return "\n".join(lines) + "\n"


def _walked(person: Person, course: str, seed: int, quality: str) -> tuple[PersonMotion, list[Stride]]:
    """The course as it was walked, and the steps on it."""
    legs, place = [], np.zeros(3)
    for gait, ahead, left in COURSES[course]:
        end = place + SIDE_M * np.array([ahead, left, 0.0])
        legs.append(Leg(gait, np.array([place, end]), facing_rad=0.0))
        place = end
    motion = move(person, Itinerary(tuple(legs), start_s=2.0), seed)
    imu = measure_imu(
        motion.torso,
        motion.duration_s,
        Mounting(),
        imu_class(quality),
        Magnetics(_CENTRAL_EUROPE),
        np.random.default_rng(seed),
    )
    return motion, [stride for stride in cut_strides(imu) if _truth(motion, stride)]


def _lengths(person: Person, course: str, seeds: Sequence[int], quality: str) -> dict[Direction, float]:
    """The person's own step lengths by direction, from other walks of known distances: steps as they are told."""
    count: Counter[Direction] = Counter()
    for seed in seeds:
        _, strides = _walked(person, course, seed, quality)
        count.update(_settled(strides))
    # A direction that was never told counts as one long step: the closing error shows it.
    return {direction: len(seeds) * SIDE_M / max(count[direction], 1) for direction in _DIRECTION.values()}


def _settled(strides: Sequence[Stride]) -> list[Direction]:
    """The direction of each step by all that is known `LAG` steps later."""
    if not strides:
        return []
    classifier, settled = MovementClassifier(), list[Direction]()
    for number, stride in enumerate(strides):
        found = classifier.update(stride).direction
        settled += [classifier.directions.settled(LAG)] if number >= LAG else []
    lags = range(min(LAG, len(strides)) - 1, 0, -1)
    return [*settled, *(classifier.directions.settled(lag) for lag in lags), found]


def _truth(motion: PersonMotion, stride: Stride) -> set[Direction]:
    """The direction of the leg; of both where the step spans the halt between two."""
    start_s, end_s = stride.start_ns * 1e-9, stride.end_ns * 1e-9
    return {
        _DIRECTION[activity.gait]
        for activity in motion.activities
        if activity.gait in _DIRECTION and activity.start_s < end_s and activity.end_s > start_s
    }


if __name__ == "__main__":
    typer.echo(course_table())
