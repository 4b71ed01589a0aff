"""What faults of the sensor do to the foot INS: the same runs, each fault put into all of them alone.

    python -m proving_ground.evaluation.foot.robustness DATA/SET...        (a table on standard output)

Errors are against the whole truth, as in `evaluate`; the faults are in `evaluation.foot.faults`.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bootprint import logs
from bootprint.config import convert
from proving_ground.evaluation.alignment import Track
from proving_ground.evaluation.evaluate import step_chain
from proving_ground.evaluation.foot.faults import FAULTS, Fault
from proving_ground.evaluation.scoring import Score, score_track
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import FEET, ImuSeries, Run, Truth

_NS_PER_S = 1e9
HEADER = (
    "| fault | RMSE m: median / mean / worst | height m: median / mean / worst | inside 95 % | n |\n"
    "|---|---|---|---|---|"
)


@dataclass(frozen=True, slots=True)
class Degradation:
    """One fault over some runs: RMSE (n,) in the plane and height error at the end (k ≤ n,) in m, % inside 95 %."""

    fault: str
    rmse_m: Sequence[float]
    height_m: Sequence[float]
    inside_95_pct: Sequence[float]

    def row(self) -> str:
        """The row of a Markdown table."""
        inside = f"{np.mean(self.inside_95_pct):.0f}" if self.inside_95_pct else "–"
        cells = (self.fault, _three(self.rmse_m), _three(self.height_m), inside, str(len(self.rmse_m)))
        return f"| {' | '.join(cells)} |"


def degradations(runs: Sequence[Run], faults: Sequence[Fault] = FAULTS) -> Iterator[Degradation]:
    """Every fault's figures over every foot whose run tells its way."""
    for fault in faults:
        scores = [score for run in runs for score in _scores(run, fault)]
        yield Degradation(
            fault.name,
            [score.rmse_m for score in scores if score.rmse_m is not None],
            [score.height_final_m for score in scores if score.height_final_m is not None],
            [score.inside_95_pct for score in scores if score.inside_95_pct is not None],
        )


def _scores(run: Run, fault: Fault) -> Iterator[Score]:
    for place in FEET:
        truth = run.truth_of(place)
        if place in run.imus and truth is not None:
            yield score_with(fault, run.imus[place], truth)


def score_with(fault: Fault, imu: ImuSeries, truth: Truth) -> Score:
    """The default navigator's score on a recording with this fault."""
    from pdr_engine.foot import FootNavigator, FootSettings

    navigator = FootNavigator(convert({"sensor": fault.sensor}, FootSettings, where=fault.name))
    changed = fault.change(imu)
    time_ns = np.round(changed.time_s * _NS_PER_S).astype(np.int64)
    outputs = (
        navigator.process(time_ns, changed.accel_m_s2, changed.gyro_rad_s, changed.mag_ut),
        navigator.finish(),
    )
    track = Track(
        np.concatenate([output.time_ns for output in outputs]) / _NS_PER_S,
        np.concatenate([output.position_m for output in outputs]),
    )
    steps = [step for output in outputs for step in output.steps]
    return score_track(track, truth, steps=step_chain(steps)).score


def degradation_table(found: Sequence[Degradation]) -> str:
    """A Markdown table of them."""
    return "\n".join([HEADER, *(one.row() for one in found)])


def _three(values: Sequence[float]) -> str:
    if not values:
        return "–"
    return f"{np.median(values):.3f} / {np.mean(values):.3f} / {np.max(values):.3f}"


def main(paths: Sequence[Path]) -> None:
    """The command: one table a data set."""
    logs.configure("error")
    for path in paths:
        sys.stdout.write(f"\n{path.name}\n\n{HEADER}\n")
        for one in degradations(load_runs([path])):
            sys.stdout.write(one.row() + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main([Path(argument) for argument in sys.argv[1:]])
