"""Makes docs/camera.md and its picture: what stereo odometry finds on rendered walks, alone and beside boots.

python -m proving_ground.evaluation.camera.page DOCS [FOLDER of rendered images, kept]
"""

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bootprint import logs
from pdr_engine.foot import warm_up
from proving_ground.evaluation.camera.defects import CASES, Found, measure
from proving_ground.evaluation.camera.defects import SEEDS as DEFECT_SEEDS
from proving_ground.evaluation.camera.defects import table as table_of_defects
from proving_ground.evaluation.camera.trials import FEET, RISE_M, SEEDS, Row, Trial, row_of, rows_of

SILENT_S = 25.0
_LIT, _DARK = "lit", "dark landing"
SOURCES = ("camera", *(name + more for name in FEET for more in ("", " and camera")))


def main(docs: Path, images: Path) -> None:
    """Write the page."""
    logs.configure("error")
    warm_up()
    trials = [Trial(seed, dark, images) for dark in (False, True) for seed in SEEDS]
    rows = [row for trial in trials for row in rows_of(trial)]
    silent = [_silent_row(trial) for trial in trials]
    found = [measure(case, seed, images) for case in CASES for seed in DEFECT_SEEDS]
    (docs / "img").mkdir(parents=True, exist_ok=True)
    save_tracks(trials, docs / "img" / "camera-tracks.png")
    (docs / "camera.md").write_text(page(rows, silent, trials, found), encoding="utf-8")


def _silent_row(trial: Trial) -> Row:
    """Both feet fall silent on the way; then the camera carries on alone."""
    fused = trial.fused(FEET["both feet"], camera=True, silent_after_s=SILENT_S)
    return row_of(trial, "feet silent", fused.score("start"))


def page(rows: Sequence[Row], silent: Sequence[Row], trials: Sequence[Trial], found: Sequence[Found]) -> str:
    """The page's text."""
    pairs = sum(len(trial.walked.time_s) for trial in trials)
    cost_ms = 1e3 * sum(trial.walked.seconds for trial in trials) / pairs
    defects = "\n".join(table_of_defects(found))
    return f"""# The stereo camera

Made by `make figures`; do not edit. The gateway turns rectified stereo pairs into `camera_motion`; the fusion takes
it beside boots and satellites. How it is done is said in `sensor_gateway.stereo.odometry` and `fusion.camera`.

## What it does

Corners are spread over the view, placed by their disparity, and followed from the newest key frame; the motion is
found by P3P and RANSAC and refined over pose and landmarks together, each weighing by its own doubt in pixels. A
message tells the motion since the key frame, with its covariance: one that starts where the last one started
replaces it. Images are evened first, so that exposure leaves no trace. In which rows the right eye sees what the
left one sees tells how it really looks (`stereo.right_eye`), and whether near and far landmarks agree on the way
tells how far it is turned in (`stereo.turned_in`): an eye that was knocked is turned back. How far off sights are
is judged by all of them, so that a rolling shutter or a lens makes motions less sure and no crowd. A blurred view
makes no key frame, and after moments without sight (up to 3 s) the key frame is recognised by its patches if it is
still in view, so that the chain holds. Nothing is told, and the gateway's health says why, when a verdict speaks
against it:

| verdict | when |
|---|---|
| `dark` | hardly any light, or the amplifier's noise drowns what there is |
| `smoke` | light, but no structure |
| `close_wall` | what both eyes see is nearer than 0.6 m and cannot be followed |
| `crowd` | of the landmarks that should be in view too few are where they should be |
| `few_landmarks`, `bad_image` | nothing to follow, or no image |

People who fill the view and move alike deceive it: a camera without an inertial unit cannot tell them from a room.
With one (`imu = "camera"`, the place of a unit beside the camera with axes forward, left, up) an EKF of 15 states
compares what was seen with what was felt, tells where up is, and bridges half a second without sight.

The fusion levels the camera's steps, learns how the camera is tilted from the heights that boots tell, and holds
camera and feet together as METHODS D6 says: same horizontal position, constant vertical offset. While feet are
silent the camera carries the position (mode `camera`) and takes the feet's part of the state along; feet that come
back join it as they join each other, and lead again. The body's steps do not count meanwhile. After a gap the
camera joins anew. Saved state and the smoother are of feet only. Well placed landmarks of each key frame go with
its first motion, for the map of rooms ([rooms.md](rooms.md)): walls, and the space before them.

```toml
[[gateway.sources]]          # live: two devices of rectified images
kind = "camera"
left = 0
right = 2
calibration = "calib.txt"    # P0: and P1:, 3x4 each

[[gateway.sources]]          # or a recorded camera folder
kind = "replay"
path = "walk"
```

MAVLink modules that do their own odometry enter by the same message (`ODOMETRY`, `VISION_POSITION_DELTA`).

## On rendered walks

{len(SEEDS)} walks of 60 m over two floors, {RISE_M} m apart, images of 320x240 at 10 Hz, the landing of the stair
lit or dark (seeds {", ".join(map(str, SEEDS))}; faults were found on them, but no constant was chosen). The camera
alone is laid over the first 5 m of its poses, fused tracks over all of the person's, by yaw and offset; the
camera's track begins with its true attitude. Median / worst:

{table(rows)}

With both feet silent after {SILENT_S:.0f} s, camera and all before it, over the first 5 m: the end is
{_figures([row for row in silent if row["landing"] == _LIT], "final_m")} m off when lit,
{_figures([row for row in silent if row["landing"] == _DARK], "final_m")} m with the dark landing.

![tracks from above](img/camera-tracks.png)

## By cameras that are not as their calibration says

`python -m proving_ground.evaluation.camera.defects FOLDER`: 21 m round the corner of a corridor on foot, and 50 m
down a street by car (1226x370, 0.54 m between the eyes, houses, three cars), a defect each; seeds
{", ".join(map(str, DEFECT_SEEDS))} (choices were made on even ones). The camera alone, laid over the first 5 m.

{defects}

## Cost

{cost_ms:.0f} ms of processor time a pair of 320x240 on the machine that made this page.
"""


def table(rows: Sequence[Row]) -> str:
    """A line for each choice of sources and light."""
    lines = ["| sources | landing | RMSE m | end m | end % | height m |", "|---|---|--:|--:|--:|--:|"]
    for sources in SOURCES:
        for light in (_LIT, _DARK):
            own = [row for row in rows if row["sources"] == sources and row["landing"] == light]
            columns = ("rmse_m", "final_m", "final_pct", "height_final_m")
            cells = " | ".join(_figures(own, column) for column in columns)
            lines.append(f"| {sources} | {light} | {cells} |")
    return "\n".join(lines)


def _figures(rows: Sequence[Row], column: str) -> str:
    values = [float(value) for row in rows if (value := row[column]) is not None]
    return f"{np.median(values):.2f} / {max(values):.2f}" if values else "–"


def save_tracks(trials: Sequence[Trial], path: Path) -> None:
    """The camera alone over its poses, from above: lit and dark landings of every seed."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, len(SEEDS), figsize=(12, 7), squeeze=False)
    for axis, trial in zip(axes.flat, trials, strict=True):
        truth, track = trial.images.truth["camera"].position_m, trial.walked.track.position_m
        axis.plot(truth[:, 0], truth[:, 1], color="0.6", linewidth=4)
        axis.plot(track[:, 0] + truth[0, 0], track[:, 1] + truth[0, 1], color="tab:blue")
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_title(f"seed {trial.seed}, {_DARK if trial.dark_landing else _LIT}", fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


if __name__ == "__main__":
    if len(sys.argv) > 2:
        main(Path(sys.argv[1]), Path(sys.argv[2]))
    else:
        with tempfile.TemporaryDirectory() as kept:
            main(Path(sys.argv[1]), Path(kept))
