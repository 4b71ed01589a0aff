"""Makes docs/foot-ins.md and its pictures: what the foot INS finds on the recorded data, and what it costs.

python -m proving_ground.evaluation.foot.figures DATA DOCS
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bootprint import logs
from pdr_engine.foot import METHODS, FootSettings
from proving_ground.evaluation.evaluate import FUSED, Evaluated, evaluate_task, plan
from proving_ground.evaluation.foot.ablation import ABLATIONS, plain, rmse_of
from proving_ground.evaluation.foot.cross_fit import cross_fit
from proving_ground.evaluation.foot.long_walks import SEEDS, compare_all
from proving_ground.evaluation.foot.motion_page import motion_findings
from proving_ground.evaluation.foot.page import Findings, page
from proving_ground.evaluation.foot.plots import save_shares, save_tracks
from proving_ground.evaluation.foot.robustness import degradations
from proving_ground.evaluation.foot.stance_examples import SETS as TRAINED_ON
from proving_ground.evaluation.foot.stance_examples import training_feet
from proving_ground.performance.foot_benchmark import measure, walk_of
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import Run

SETS = ("pyshoe-vicon", "foot-gcp", "xio-gait", "gaitmap-example", "dualfoot-fgo")
# Recordings of stairs, without truth: they belong to no set.
STAIRS = tuple(f"gaitmap-example/imu_sample_healthy_stair_{way}.csv" for way in ("up", "down"))
WALKED = SETS[:2]  # the sets with enough runs to compare methods and choices by
DEFAULT = FootSettings().method
_TURNS = 3
_CROSS_FIT_FEET = 4  # a half of fewer teaches nothing


@dataclass(frozen=True, slots=True)
class DataSet:
    """One set: its runs, every foot by every method, and both feet fused by the default."""

    name: str
    runs: list[Run]
    feet: list[Evaluated]
    fused: list[Evaluated]

    def by(self, method: str) -> list[Evaluated]:
        """The feet of one method."""
        return [evaluated for evaluated in self.feet if evaluated.task.method == method]

    def errors_m(self, method: str) -> list[float]:
        """The known 2-D RMSE of one method's feet."""
        return [float(rmse) for e in self.by(method) if (rmse := e.row["rmse_m"]) is not None]


def main(data: Path, docs: Path, seeds: Sequence[int] = SEEDS) -> None:
    """Write the page for the sets that are in ``data``; ``seeds`` are those of the simulated long walks."""
    logs.configure("error")
    images = docs / "img"
    images.mkdir(parents=True, exist_ok=True)
    sets = [evaluated_set(data / name) for name in SETS if (data / name).is_dir()]
    walked = [one for one in sets if one.name in WALKED]
    save_tracks([run for one in walked for run in middle_and_worst(one)], images / "foot-tracks.png")
    shares = {one.name: {method: one.errors_m(method) for method in METHODS} for one in walked}
    save_shares(shares, DEFAULT, images / "foot-shares.png")
    findings = Findings(
        rows={one.name: [evaluated.row for evaluated in one.feet] for one in sets},
        runs={one.name: [evaluated.row for evaluated in one.by(DEFAULT) + one.fused] for one in sets},
        plain={one.name: {method: rmse_of(plain(method), one.runs) for method in METHODS} for one in walked},
        ablation={
            one.name: {variant.name: rmse_of(variant, one.runs) for variant in ABLATIONS} for one in walked
        },
        motion=motion_findings(
            {one.name: one.by(DEFAULT) for one in sets},
            [run for name in STAIRS for run in climbed(data / name)],
        ),
        cost=measure(walk_of(None), _TURNS),
        faults={one.name: list(degradations(one.runs)) for one in walked},
        cross_fit=cross_fit(data) if len(training_feet(data, TRAINED_ON[0])) >= _CROSS_FIT_FEET else None,
        long_walks=compare_all(seeds) if seeds else {},
    )
    (docs / "foot-ins.md").write_text(page(findings), encoding="utf-8")


def climbed(path: Path) -> list[Evaluated]:
    """Both feet of a recording on stairs by the default; none if it is not there."""
    runs = load_runs([path]) if path.is_file() else []
    return [evaluate_task(task, "best-fit") for task in plan(runs, "foot", [DEFAULT])] if runs else []


def evaluated_set(path: Path) -> DataSet:
    """Every foot of a set by every method; both feet together by the default."""
    runs = load_runs([path])
    feet = [evaluate_task(task, "best-fit") for task in plan(runs, "foot", METHODS)]
    dual = [run for run in runs if run.kind == "dual"]
    together = [task for task in plan(dual, None, [DEFAULT]) if task.place == FUSED] if dual else []
    return DataSet(path.name, runs, feet, [evaluate_task(task, "best-fit") for task in together])


def middle_and_worst(one: DataSet) -> Sequence[Evaluated]:
    """The default's run of median error, and its worst."""
    known = [evaluated for evaluated in one.by(DEFAULT) if evaluated.row["rmse_m"] is not None]
    ordered = sorted(known, key=lambda evaluated: float(evaluated.row["rmse_m"] or 0.0))
    return (ordered[(len(ordered) - 1) // 2], ordered[-1])


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
