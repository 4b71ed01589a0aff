"""What each choice of the foot INS is worth: the same runs with one of them taken away at a time.

A choice is taken away by settings alone, so that the filter which is measured is the one which is shipped.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bootprint.config import convert
from proving_ground.evaluation.alignment import Track, compare, fit
from proving_ground.evaluation.scoring import plane_errors
from sensor_gateway.recordings.run import FEET, ImuSeries, Run

if TYPE_CHECKING:
    from pdr_engine.foot import FootSettings

Changes = Mapping[str, Any]
_NEVER = 1e6  # seconds, sigmas or rad/s that no recording reaches
_NS_PER_S = 1e9


@dataclass(frozen=True, slots=True)
class Variant:
    """The default settings with some changed, as they would stand under ``[pdr.foot]``."""

    name: str
    changes: Changes

    def settings(self) -> "FootSettings":
        """The settings; ConfigError if the navigator knows no such choice (any more)."""
        from pdr_engine.foot import FootSettings

        return convert(dict(self.changes), FootSettings, where=f"variant {self.name!r}")


# The filter of D1 and of the textbooks: nine states, bias from the start alone, every measurement believed.
PLAIN: Changes = {
    "filter": {
        "lever_sigma_m": 0.0,
        "gate": _NEVER,
        "clip_rad_s": _NEVER,
        "accel_scale_sqrt_s": 0.0,
        "accel_timing_s": 0.0,
        "learned_motion": 0.0,
    },
    "alignment": {"stop_s": _NEVER},
}
ABLATIONS = (
    Variant("everything", {}),
    Variant("without rebuilding clipped peaks of the gyro", {"filter": {"clip_rad_s": _NEVER}}),
    Variant("without the gate that inflates", {"filter": {"gate": _NEVER}}),
    Variant("without the lever arm's three states", {"filter": {"lever_sigma_m": 0.0}}),
    Variant("without noise that grows with the force", {"filter": {"accel_scale_sqrt_s": 0.0}}),
    Variant("without noise that grows with the force's change", {"filter": {"accel_timing_s": 0.0}}),
    Variant("stance without the sole's expected motion", {"filter": {"learned_motion": 0.0}}),
    Variant("without gyro bias from later stops", {"alignment": {"stop_s": _NEVER}}),
    Variant(
        "without any gyro bias", {"alignment": {"bias_sigma_rad_s": 1e-9, "bias_walk_rad_s_sqrt_s": 0.0}}
    ),
    Variant("without noise that grows with the rate", {"filter": {"gyro_scale_sqrt_s": 0.0}}),
    Variant("stance as sure as at rest wherever it is", {"filter": {"learned_noise": 0.0}}),
    Variant("growing threshold instead of the learned detector", {"method": "adaptive"}),
    Variant("threshold that does not grow", {"method": "adaptive", "detector": {"adaptive_rate_per_s": 0.0}}),
    Variant("without the magnetometer at stand-still", {"magnetometer": {"use": False}}),
    Variant("magnetometer however disturbed its field", {"magnetometer": {"disturbed_share": _NEVER}}),
    Variant("plain nine-state filter, learned detector", PLAIN),
)


def plain(method: str) -> Variant:
    """The plain nine-state filter with this stance detector."""
    return Variant(f"{method} in the plain filter", {"method": method, **PLAIN})


def rmse_of(variant: Variant, runs: Sequence[Run]) -> list[float]:
    """The 2-D RMSE of every foot whose run tells its way, in metres, after a rigid fit of yaw and offset."""
    settings = variant.settings()
    errors = [foot_rmse(run, place, settings) for run in runs for place in FEET if place in run.imus]
    return [error for error in errors if error is not None]


def foot_rmse(run: Run, place: str, settings: "FootSettings") -> float | None:
    """The 2-D RMSE of one foot, m, after a rigid fit; None if the run does not tell its way."""
    truth = run.truth_of(place)
    if truth is None:
        return None
    compared = compare(walked(run.imus[place], settings), truth)
    errors = plane_errors(compared, fit(compared, "best-fit"))
    return float(np.sqrt(np.mean(errors**2)))


def walked(imu: ImuSeries, settings: "FootSettings") -> Track:
    """The track of one foot, in one pass."""
    from pdr_engine.foot import FootNavigator

    navigator = FootNavigator(settings)
    time_ns = np.round(imu.time_s * _NS_PER_S).astype(np.int64)
    outputs = (navigator.process(time_ns, imu.accel_m_s2, imu.gyro_rad_s, imu.mag_ut), navigator.finish())
    return Track(
        np.concatenate([output.time_ns for output in outputs]) / _NS_PER_S,
        np.concatenate([output.position_m for output in outputs]),
    )
