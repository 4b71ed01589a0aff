"""The angle between unit and walk from virtual positions of satellite fixes."""

import math

import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from bootprint.messages import BodyStep, GnssFix, ImuBatch
from bootprint.topics import Identity
from pdr_engine.body.azimuth.misalignment import (
    PRIOR_SIGMA_RAD,
    STEPS_SIGMA_RAD,
    WALK_RAD_PER_STRETCH,
    Misalignment,
)
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from support.walking_trunk import trunk_walk

SECOND_NS = 1_000_000_000
ME = Identity("bp", "alpha", "a1")
PLACE = Origin(latitude_deg=59.0, longitude_deg=18.0)


def walked(angle_rad: float, seconds: int, accuracy_m: float = 3.0, turning: float = 0.0) -> Misalignment:
    """Steps told to go north, while satellites see them go ``angle_rad`` clockwise of that."""
    misalignment = Misalignment()
    east = north = 0.0
    for second in range(seconds):
        misalignment.fix(second * SECOND_NS, east, north, accuracy_m)
        told = turning * second
        misalignment.walk(1.4, told)
        east += 1.4 * math.sin(told + angle_rad)
        north += 1.4 * math.cos(told + angle_rad)
    return misalignment


def test_the_first_stretch_by_hand() -> None:
    """Fixes 0 to 2 and the three up to the first that is 15 m on: 11 · 1.4 m = 15.4 m between the centroids."""
    misalignment = walked(0.3, 14)
    assert misalignment.stretches == 1
    variance = PRIOR_SIGMA_RAD**2 + WALK_RAD_PER_STRETCH**2
    noise = 2.0 * 3.0**2 / 15.4**2 + STEPS_SIGMA_RAD**2
    assert misalignment.angle_rad == pytest.approx(0.3 * variance / (variance + noise))
    assert misalignment.satellite_azimuth(14 * SECOND_NS) == pytest.approx(0.3)
    assert misalignment.satellite_azimuth(60 * SECOND_NS) is None


@pytest.mark.parametrize("angle_rad", [-0.4, 0.2, 3.0])
def test_a_long_walk_tells_the_angle(angle_rad: float) -> None:
    misalignment = walked(angle_rad, 600)
    assert misalignment.angle_rad == pytest.approx(angle_rad, abs=0.05)
    sigma = misalignment.sigma_at(600 * SECOND_NS, 0.0)
    assert sigma < 0.1
    assert misalignment.sigma_at(1200 * SECOND_NS, 0.001) == pytest.approx(math.hypot(sigma, 0.6), rel=0.02)


def test_bad_fixes_and_bends_tell_nothing() -> None:
    assert walked(0.5, 300, accuracy_m=30.0).stretches == 0
    assert walked(0.5, 300, turning=0.12).stretches == 0


def test_the_engine_ends_up_walking_where_satellites_say() -> None:
    """A unit told to face ahead that is 25° off: the message's azimuth from true north becomes the walk's."""
    core, frame = EngineCore(PdrConfig(places=("body",)), ME, PLACE), LocalFrame(PLACE)
    stream = trunk_walk(240.0, azimuth=lambda t: np.full_like(t, 1.0))
    heard = []
    for k in range(0, len(stream.time_ns), 100):
        cut = slice(k, k + 100)
        batch = ImuBatch.from_arrays(
            k, stream.time_ns[cut], stream.accel[cut], stream.gyro[cut], stream.mag[cut]
        )
        heard += list(core.handle(Envelope(ME.address("imu", "body"), batch)))
        way = 1.2 * k / 100.0
        latitude, longitude, _ = frame.to_geodetic(way * math.sin(1.5), way * math.cos(1.5), 0.0)
        fix = GnssFix(
            time_ns=int(stream.time_ns[k]),
            fix_kind="3d",
            latitude_deg=latitude,
            longitude_deg=longitude,
            horizontal_accuracy_m=2.0,
        )
        core.handle(Envelope(ME.address("gnss", "body"), fix))
    last = heard[-1].message
    assert isinstance(last, BodyStep)
    assert math.remainder(last.azimuth_rad - 1.5, math.tau) == pytest.approx(0.0, abs=0.05)
    assert last.gnss_azimuth_rad is not None
    assert math.remainder(last.gnss_azimuth_rad - 1.5, math.tau) == pytest.approx(0.0, abs=0.02)
