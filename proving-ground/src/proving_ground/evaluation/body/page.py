"""Makes docs/body-module.md and its pictures: what the body module finds on the recorded walks, and what it costs.

python -m proving_ground.evaluation.body.page DATA DOCS
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bootprint import logs
from pdr_engine.body import BodySettings
from pdr_engine.body.methods import DEFAULT, METHODS
from pdr_engine.body.settings import LengthSettings
from proving_ground.evaluation.alignment import fit_rigid, interpolated
from proving_ground.evaluation.body.parts_page import chain_page, parts_page
from proving_ground.evaluation.body.picture import save_classes
from proving_ground.evaluation.body.recorded_run import body_track, walk_body
from proving_ground.evaluation.body.train import SET, cross_fit
from proving_ground.evaluation.evaluate import Evaluated, evaluate_task, plan
from proving_ground.evaluation.scoring import score_track
from proving_ground.performance.body_benchmark import measure_body, simulated_belt
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import FloatArray, Run

# What each method is, in the order of the table.
MEANINGS = {
    DEFAULT: "step length by pendulum and frequency, azimuth by gyro, held by the compass where undisturbed",
    "pendulum": "length by the trunk's rise alone (Zijlstra and Hof)",
    "a1": "length by step frequency (A1)",
    "weinberg": "length by the acceleration's range",
    "c2": "length by the neural network (C2; trained on these walks)",
    "gyro-only": "azimuth by the gyro from the first compass reading",
    "compass-only": "azimuth by the tilt-compensated compass (A4)",
    "c3": "the same with two coils (C3)",
    "b2": "compass by Savitzky–Golay and Kalman cascade (B2)",
    "a7": "gyro bridge, Kalman bias (A7)",
    "a7-direct": "gyro bridge, bias as it is found (A7, eq. 4.4)",
    "a7-weighted": "gyro bridge, weighted bias (A7, eq. 4.12)",
    "b3-stride": "gyro averaged over left and right (B3)",
    "b3-wavelet": "gyro by sym8 wavelet (B3)",
    "without-a3": "default without movement classes (A3, B1)",
    "without-a5": "default without calibration on line (A5)",
    "without-b6": "default without strategies for quick turns and the way back (B6)",
    "c4": "default's steps, fixes by the PNS/GPS filter (C4); there are none here",
    "weinberg-compass": "textbook's pedometer: Weinberg and compass",
    "weinberg-gyro": "textbook's pedometer: Weinberg and gyro",
    "a1-compass": "A1 and compass",
    "a1-gyro": "A1 and gyro",
}
_FACTORS = (1.01, 1.03, 1.05, 1.07, 1.09)


def main(data: Path, docs: Path) -> None:
    """Write the page of the set in ``data``."""
    logs.configure("error")
    runs = load_runs([data / SET], "body")
    rows = [evaluate_task(task, "best-fit") for task in plan(runs, "body", METHODS)]
    (docs / "img").mkdir(parents=True, exist_ok=True)
    save_tracks([one for one in rows if one.task.method == DEFAULT], docs / "img" / "body-tracks.png")
    save_classes(docs / "img" / "body-classes.png")
    text = page(
        rows, turned_m(runs), left_out(runs), cross_fit(runs), chain_page(data), parts_page(data / SET)
    )
    (docs / "body-module.md").write_text(text, encoding="utf-8")


def page(
    rows: Sequence[Evaluated],
    turned: FloatArray,
    held_out: FloatArray,
    network_pct: Sequence[float],
    chain: str,
    parts: str,
) -> str:
    """The page's text."""
    cost = measure_body(simulated_belt(seed=1), turns=3)
    network = np.abs(network_pct)
    rmse, distance = held_out[:, 0], np.abs(held_out[:, 1])
    return f"""# The body-worn module

Made by `make figures`; do not edit. A unit on trunk or in hand tells steps, each with a length and an azimuth
(`body_step`). How it is done is said in the modules of `pdr_engine.body`, first of all `navigator`.

## On recorded walks

{SET}: {len({one.task.run.name for one in rows})} walks through malls, phone in hand, way-points every five to ten
seconds; one configuration, after a rigid fit of yaw and offset: `bootprint evaluate {SET} --method all`.

{method_table(rows)}

The constants of step length (`hand_factor`, `turn_shortening_s`, the frequency model) and of heading
(`correlation_steps`, `disturbance_floor`) were chosen on these walks, so the table flatters. With the factor of the
hand chosen for each walk on all the others: RMSE mean {rmse.mean():.2f} m, worst {rmse.max():.2f} m, mean absolute
distance error {distance.mean():.1f} %. The network trained on the other half of the walks misses distances by
{network.mean():.1f} % in the mean, {network.max():.1f} % at worst (sums of way-point intervals).

Tracks are added up in their own frame (`track_azimuth_rad`), which the fit turns as a whole. Steps of the default
added up by `azimuth_rad`, which turns as the compass finds north: RMSE mean {turned.mean():.2f} m, worst
{turned.max():.2f} m.

NEES (2 when honest) and the share inside the 95 % ellipse are of ten-second displacements; they hold the
way-points' own inaccuracy too.

![estimated tracks over way-points](img/body-tracks.png)

## By walk

{walk_table([one for one in rows if one.task.method == DEFAULT])}

## The whole chain

Simulated people and what their units measure, through the navigator as on the bus. Choices were made with even
seeds; the tables are of odd ones.

![height and movement class of every step](img/body-classes.png)

{chain}
## Parts

{parts}
## Cost

{cost.us_per_sample:.0f} µs of processor time a sample: {cost.core_pct:.2f} % of a core at 100 Hz
(`bootprint benchmark body`).
"""


def column(rows: Sequence[Evaluated], name: str) -> FloatArray:
    """The known figures of a column."""
    return np.array([float(value) for one in rows if (value := one.row[name]) is not None])


def method_table(rows: Sequence[Evaluated]) -> str:
    """A line for each method."""
    lines = [
        "| method | | RMSE mean m | median | worst | distance mean abs. error % | NEES | inside 95 % |",
        "|---|---|--:|--:|--:|--:|--:|--:|",
    ]
    for method in METHODS:
        own = [one for one in rows if one.task.method == method]
        rmse = column(own, "rmse_m")
        lines.append(
            f"| {method} | {MEANINGS[method]} | {rmse.mean():.2f} | {np.median(rmse):.2f} | {rmse.max():.2f} | "
            f"{np.abs(column(own, 'distance_error_pct')).mean():.1f} | {column(own, 'nees').mean():.1f} | "
            f"{column(own, 'inside_95_pct').mean():.0f} |"
        )
    return "\n".join(lines)


def walk_table(rows: Sequence[Evaluated]) -> str:
    """A line for each walk by the default."""
    lines = ["| walk | m | RMSE m | end m | distance error % | steps |", "|---|--:|--:|--:|--:|--:|"]
    lines += [
        f"| {one.row['run']} | {one.row['distance_m']:.0f} | {one.row['rmse_m']:.2f} | {one.row['final_m']:.2f} | "
        f"{one.row['distance_error_pct']:+.1f} | {one.row['strides']} |"
        for one in rows
    ]
    return "\n".join(lines)


def turned_m(runs: Sequence[Run]) -> FloatArray:
    """RMSE m (n,) of each walk's default steps added up by their azimuths from north."""
    found = []
    for run in runs:
        steps = [
            replace(step, track_azimuth_rad=step.azimuth_rad) for step in walk_body(run, BodySettings()).steps
        ]
        score = score_track(body_track(steps, run.imus["body"]), run.truth["body"]).score
        found.append(score.rmse_m or 0.0)
    return np.array(found)


def left_out(runs: Sequence[Run]) -> FloatArray:
    """RMSE m and distance error % (n, 2) of each walk with the hand's factor that suits the others best."""
    scores = np.array([[_scored(run, factor) for factor in _FACTORS] for run in runs])
    held = []
    for index in range(len(runs)):
        others = np.delete(scores[:, :, 0], index, axis=0).mean(axis=0)
        held.append(scores[index, int(np.argmin(others))])
    return np.array(held)


def _scored(run: Run, hand_factor: float) -> tuple[float, float]:
    imu = run.imus["body"]
    steps = walk_body(run, BodySettings(length=LengthSettings(hand_factor=hand_factor))).steps
    score = score_track(body_track(steps, imu), run.truth["body"]).score
    return score.rmse_m or 0.0, score.distance_error_pct or 0.0


def save_tracks(rows: Sequence[Evaluated], path: Path) -> None:
    """Every walk's track, fitted, over its way-points."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(3, 5, figsize=(15, 9))
    for axis, one in zip(axes.flat, rows, strict=False):
        truth, track = one.task.run.truth["body"], one.estimate.track
        points = interpolated(truth.time_s, track.time_s, track.position_m)[:, :2]
        fitted = fit_rigid(points, truth.position_m[:, :2]).apply(track.position_m)
        axis.plot(*truth.position_m[:, :2].T, "o-", color="0.6", markersize=3)
        axis.plot(*fitted.T, color="tab:blue")
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_title(f"{one.row['rmse_m']:.2f} m", fontsize=9)
    for axis in axes.flat[len(rows) :]:
        axis.set_axis_off()
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
