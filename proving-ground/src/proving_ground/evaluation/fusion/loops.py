"""Long walks of both feet round a yard: each foot alone, both together, and both afterwards."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proving_ground.evaluation.alignment import Track
from proving_ground.evaluation.fusion.dual import feet_through, foot_messages
from proving_ground.evaluation.fusion.dual_walks import dual_walk
from proving_ground.evaluation.scoring import score_track
from sensor_gateway.recordings.run import FEET, Run

SEEDS = range(401, 413, 2)
_ROUND = [(60.0, 0.0), (60.0, 30.0), (0.0, 30.0), (0.0, 0.0)]
WAY_M = [(0.0, 0.0), *_ROUND, *_ROUND, *_ROUND]


@dataclass(frozen=True, slots=True)
class Loops:
    """One walk: 2-D RMSE of (left, right) after a best fit, m."""

    seed: int
    alone_m: tuple[float, float]
    same_position_m: tuple[float, float]
    together_m: tuple[float, float]
    smoothed_m: tuple[float, float]

    @property
    def worse_than_better(self) -> float:
        """The worse foot together over the better foot alone."""
        return max(self.together_m) / min(self.alone_m)


def walked_loops(seeds: Sequence[int] = SEEDS) -> list[Loops]:
    """A walk of every seed."""
    return [_walked(seed) for seed in seeds]


def _walked(seed: int) -> Loops:
    run = dual_walk(WAY_M, seed).run
    messages = foot_messages(run)
    return Loops(
        seed,
        _rmse_m(run, feet_through(messages, "none")),
        _rmse_m(run, feet_through(messages, "same_position")),
        _rmse_m(run, feet_through(messages)),
        _rmse_m(run, feet_through(messages, smoothed=True)),
    )


def _rmse_m(run: Run, tracks: dict[str, Track]) -> tuple[float, float]:
    scores = [score_track(tracks[place], run.truth[place]).score.rmse_m for place in FEET]
    left, right = (float("nan") if score is None else score for score in scores)
    return left, right


def loops_table(walks: Sequence[Loops]) -> list[str]:
    """Lines of a Markdown table; left / right, m."""
    lines = [
        "| seed | alone | same position | together | smoothed | worse foot together over better alone |",
        "|---|---|---|---|---|---|",
    ]
    for walk in walks:
        pairs = (walk.alone_m, walk.same_position_m, walk.together_m, walk.smoothed_m)
        cells = " | ".join(f"{left:.2f} / {right:.2f}" for left, right in pairs)
        lines.append(f"| {walk.seed} | {cells} | {walk.worse_than_better:.2f} |")
    every = np.array([[w.alone_m, w.same_position_m, w.together_m, w.smoothed_m] for w in walks])
    for name, of in (("median", np.median), ("mean", np.mean), ("worst", np.max)):
        cells = " | ".join(f"{left:.2f} / {right:.2f}" for left, right in of(every, axis=0))
        lines.append(f"| {name} | {cells} | {of([walk.worse_than_better for walk in walks]):.2f} |")
    return lines
