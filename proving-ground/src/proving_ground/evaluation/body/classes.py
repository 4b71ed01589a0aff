"""Steps and movement classes through the whole chain (METHODS A1, A3, B1): who goes how, with a unit worn where.

A course of all classes by five body types, and walks at one speed each; what the navigator finds is held against
the simulator's footfalls and activities. And what is no walking at all: gestures, and rides in a vehicle.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from pdr_engine.body import BodySettings, BodyStepEstimate
from pdr_engine.body.pieces import FloatArray
from proving_ground.evaluation.body.course import BODY_TYPES
from proving_ground.evaluation.body.recorded_run import settled_names, walk_body
from proving_ground.evaluation.body.wearers import HAND, PLACEMENTS, Way, footfalls_s, walked, worn
from proving_ground.people import GaitName, Leg, PersonMotion
from proving_ground.sensors import Air

CLASSES = ("forward", "backward", "left", "right", "running", "stairs up", "stairs down", "crawling")
MISSED, STANDING = "missed", "standing"
_OF_GAIT: dict[GaitName, str] = {
    "walk": "forward",
    "backward": "backward",
    "side_step_left": "left",
    "side_step_right": "right",
    "run": "running",
    "sprint": "running",
    "crawl": "crawling",
}
_NS_PER_S = 1e9
_AROUND_S, _CLIMBING_M_S = 0.5, 0.1
SPEEDS_M_S: tuple[tuple[GaitName, float], ...] = (
    ("walk", 0.6),
    ("walk", 1.3),
    ("walk", 1.8),
    ("run", 2.8),
    ("sprint", 5.0),
)


@dataclass(slots=True)
class ClassScore:
    """Steps by what they were and what they were told to be, at once and as ``settled``; ``feet``, ``found``: steps
    made and steps found, by what they were."""

    told: Counter[tuple[str, str]] = field(default_factory=Counter)
    settled: Counter[tuple[str, str]] = field(default_factory=Counter)
    feet: Counter[str] = field(default_factory=Counter)
    found: Counter[str] = field(default_factory=Counter)

    def add(self, other: "ClassScore") -> None:
        """Together with another walk."""
        self.told += other.told
        self.settled += other.settled
        self.feet += other.feet
        self.found += other.found


def run_classes(body_type: str, placement: str, seed: int) -> ClassScore:
    """One person on the course of all classes; the same for the same seed."""
    motion = walked(BODY_TYPES[body_type], list(course(crawls=placement != HAND)), seed)
    run = worn(motion, placement, seed, "consumer", Air(origin_height_m=420.0, seed=seed))
    return score_classes(motion, walk_body(run, BodySettings()).steps)


def course(crawls: bool) -> Iterator[Leg]:
    """All classes, facing east all along; on all fours nobody holds anything ahead."""
    way = Way()
    stairs = [(3.2, 0.0, 2.0), (1.2, 0.0, 0.0), (3.2, 0.0, 2.0)]
    down = [(-ahead, aside, -up) for ahead, aside, up in stairs]
    yield way.to("walk", (30.0, 0.0, 0.0))
    yield way.to("side_step_left", (0.0, 8.0, 0.0), facing_rad=0.0)
    yield way.to("walk", (20.0, 0.0, 0.0))
    yield way.to("backward", (-12.0, 0.0, 0.0), facing_rad=0.0)
    yield way.hold("stand", 6.0)
    yield way.to("side_step_right", (0.0, -8.0, 0.0), facing_rad=0.0)
    yield way.to("run", (40.0, 0.0, 0.0))
    yield way.to("walk", (20.0, 0.0, 0.0))
    yield way.to("stairs", *stairs, riser_m=0.17)
    yield way.to("walk", (15.0, 0.0, 0.0))
    yield way.to("stairs", *down, riser_m=0.17)
    yield way.to("walk", (15.0, 0.0, 0.0))
    if crawls:
        yield way.to("crawl", (8.0, 0.0, 0.0))
        yield way.to("walk", (15.0, 0.0, 0.0))


def score_classes(motion: PersonMotion, steps: Sequence[BodyStepEstimate]) -> ClassScore:
    """Each step by the activity amid it; at the seams between two either counts as right."""
    score = ClassScore()
    names = settled_names(steps)
    for step in steps:
        said = told(step)
        later = names[step.time_ns].replace("_", " ") if step.time_ns in names else said
        true = _truths(motion, step.start_ns / _NS_PER_S, step.time_ns / _NS_PER_S)
        amid = _truth_at(motion, 0.5 * (step.start_ns + step.time_ns) / _NS_PER_S)
        score.told[said if said in true else amid, said] += 1
        score.settled[later if later in true else amid, later] += 1
        score.found[amid] += 1
    score.feet.update(_truth_at(motion, at_s) for at_s in footfalls_s(motion).tolist())
    return score


def told(step: BodyStepEstimate) -> str:
    """The name in `CLASSES`."""
    if step.motion == "stairs":
        return "stairs up" if step.height is not None and step.height.climb.up else "stairs down"
    return step.direction if step.motion == "walking" else str(step.motion)


def _truths(motion: PersonMotion, start_s: float, end_s: float) -> set[str]:
    return {_truth_at(motion, at_s) for at_s in np.linspace(start_s, end_s, 5).tolist()}


def _truth_at(motion: PersonMotion, at_s: float) -> str:
    """What was done then; landings are walked."""
    activity = next((one for one in motion.activities if one.start_s <= at_s < one.end_s), None)
    if activity is None:
        return STANDING
    if activity.gait != "stairs":
        return _OF_GAIT.get(activity.gait, STANDING)
    below, above = motion.torso.ground_m(np.array([at_s - _AROUND_S, at_s + _AROUND_S])).tolist()
    rate_m_s = (above - below) / (2.0 * _AROUND_S)
    if abs(rate_m_s) < _CLIMBING_M_S:
        return "forward"
    return "stairs up" if rate_m_s > 0.0 else "stairs down"


def classes_table(seeds: range = range(1, 2)) -> str:
    """Markdown: a confusion matrix over all placements and body types, and the share right by placement."""
    by_placement = {placement: _all_types(placement, seeds) for placement in PLACEMENTS}
    together = ClassScore()
    for score in by_placement.values():
        together.add(score)
    lines = [
        f"| was | steps | {' | '.join(f'{told} %' for told in CLASSES)} |",
        "|---" * (2 + len(CLASSES)) + "|",
    ]
    for true in (*CLASSES, STANDING):
        count = sum(together.told[true, told] for told in CLASSES)
        shares = " | ".join(_pct(together.told[true, told], count) for told in CLASSES)
        lines.append(f"| {true} | {count} | {shares} |")
    lines += [
        "",
        f"| right %: at once, settled | {' | '.join(CLASSES)} |",
        "|---" * (1 + len(CLASSES)) + "|",
    ]
    for name, score in (*by_placement.items(), ("all", together)):
        lines.append(f"| {name} | {' | '.join(_both(score, true) for true in CLASSES)} |")
    return "\n".join(lines) + "\n"


def _both(score: ClassScore, true: str) -> str:
    """The shares right, at once and settled."""
    return f"{_right(score.told, true)}, {_right(score.settled, true)}"


def _all_types(placement: str, seeds: range) -> ClassScore:
    score = ClassScore()
    for body_type in BODY_TYPES:
        for seed in seeds:
            score.add(run_classes(body_type, placement, seed))
    return score


def _right(steps: Counter[tuple[str, str]], true: str) -> str:
    return _pct(steps[true, true], sum(steps[true, told] for told in CLASSES))


def _pct(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.1f}" if whole else "–"


def run_speed(body_type: str, placement: str, gait: GaitName, speed_m_s: float, seed: int) -> tuple[int, int]:
    """Footfalls and steps found of half a minute at one speed."""
    way = Way()
    leg = way.to(gait, (25.0 * speed_m_s, 0.0, 0.0), speed_m_s=speed_m_s)
    motion = walked(BODY_TYPES[body_type], [leg], seed)
    steps = walk_body(worn(motion, placement, seed), BodySettings()).steps
    return len(footfalls_s(motion)), len(steps)


def speeds_table(seeds: range = range(1, 2)) -> str:
    """Markdown: steps found of those made, by placement and speed, over the body types."""
    head = " | ".join(f"{gait} {speed:g} m/s" for gait, speed in SPEEDS_M_S)
    lines = [f"| steps found of made % (worst walk) | {head} |", "|---" * (1 + len(SPEEDS_M_S)) + "|"]
    for placement in PLACEMENTS:
        cells = [_speed_cell(placement, gait, speed, seeds) for gait, speed in SPEEDS_M_S]
        lines.append(f"| {placement} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _speed_cell(placement: str, gait: GaitName, speed_m_s: float, seeds: range) -> str:
    counts = np.array(
        [run_speed(one, placement, gait, speed_m_s, seed) for one in BODY_TYPES for seed in seeds],
        dtype=np.float64,
    )
    share = 100.0 * counts[:, 1] / counts[:, 0]
    return f"{100.0 * counts[:, 1].sum() / counts[:, 0].sum():.1f} ({_farthest(share):.1f})"


def _farthest(share_pct: FloatArray) -> float:
    """The share that is farthest from all."""
    return float(share_pct[np.abs(share_pct - 100.0).argmax()])
