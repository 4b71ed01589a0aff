"""A unit on a trunk whose motion is written down in formulas: sinusoid bounce and surge, any mounting and rate."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from bootprint.messages import Float64Array, Int64Array

START_NS = 1_700_000_000_000_000_000
G = 9.80665
FIELD_ENU_UT = np.array([0.0, 15.0, -47.0])  # no declination, dip 72°


@dataclass(frozen=True)
class TrunkStream:
    """Samples in device axes."""

    time_ns: Int64Array
    accel: Float64Array
    gyro: Float64Array
    mag: Float64Array


def north(time_s: Float64Array) -> Float64Array:
    """The azimuth of a walk due north."""
    return np.zeros_like(time_s)


def trunk_walk(
    duration_s: float = 30.0,
    rate_hz: float = 100.0,
    frequency_hz: float = 1.8,
    rise_m: float = 0.05,
    surge: float = 0.6,
    azimuth: Callable[[Float64Array], Float64Array] = north,
    mounting: Rotation | None = None,
    walks: tuple[float, float] = (0.0, np.inf),
) -> TrunkStream:
    """Steps at ``frequency_hz``, the trunk rising by ``rise_m`` in each, between the times ``walks``.

    Height is rise/2 · cos φ, φ = 2π f t; the surge's acceleration is ``surge`` times the vertical one's amplitude
    and leads it by a quarter of a step. ``mounting`` takes device axes to forward, left, up.
    """
    time_s = np.arange(0.0, duration_s, 1.0 / rate_hz)
    omega = 2.0 * np.pi * frequency_hz
    amplitude = np.where((time_s >= walks[0]) & (time_s <= walks[1]), 0.5 * rise_m * omega**2, 0.0)
    yaw = 0.5 * np.pi - azimuth(time_s)
    body = np.column_stack(
        [
            surge * amplitude * np.sin(omega * time_s),
            np.zeros_like(time_s),
            G - amplitude * np.cos(omega * time_s),
        ]
    )
    heading = Rotation.from_euler("z", yaw[:, None])
    device = (mounting or Rotation.identity()).inv()
    rate = np.column_stack([np.zeros_like(time_s), np.zeros_like(time_s), np.gradient(yaw, time_s)])
    return TrunkStream(
        START_NS + np.round(time_s * 1e9).astype(np.int64),
        device.apply(body),
        device.apply(rate),
        device.apply(heading.inv().apply(np.tile(FIELD_ENU_UT, (len(time_s), 1)))),
    )
