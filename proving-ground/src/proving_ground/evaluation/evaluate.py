"""Estimators over recorded runs: one row of figures per run, place and method. No printing, no plotting.

Every run goes through the same core as on the bus, in batches of ten samples. The time per sample is the
estimator's own processor time: nothing is read meanwhile, and its code is compiled before the clock starts.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bootprint.config import Origin, convert
from bootprint.errors import ConfigError
from bootprint.topics import Identity
from proving_ground.evaluation.alignment import Align, Track, count_strides, true_strides
from proving_ground.evaluation.consistency import StepChain
from proving_ground.evaluation.floors import Floors, floors_right_pct
from proving_ground.evaluation.fusion.joint_ins import METHOD as JOINT
from proving_ground.evaluation.scoring import Scored, score_track
from sensor_gateway.recordings.run import FEET, ImuSeries, Kind, Run

if TYPE_CHECKING:
    from pdr_engine.foot import FootStepEstimate

Row = dict[str, str | float | int | None]
BATCH = 10
ALL = "all"
FUSED = "fused"
BODY, CAMERA = "body", "camera"
_IDENTITY = Identity("evaluate", "evaluate", "evaluate")
_ORIGIN = Origin(latitude_deg=0.0, longitude_deg=0.0)  # any: only local coordinates are compared
_NS_PER_S = 1e9
KINDS: tuple[Kind, ...] = ("foot", "dual", "body", "camera")


@dataclass(frozen=True, slots=True)
class Estimate:
    """What an estimator made of a run: its track, its steps (None if it has none) and what it cost.

    ``told``: the same steps with all that the estimator says of them; ``floors``: where it tells any.
    """

    track: Track
    steps: StepChain | None
    strides: int | None
    samples: int
    seconds: float
    told: Sequence["FootStepEstimate"] = ()
    floors: Floors | None = None


@dataclass(frozen=True, slots=True)
class Task:
    """One row to be: a run, the place (left_foot, right_foot, body, camera) and the method."""

    run: Run
    kind: Kind
    place: str
    method: str
    name: str
    smoothed: bool = False


@dataclass(frozen=True, slots=True)
class Evaluated:
    """A finished task: its row, and what plots need."""

    task: Task
    estimate: Estimate
    scored: Scored
    row: Row


def methods_of(choice: str | None) -> tuple[str, ...]:
    """The methods to run: each kind's default, the one named, or all; ConfigError on an unknown name."""
    from pdr_engine.body.methods import DEFAULT
    from pdr_engine.foot import FootSettings
    from proving_ground.evaluation.camera.recorded_run import METHODS as CAMERA_METHODS

    if choice is None:
        return (FootSettings().method, DEFAULT, CAMERA_METHODS[0])
    known = tuple(dict.fromkeys(name for kind in KINDS for name in _known_to(kind)))
    if choice == ALL:
        return known
    if choice not in known:
        raise ConfigError(f"--method {choice!r} is unknown; known: {', '.join((*known, ALL))}")
    return (choice,)


def _known_to(kind: Kind) -> tuple[str, ...]:
    """The methods that a kind's estimator has."""
    from pdr_engine.body.methods import METHODS as BODY_METHODS
    from pdr_engine.foot import METHODS
    from proving_ground.evaluation.camera.recorded_run import METHODS as CAMERA_METHODS
    from proving_ground.evaluation.fusion.dual import OWN_METHODS

    by_kind = {"body": BODY_METHODS, "camera": CAMERA_METHODS, "dual": (*METHODS, *OWN_METHODS)}
    return by_kind.get(kind, METHODS)


def plan(
    runs: Sequence[Run], kind: Kind | None, methods: Sequence[str], *, smoothed: bool = False
) -> list[Task]:
    """Every row to compute, in order: runs, then places, then methods; ConfigError if there is none.

    ``smoothed``: tracks as known afterwards; only of two feet, for one alone has nothing to be corrected by.
    """
    tasks = [task for run in runs for task in _tasks(run, kind or run.kind, methods)]
    if smoothed:
        tasks = [
            replace(task, smoothed=True) for task in tasks if task.kind == "dual" and task.method != JOINT
        ]
        if not tasks:
            raise ConfigError("--smoothed: nothing to smooth; there must be runs of two feet (kind dual)")
    if not tasks:
        found = sorted({kind or run.kind for run in runs})
        known = ", ".join(f"{one} ({', '.join(_known_to(one))})" for one in KINDS)
        raise ConfigError(
            f"nothing to evaluate: no estimator for kind {', '.join(found)} with method "
            f"{', '.join(methods)}; there are: {known}"
        )
    return tasks


def _tasks(run: Run, kind: Kind, methods: Sequence[str]) -> Iterator[Task]:
    methods = [method for method in methods if method in _known_to(kind)]
    if kind in (BODY, CAMERA):
        for method in methods:
            yield Task(run, kind, kind, method, run.name)
        return
    places = [place for place in FEET if place in run.imus]
    if len(places) < len(FEET):
        methods = [method for method in methods if method != JOINT]
    for place in places:
        name = run.name if len(places) == 1 else f"{run.name}/{place.removesuffix('_foot')}"
        for method in methods:
            yield Task(run, kind, place, method, name)
    if kind == "dual":
        for method in methods:
            yield Task(run, kind, FUSED, method, f"{run.name}/{FUSED}")


def evaluate_task(task: Task, align: Align) -> Evaluated:
    """Run one task: estimate, score, and put the figures into a row."""
    estimate = _estimate(task)
    truth = task.run.truth_of(BODY if task.place == FUSED else task.place)
    scored = score_track(estimate.track, truth, align, estimate.steps)
    has_strides = truth is not None and task.place in task.run.truth and task.place != CAMERA
    strides_true = true_strides(truth) if truth is not None and has_strides else None
    return Evaluated(task, estimate, scored, _row(task, estimate, scored, strides_true))


def _estimate(task: Task) -> Estimate:
    if task.place == FUSED and not task.smoothed and task.method != JOINT:
        return estimate_fused(task.run, task.method)
    if task.kind == "dual":
        return estimate_fused_foot(task)
    if task.place == CAMERA:
        return estimate_camera(task.run)
    if task.place == BODY:
        return estimate_body(task.run, task.method)
    return estimate_foot(task.run.imus[task.place], task.method)


def _row(task: Task, estimate: Estimate, scored: Scored, strides_true: int | None) -> Row:
    return {
        "run": task.name,
        "kind": task.kind,
        "method": task.method,
        "duration_s": task.run.duration_s,
        **asdict(scored.score),
        "floors_right_pct": floors_right_pct(estimate.floors, task.run.truth_of(BODY)),
        "samples": estimate.samples,
        "us_per_sample": 1e6 * estimate.seconds / estimate.samples,
        "strides": estimate.strides,
        "strides_true": strides_true,
    }


def estimate_foot(imu: ImuSeries, method: str) -> Estimate:
    """One foot through the inertial navigator, batch by batch as on the bus."""
    from pdr_engine.foot import FootNavigator, FootSettings, warm_up

    warm_up()
    navigator = FootNavigator(convert({"method": method}, FootSettings, where="--method"))
    time_ns = np.round(imu.time_s * _NS_PER_S).astype(np.int64)
    begin = time.thread_time()
    outputs = [
        navigator.process(
            time_ns[start : start + BATCH],
            imu.accel_m_s2[start : start + BATCH],
            imu.gyro_rad_s[start : start + BATCH],
            None if imu.mag_ut is None else imu.mag_ut[start : start + BATCH],
        )
        for start in range(0, len(time_ns), BATCH)
    ]
    outputs.append(navigator.finish())
    seconds = time.thread_time() - begin
    steps = [step for output in outputs for step in output.steps]
    return Estimate(
        track=Track(
            np.concatenate([output.time_ns for output in outputs]) / _NS_PER_S,
            np.concatenate([output.position_m for output in outputs]),
        ),
        steps=step_chain(steps),
        strides=count_strides(np.array([step.displacement_m for step in steps]).reshape(-1, 3)),
        samples=len(time_ns),
        seconds=seconds,
        told=steps,
    )


def estimate_body(run: Run, method: str) -> Estimate:
    """The body-worn unit through its navigator, message by message as on the bus."""
    from pdr_engine.body.methods import PNS_GPS, settings_of
    from proving_ground.evaluation.body.poor_fixes import pns_walk
    from proving_ground.evaluation.body.recorded_run import body_chain, body_floors, body_track, walk_body

    imu, settings = run.imus[BODY], settings_of(method)
    if method == PNS_GPS:
        walk, track = pns_walk(run, settings)
    else:
        walk = walk_body(run, settings)
        track = body_track(walk.steps, imu)
    return Estimate(
        track=track,
        steps=body_chain(walk.steps),
        strides=len(walk.steps),
        samples=len(imu.time_s),
        seconds=walk.seconds,
        floors=body_floors(walk.steps),
    )


def estimate_fused_foot(task: Task) -> Estimate:
    """One of two feet as both together have it, or the body over them.

    Steps (and so ``inside_95_pct`` and ``nees``) are the foot's own, as fusion is told them. A foot that never
    joined the other walks by itself.
    """
    from pdr_engine.foot import FootSettings
    from proving_ground.evaluation.fusion.dual import OWN_METHODS, between, fused_feet

    fused = fused_feet(task.run, task.method, smoothed=task.smoothed)
    if task.place == FUSED:
        body = between(fused.tracks)
        return Estimate(track=body, steps=None, strides=None, samples=fused.samples, seconds=fused.seconds)
    method = FootSettings().method if task.method in OWN_METHODS else task.method
    alone = estimate_foot(task.run.imus[task.place], method)
    track = fused.tracks.get(task.place, alone.track)
    return replace(alone, track=track, samples=fused.samples, seconds=fused.seconds)


def estimate_camera(run: Run) -> Estimate:
    """The camera's pairs through stereo odometry; a sample is a pair."""
    from proving_ground.evaluation.camera.recorded_run import walk_camera

    walked = walk_camera(run)
    return Estimate(walked.track, walked.chain, None, len(walked.time_s), walked.seconds)


def estimate_fused(run: Run, method: str) -> Estimate:
    """Both feet through pdr-engine and fusion, messages and all, from a known start; 5 Hz.

    There are no steps to hold the covariance to its word with, so ``inside_95_pct`` and ``nees`` stay unknown.
    """
    from fusion.config import FusionConfig
    from pdr_engine.config import PdrConfig
    from pdr_engine.foot import warm_up
    from proving_ground.evaluation.fusion.dual import COUPLINGS, DEFAULT_COUPLING
    from proving_ground.inprocess import play_run, positions_of

    warm_up()
    feet = [place for place in FEET if place in run.imus]
    foot = {} if method in COUPLINGS else {"foot": {"method": method}}
    pdr = convert({"places": feet, **foot}, PdrConfig, where="--method")
    start = {"east_m": 0.0, "north_m": 0.0, "azimuth_deg": 90.0}
    boots_settings = {"coupling": COUPLINGS.get(method, DEFAULT_COUPLING)}
    settings = {"feet": feet, "gnss_sources": [], "start": start, "boots": boots_settings}
    fusion = convert(settings, FusionConfig, where="fused")
    boots = replace(run, imus={place: run.imus[place] for place in feet}, gnss=None)
    begin = time.thread_time()
    bus = play_run(boots, _IDENTITY, _ORIGIN, pdr, fusion, start_ns=0)
    seconds = time.thread_time() - begin
    positions = [position for position in positions_of(bus) if position.mode != "unplaced"]
    return Estimate(
        track=Track(
            np.array([position.time_ns for position in positions]) / _NS_PER_S,
            np.array([(position.east_m, position.north_m, position.up_m) for position in positions]),
        ),
        steps=None,
        strides=None,
        samples=sum(len(imu.time_s) for imu in boots.imus.values()),
        seconds=seconds,
    )


def step_chain(steps: Sequence["FootStepEstimate"]) -> StepChain | None:
    """The steps as the consistency check reads them; None if there are none."""
    if not steps:
        return None
    horizontal = np.ix_([0, 1, 3], [0, 1, 3])
    return StepChain(
        time_s=np.array([steps[0].start_time_ns, *(step.time_ns for step in steps)]) / _NS_PER_S,
        displacement_m=np.array([step.displacement_m[:2] for step in steps]),
        heading_change_rad=np.array([step.heading_change_rad for step in steps]),
        covariance=np.array([np.asarray(step.covariance)[horizontal] for step in steps]),
        common_scale=np.array([step.common_scale_sigma for step in steps]),
        common_turn_rad_s=np.array([step.common_turn_sigma_rad_s for step in steps]),
        common_slope=np.array([step.common_slope_sigma for step in steps]),
        climb_m=np.array([step.displacement_m[2] for step in steps]),
        climb_variance_m2=np.array([step.covariance[2, 2] for step in steps]),
    )


def summaries(rows: Sequence[Row]) -> list[Row]:
    """Per method: n, and median, mean and worst of the rows' 2-D RMSE and final error (None if never known)."""
    methods = dict.fromkeys(str(row["method"]) for row in rows)
    return [_summary(method, [row for row in rows if row["method"] == method]) for method in methods]


def _summary(method: str, rows: Sequence[Row]) -> Row:
    summary: Row = {"method": method, "n": len(rows)}
    for column in ("rmse_m", "final_m", "final_pct"):
        values = [float(value) for row in rows if (value := row[column]) is not None]
        for name, figure in (("median", np.median), ("mean", np.mean), ("worst", np.max)):
            summary[f"{column}_{name}"] = float(figure(values)) if values else None
    return summary
