"""Simulated twins of recorded walks: other people, drawn by chance, on the same way at the same pace.

Taken from a recording: its way-points (the truth's, at stances), the median length and time of its strides, how
long it stands before and after, which unit it was made with and how that was turned on the foot (its gyros clip
axis by axis). Everything else is simulated.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from proving_ground.agreement.strides import FloatArray, Stride, strides_of
from proving_ground.evaluation.alignment import is_dense, path_lengths, stances
from proving_ground.people import INSTEP_M, Itinerary, Leg, Motion, Person, move
from proving_ground.people.gaits import RUN_HZ_PER_M_S
from proving_ground.sensors import ImuClass, Mounting, imu_class, measure_imu
from sensor_gateway.recordings.run import ImuSeries, Run, Truth

Kind = Literal["walk", "run", "stairs_up", "stairs_down"]


@dataclass(frozen=True, slots=True)
class Setup:
    """How a set was recorded: the unit, where it sat in the foot's frame, and how hard landings came through.

    ``truth_m``: the point of the foot whose way is the set's truth, and ``survey_sigma_m`` its error; fitted to the
    recordings, as is ``hardness``, over that of a drawn person, to the set's peaks of |a|.
    """

    unit: ImuClass
    offset_m: FloatArray
    truth_m: FloatArray
    survey_sigma_m: float = 0.0
    hardness: float = 1.0


_AHEAD = np.array([1.0, 0.0, 0.0])
_SIDE_UNIT = imu_class("consumer")
SETUPS: dict[str, Setup] = {
    "pyshoe-vicon": Setup(imu_class("industrial_old"), INSTEP_M, INSTEP_M + 0.03 * _AHEAD),
    # The surveyed print is of a point about 0.11 m from the sensor: taken to be the tip of the sole.
    "foot-gcp": Setup(imu_class("industrial"), INSTEP_M, INSTEP_M + 0.11 * _AHEAD, 0.02),
    # Calibrated before the recording, so little is left of its bias; firmly on the shoe's side, further back.
    "gaitmap-example": Setup(
        replace(_SIDE_UNIT, rate_hz=204.8, gyro=replace(_SIDE_UNIT.gyro, bias_start=math.radians(0.07))),
        np.array([-0.10, 0.0, 0.04]),
        np.array([-0.19, 0.0, 0.03]),  # the heel's marker
        hardness=3.0,
    ),
}
_POINT_APART_M = 0.35
_STAND_AT_LEAST_S = 0.4
_OFFSET_SIGMA_M = 0.012
_RUN_FASTER_S, _RUN_FASTER_M_S = 0.95, 1.3
_TRAVELS_M, _TRAVELS_SHARE = 0.5, 0.7
_BEND_AT_MOST = 1.15
_CLIMB_M = 0.15
_NEAR_S = 0.05
_TRUTH_PERIOD_S = 0.005


@dataclass(frozen=True, slots=True)
class Recorded:
    """One foot of a recorded run that can be matched: its set, its gait, its strides."""

    dataset: str
    run: Run
    place: str
    kind: Kind
    strides: list[Stride]

    @property
    def imu(self) -> ImuSeries:
        """What was recorded."""
        return self.run.imus[self.place]


def recorded_feet(dataset: str, run: Run) -> list[Recorded]:
    """The feet of a run whose gait the people know: most strides carry it forward."""
    found = []
    for place, imu in run.imus.items():
        strides = strides_of(imu)
        kind = _kind(strides)
        if kind is not None:
            found.append(Recorded(dataset, run, place, kind, strides))
    return found


def _kind(strides: list[Stride]) -> Kind | None:
    forward = [stride for stride in strides if is_stride(stride)]
    if len(forward) < max(5.0, _TRAVELS_SHARE * len(strides)):
        return None
    rise = float(np.median([stride.rise_m for stride in forward]))
    if abs(rise) > 0.2:
        return "stairs_up" if rise > 0.0 else "stairs_down"
    duration_s, speed_m_s = _pace(forward)
    return "run" if duration_s < _RUN_FASTER_S and speed_m_s > _RUN_FASTER_M_S else "walk"


def is_stride(stride: Stride) -> bool:
    """Whether it carries the foot on, rather than shifts or turns it."""
    return bool(stride.length_m > _TRAVELS_M and stride.position_m[-1, 0] > 0.0)


def _pace(strides: list[Stride]) -> tuple[float, float]:
    """Median duration of a stride, s, and speed, m/s."""
    durations = np.array([stride.duration_s for stride in strides])
    lengths = np.array([stride.length_m for stride in strides])
    return float(np.median(durations)), float(np.median(lengths / durations))


def twin(recorded: Recorded, seed: int) -> Run:
    """A simulated run of one foot on the recorded one's way; truth as the recorded set has it."""
    rng = np.random.default_rng(seed)
    points = way_points(recorded)
    step_m, period_s = _steps(recorded, points)
    setup, drawn = SETUPS[recorded.dataset], Person.drawn(rng)
    person = replace(
        drawn,
        hardness=setup.hardness * drawn.hardness,
        walk_ratio_m_s=step_m * period_s,
        run_frequency_hz=np.sqrt(drawn.leg_length_m / 0.92) / period_s - RUN_HZ_PER_M_S * step_m / period_s,
    )
    motion = move(person, _itinerary(recorded, points, step_m / period_s), seed)
    foot: Motion = motion.left_foot if recorded.place == "left_foot" else motion.right_foot
    mounting = Mounting(
        setup.offset_m + rng.normal(0.0, _OFFSET_SIGMA_M, 3),
        Rotation.from_matrix(recorded.strides[0].axes),
    )
    imu = measure_imu(foot, motion.duration_s, mounting, setup.unit, None, rng)
    name = f"{recorded.run.name}/twin{seed}"
    truth = _truth(recorded, foot, motion.duration_s, rng)
    return Run(name, "foot", Path(name), {recorded.place: imu}, {recorded.place: truth}, source="simulated")


def _steps(recorded: Recorded, points: FloatArray) -> tuple[float, float]:
    """Length along the way and time of a recorded step; strides are chords of a way that turns."""
    forward = [stride for stride in recorded.strides if is_stride(stride)]
    duration_s, speed_m_s = _pace(forward)
    chords_m = sum(stride.length_m for stride in forward)
    bend = max(1.0, float(path_lengths(points)[-1]) / chords_m) if recorded.kind in ("walk", "run") else 1.0
    return 0.5 * duration_s * speed_m_s * min(bend, _BEND_AT_MOST), 0.5 * duration_s


def _itinerary(recorded: Recorded, points: FloatArray, speed_m_s: float) -> Itinerary:
    first, last = recorded.strides[0], recorded.strides[-1]
    before_s = max(_STAND_AT_LEAST_S, first.begin_s - float(recorded.imu.time_s[0]))
    after_s = max(_STAND_AT_LEAST_S, float(recorded.imu.time_s[-1]) - last.begin_s - last.duration_s)
    gait: Literal["stairs", "run", "walk"] = (
        "stairs" if recorded.kind.startswith("stairs") else "run" if recorded.kind == "run" else "walk"
    )
    ahead = points[1] - points[0]
    return Itinerary(
        (
            Leg("stand", points[:1], before_s),
            Leg(gait, points, speed_m_s=None if gait == "stairs" else speed_m_s),
            Leg("stand", points[-1:], after_s),
        ),
        start_yaw_rad=float(np.arctan2(ahead[1], ahead[0])),
    )


def way_points(recorded: Recorded) -> FloatArray:
    """The recorded way (k, 3), stance by stance; a straight one of the strides' length and rise without truth."""
    truth = recorded.run.truth.get(recorded.place)
    if truth is None:
        forward = [stride for stride in recorded.strides if is_stride(stride)]
        if recorded.kind.startswith("stairs"):
            forward = [stride for stride in forward if abs(stride.rise_m) > _CLIMB_M]
        ahead = sum(stride.length_m for stride in forward)
        rise = sum(stride.rise_m for stride in forward)
        return np.array([[0.0, 0.0, 0.0], [ahead, 0.0, rise if recorded.kind.startswith("stairs") else 0.0]])
    stops = _where_it_stood(recorded, truth) if is_dense(truth) else truth.position_m
    points = stops[np.isfinite(stops[:, :2]).all(axis=1)]
    level = np.column_stack([points[:, :2], np.zeros(len(points))])
    kept = [0]
    for index in range(1, len(level)):
        if np.hypot(*(level[index] - level[kept[-1]])[:2]) > _POINT_APART_M:
            kept.append(index)
    return _curved(level[kept])


def _where_it_stood(recorded: Recorded, truth: Truth) -> FloatArray:
    """The truth at the strides' mid-stances, (k, 3); medians, since motion capture glitches."""
    last = recorded.strides[-1]
    times = [*(stride.begin_s for stride in recorded.strides), last.begin_s + last.duration_s]
    near = [np.abs(truth.time_s - time_s) < _NEAR_S for time_s in times]
    return np.array([np.median(truth.position_m[which], axis=0) for which in near if which.any()])


def _curved(points: FloatArray) -> FloatArray:
    """A smooth way through stances: people do not walk polygons."""
    if len(points) < 4:
        return points
    arc = path_lengths(points)
    fine = np.linspace(0.0, arc[-1], max(2, round(arc[-1] / _POINT_APART_M)))
    return np.asarray(CubicSpline(arc, points)(fine))


def _truth(recorded: Recorded, foot: Motion, duration_s: float, rng: np.random.Generator) -> Truth:
    """The way of the set's point of the foot: dense, or a surveyed print a stride where the set has those."""
    setup, known = SETUPS[recorded.dataset], recorded.run.truth.get(recorded.place)
    time_s = np.arange(0.0, duration_s, _TRUTH_PERIOD_S)
    dense = Truth(time_s, Mounting(setup.truth_m).carried(foot, time_s)[0])
    if known is None or is_dense(known):
        return replace(dense, at_stances=known is not None and known.at_stances)
    prints = stances(Truth(time_s, foot.at(time_s)[0]))
    apart = np.concatenate([[True], np.diff(path_lengths(prints.position_m)) > _POINT_APART_M])
    time_s = prints.time_s[apart]
    place = Mounting(setup.truth_m).carried(foot, time_s)[0]
    surveyed = place + rng.normal(0.0, setup.survey_sigma_m, place.shape)
    return Truth(time_s, surveyed, strides=len(time_s) - 1)
