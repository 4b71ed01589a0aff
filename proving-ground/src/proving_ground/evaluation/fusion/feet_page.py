"""Makes docs/fusion-feet.md: two feet as one, on recorded and simulated walks; the smoother; damages.

python -m proving_ground.evaluation.fusion.feet_page DATA DOCS
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from bootprint import logs
from proving_ground.evaluation.alignment import Align
from proving_ground.evaluation.evaluate import Row, evaluate_task, methods_of, plan
from proving_ground.evaluation.fusion.damages import damages_table, findings
from proving_ground.evaluation.fusion.dual import OWN_METHODS
from proving_ground.evaluation.fusion.loops import loops_table, walked_loops
from proving_ground.evaluation.fusion.straight_line import LENGTH_M, straight_line, straight_line_table
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import Kind

SETS = ("dualfoot-fgo", "gaitmap-example")
_ALIGNS: Sequence[Align] = ("start", "best-fit")
_HEAD = """# Two feet as one

Made by `make figures`. How the methods work stands in the modules: `fusion.models.dual_foot` (what a foot's step
tells of the other's place), `fusion.models.shared_errors` (scale, slope and turn that steps share, as states),
`fusion.coupling` (gates, and which foot to doubt), `fusion.smoother`. Constants were chosen on simulated walks of
even seeds, not on those below. The recorded dual walk has been looked at meanwhile: it showed that the middle of a
turning step lies off its chord, and that feet join better where each tells where the other stood.
"""


def page(data: Path | None) -> str:
    """The whole page; without ``data`` the recorded walks are left out."""
    parts = [_HEAD]
    if data is not None:
        parts += [_RECORDED, *_recorded(data)]
    parts += [_LINE.format(length=LENGTH_M), *straight_line_table(straight_line())]
    parts += [_LOOPS, *loops_table(walked_loops())]
    parts += [_DAMAGES, *damages_table(list(findings()))]
    return "\n".join(parts) + "\n"


_RECORDED = """
## Recorded walks

2-D RMSE in m of each foot, and of the body over them. `foot` is each foot alone; `dual` as fusion has it at the
time (`learned`: the default; `same-position`: METHODS D4 with σ = 1 m on our feet's steps, `uncoupled`: neither,
`joint-18`: the papers' 18 states sample by sample, on textbook INS), `smoothed` as it is known afterwards.
dualfoot-fgo: Azurehappen/Constrained-ZUPT-FGO (MIT); gaitmap-example: mad-lab-fau/gaitmap (MIT).

| run | alignment | kind | method | left | right | body |
|---|---|---|---|---|---|---|"""
_LINE = """
## FOI's straight line

{length:.0f} m, eleven simulated walks of three people, odd seeds. The gyros turn oppositely too far while the feet
swing, which no rest can show. Each walk starts at a known point in a known direction. End errors.
"""
_LOOPS = """
## Long way, ordinary units

Simulated people with industrial units walk 540 m round a yard, odd seeds, no satellites: 2-D RMSE of each foot
after a best fit, alone and together, and after smoothing.
"""
_DAMAGES = """
## One walk, damaged

270 m, simulated, a start given, no satellites unless named. Errors are of the published position, without a fit.
The bounds were set for this walk after the first runs of it had shown what is usual; what they hold is behaviour,
not accuracy. When nobody sees a soldier turn a corner, as when a gateway dies there, the heading is lost until
satellites tell it; the linearised filter does not say how much.
"""


def _recorded(data: Path) -> Iterator[str]:
    for name in SETS:
        if not (data / name).is_dir():
            continue
        for align in _ALIGNS:
            yield _line(name, align, "foot", "learned", _rows(data / name, align, "foot", None))
            for method in ("learned", *OWN_METHODS):
                yield _line(name, align, "dual", method, _rows(data / name, align, "dual", method))
            yield _line(
                name, align, "smoothed", "learned", _rows(data / name, align, "dual", None, smoothed=True)
            )


def _rows(path: Path, align: Align, kind: Kind, method: str | None, *, smoothed: bool = False) -> list[Row]:
    runs = [run for run in load_runs([path], "dual") if run.truth and len(run.imus) > 1]
    tasks = plan(runs, kind, methods_of(method), smoothed=smoothed)
    return [evaluate_task(task, align).row for task in tasks]


def _line(run: str, align: str, kind: str, method: str, rows: Sequence[Row]) -> str:
    cells = [_rmse(rows, place) for place in ("left", "right", "fused")]
    return f"| {run} | {align} | {kind} | {method} | {' | '.join(cells)} |"


def _rmse(rows: Sequence[Row], place: str) -> str:
    found = [row["rmse_m"] for row in rows if str(row["run"]).endswith(f"/{place}")]
    known = [float(value) for value in found if value is not None]
    return f"{np.mean(known):.3f}" if known else "–"


def main(data: Path, docs: Path) -> None:
    """Write the page."""
    logs.configure("error")
    (docs / "fusion-feet.md").write_text(page(data if data.is_dir() else None), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
