"""The settings as the compiled kernel reads them: one structured record, times in ns, noise as densities."""

from typing import Any

import numpy as np
import numpy.typing as npt

from pdr_engine.foot.presets import SENSORS
from pdr_engine.foot.settings import METHODS, UNCALIBRATED, FootSettings, MagnetometerCalibration

LEARNED, ADAPTIVE, SHOE, GYRO, DIFFERENTIAL, ARED = range(6)

_FLOATS = (
    # filter
    *("accel_noise", "gyro_noise", "accel_scale", "gyro_scale", "velocity_sigma", "gate"),
    *("lever_sigma", "lever_walk", "clip_rate", "clip_noise", "clip_force", "cut_force"),
    *("gap_accel", "gap_rate", "max_speed", "learned_noise", "learned_motion", "accel_timing"),
    *("hidden_motion", "step_scale"),
    *("quietest_gyro", "loudest_gyro", "quietest_accel", "loudest_accel"),
    # detector
    *("accel_weight", "gyro_weight", "threshold", "growth_rate", "growth_hold"),
    # alignment
    *("still_accel_std", "still_gyro_std", "still_rate", "still_gravity", "tilt_sigma", "quiet_tilt_sigma"),
    *("sway", "bias_walk"),
    # magnetometer
    *("mag_floor", "mag_prior", "mag_disturbed", "mag_correlation", "mag_steadiness", "mag_iron", "mag_gate"),
    *("mag_drift_sigma", "earth_horizontal", "earth_vertical"),
)
_INTEGERS = (
    *("method", "listens", "window_ns", "calm_hold_ns", "still_window_ns", "patience_ns", "stop_ns"),
    *("report_ns", "mag_use"),
)
_TABLES = (("mag_offset", "f8", 3), ("mag_matrix", "f8", (3, 3)))
PARAMETERS = np.dtype(
    [*((name, "f8") for name in _FLOATS), *((name, "i8") for name in _INTEGERS), *_TABLES], align=True
)


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


def _detector_values(settings: FootSettings) -> dict[str, float]:
    d = settings.detector
    thresholds = {
        "learned": d.learned_sigma_m_s,
        "adaptive": d.adaptive_threshold,
        "shoe": d.shoe_threshold,
        "gyro": d.gyro_rms_rad_s**2,
        "differential": d.differential_sum_m_s2,
        "ared": d.ared_threshold,
    }
    windows = {"gyro": d.gyro_window_s, "differential": d.differential_window_s}
    return {
        "method": METHODS.index(settings.method),
        "accel_weight": d.shoe_accel_sigma_m_s2**-2,
        "gyro_weight": d.shoe_gyro_sigma_rad_s**-2,
        "threshold": thresholds[settings.method],
        "growth_rate": d.adaptive_rate_per_s,
        "growth_hold": d.adaptive_hold_s,
        "window_ns": _ns(windows.get(settings.method, d.shoe_window_s)),
        "calm_hold_ns": _ns(d.differential_hold_s),
    }


def _alignment_values(settings: FootSettings) -> dict[str, float]:
    a = settings.alignment
    return {
        "still_accel_std": a.accel_std_m_s2,
        "still_gyro_std": a.gyro_std_rad_s,
        "still_rate": a.rate_rad_s,
        "still_gravity": a.gravity_tolerance_m_s2,
        "tilt_sigma": a.tilt_sigma_rad,
        "quiet_tilt_sigma": a.quiet_tilt_sigma_rad,
        "sway": a.sway_rad,
        "bias_walk": a.bias_walk_rad_s_sqrt_s,
        "still_window_ns": _ns(a.window_s),
        "patience_ns": _ns(a.patience_s),
        "stop_ns": _ns(a.stop_s),
    }


def _filter_values(settings: FootSettings) -> dict[str, float]:
    f = settings.filter
    return {
        "accel_noise": f.accel_noise_m_s2_sqrt_hz,
        "gyro_noise": f.gyro_noise_rad_s_sqrt_hz,
        "accel_scale": f.accel_scale_sqrt_s,
        "gyro_scale": f.gyro_scale_sqrt_s,
        "velocity_sigma": f.zero_velocity_sigma_m_s,
        "gate": f.gate,
        "lever_sigma": f.lever_sigma_m,
        "lever_walk": f.lever_walk_m_sqrt_s,
        "clip_rate": f.clip_rad_s,
        "clip_noise": f.clip_noise_rad_s_sqrt_hz,
        "clip_force": f.clip_m_s2,
        "cut_force": f.clip_excess_m_s2,
        "gap_accel": f.gap_accel_m_s2,
        "gap_rate": f.gap_rate_rad_s,
        "max_speed": f.max_speed_m_s,
        "learned_noise": f.learned_noise,
        "learned_motion": f.learned_motion,
        "accel_timing": f.accel_timing_s,
        "hidden_motion": f.hidden_motion_s,
        "step_scale": f.step_scale,
        "report_ns": _ns(settings.standing_report_s),
    }


def _magnetometer_values(settings: FootSettings) -> dict[str, float]:
    m = settings.magnetometer
    return {
        "mag_use": m.use,
        "mag_floor": m.disturbance_floor_ut,
        "mag_prior": m.disturbance_prior_ut,
        "mag_disturbed": m.disturbed_share,
        "mag_correlation": m.correlation_m,
        "mag_steadiness": m.steadiness_ut,
        "mag_gate": m.gate,
        "mag_drift_sigma": m.drift_sigma_rad_s,
    }


def _noise_values(settings: FootSettings) -> dict[str, float]:
    """Bounds of the noise that is heard of an unknown sensor; terms set by hand stay as they are."""
    loudest, preset = SENSORS["unknown"], FootSettings(sensor="unknown").filter
    by_hand = any(
        getattr(settings.filter, name) != getattr(preset, name)
        for name in ("accel_noise_m_s2_sqrt_hz", "gyro_noise_rad_s_sqrt_hz")
    )
    return {
        "listens": settings.sensor == "unknown" and not by_hand,
        "quietest_gyro": min(sensor.gyro_rad_s_sqrt_hz for sensor in SENSORS.values()),
        "loudest_gyro": loudest.gyro_rad_s_sqrt_hz,
        "quietest_accel": min(sensor.accel_m_s2_sqrt_hz for sensor in SENSORS.values()),
        "loudest_accel": loudest.accel_m_s2_sqrt_hz,
    }


def parameters(
    settings: FootSettings, calibration: MagnetometerCalibration = UNCALIBRATED
) -> npt.NDArray[Any]:
    """The settings as the kernel reads them: `PARAMETERS`, shape (1,)."""
    record = np.zeros(1, PARAMETERS)
    for values in (_detector_values, _alignment_values, _filter_values, _noise_values, _magnetometer_values):
        for name, value in values(settings).items():
            record[name] = value
    m = settings.magnetometer
    record["mag_iron"] = m.uncalibrated_iron_ut if calibration == UNCALIBRATED else m.iron_ut
    record["mag_offset"] = calibration.offset_ut
    record["mag_matrix"] = calibration.matrix
    return record
