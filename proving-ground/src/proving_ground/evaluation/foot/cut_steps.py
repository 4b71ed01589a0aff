"""What a gyro of a smaller range does to the foot INS: recorded boots whose peaks are cut off afterwards.

    python -m proving_ground.evaluation.foot.cut_steps DATA/SET...        (a table on standard output)

Truth is the same filter on the recording as it is, so the figures are of the cut alone. Steps that the recorded
unit cut itself are left out, as are those that the smaller range leaves whole.
"""

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pdr_engine.foot import FootNavigator, FootStepEstimate
from proving_ground.evaluation.foot.faults import clipped
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import FEET, ImuSeries

LIMITS_DEG_S = (500.0, 440.0, 400.0, 360.0)
_NEAR_RANGE, _BEYOND_RANGE = (
    8.25,
    10.0,
)  # rad/s: a unit that gets as near to 500 °/s but never beyond has that range
_SAME_NS = 40_000_000  # two filters find a stance's end this near to each other
_WAY_M = 0.4
_FEWEST = 5  # steps of a foot
HEADER = (
    "| limit °/s | feet | steps | turn, mean of a foot: rms ° | told as shared | about the mean: rms ° "
    "| place: rms m |\n|--:|--:|--:|--:|--:|--:|--:|"
)


@dataclass(frozen=True, slots=True)
class CutFoot:
    """Steps (n,) of a foot beside those of the whole recording: errors of turn and place, turn told as shared."""

    turn_rad: npt.NDArray[np.float64]
    shared_rad: npt.NDArray[np.float64]
    place_m: npt.NDArray[np.float64]


def cut_foot(imu: ImuSeries, limit_deg_s: float) -> CutFoot | None:
    """The errors of the steps whose peaks the limit cuts; None if there are too few."""
    limit = math.radians(limit_deg_s)
    pairs = [
        (whole, cut)
        for whole, cut in _pairs(_steps(imu), _steps(clipped(gyro_deg_s=limit_deg_s)(imu)))
        if whole.horizontal_length_m > _WAY_M and limit < _peak(imu, whole) < _whole_below(imu)
    ]
    if len(pairs) < _FEWEST:
        return None
    turns = [cut.heading_change_rad - whole.heading_change_rad for whole, cut in pairs]
    return CutFoot(
        np.array([math.remainder(turn, math.tau) for turn in turns]),
        np.array(
            [cut.common_turn_sigma_rad_s * (cut.time_ns - cut.start_time_ns) * 1e-9 for _, cut in pairs]
        ),
        np.array([math.dist(cut.displacement_m, whole.displacement_m) for whole, cut in pairs]),
    )


def _steps(imu: ImuSeries) -> list[FootStepEstimate]:
    navigator = FootNavigator()
    time_ns = np.round(imu.time_s * 1e9).astype(np.int64)
    return [*navigator.process(time_ns, imu.accel_m_s2, imu.gyro_rad_s).steps, *navigator.finish().steps]


def _pairs(
    wholes: Sequence[FootStepEstimate], cuts: Sequence[FootStepEstimate]
) -> Iterator[tuple[FootStepEstimate, FootStepEstimate]]:
    """Steps from the same stance to the same stance."""
    for whole in wholes:
        for cut in cuts:
            apart_ns = max(abs(whole.start_time_ns - cut.start_time_ns), abs(whole.time_ns - cut.time_ns))
            if apart_ns < _SAME_NS:
                yield whole, cut
                break


def _peak(imu: ImuSeries, step: FootStepEstimate) -> float:
    """The largest rate on any axis within a step, rad/s."""
    within = (imu.time_s * 1e9 > step.start_time_ns) & (imu.time_s * 1e9 <= step.time_ns)
    return float(np.abs(imu.gyro_rad_s[within]).max(initial=0.0))


def _whole_below(imu: ImuSeries) -> float:
    """Steps whose peaks stay below this were not cut by the unit itself, rad/s."""
    highest = float(np.abs(imu.gyro_rad_s).max())
    return _NEAR_RANGE if _NEAR_RANGE < highest < _BEYOND_RANGE else math.inf


def row(limit_deg_s: float, feet: Sequence[CutFoot]) -> str:
    """A row of the table; steps count alike."""
    steps = np.array([len(foot.turn_rad) for foot in feet])
    means = np.degrees([foot.turn_rad.mean() for foot in feet])
    shared = np.degrees([np.sqrt(np.mean(foot.shared_rad**2)) for foot in feet])
    about = np.degrees([foot.turn_rad.std() for foot in feet])
    place = np.concatenate([foot.place_m for foot in feet])
    figures = (np.sqrt(np.average(values**2, weights=steps)) for values in (means, shared, about))
    turned = " | ".join(f"{figure:.3f}" for figure in figures)
    return (
        f"| {limit_deg_s:.0f} | {len(feet)} | {steps.sum()} | {turned} | {np.sqrt(np.mean(place**2)):.4f} |"
    )


def table(imus: Sequence[ImuSeries]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [HEADER]
    for limit in LIMITS_DEG_S:
        feet = [foot for imu in imus if (foot := cut_foot(imu, limit)) is not None]
        if feet:
            lines.append(row(limit, feet))
    return lines


if __name__ == "__main__":
    found = load_runs([Path(name) for name in sys.argv[1:]])
    boots = [run.imus[place] for run in found for place in FEET if place in run.imus]
    sys.stdout.write("\n".join(table(boots)) + "\n")
