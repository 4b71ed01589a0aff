"""Sensor reality: any rate, any axes, jitter, losses, saturation, scale errors, bias, and the named presets.

The walk is the proving ground's: places of its footfalls are known, and so are its strides and its length.
"""

import math

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bootprint.config import convert
from bootprint.errors import ConfigError
from pdr_engine.foot import FootNavigator, FootSettings
from pdr_engine.foot.presets import REFERENCE, SENSORS
from pdr_engine.foot.settings import AlignmentSettings, FilterSettings
from proving_ground.simulation.walker import (
    FootMotion,
    Gait,
    ImuQuality,
    Path3D,
    boot_imu,
    footfalls,
    walk_duration_s,
)
from support.foot_streams import START_NS, Stream, Track, navigate, still, turning

CORNERS = Path3D(np.array([[0.0, 0.0, 0.0], [12.0, 0.0, 0.0], [12.0, 8.0, 0.0], [2.0, 8.0, 0.0]]))
WALK = Gait()
RUN = Gait(step_length_m=1.1, step_period_s=0.36, swing_share=0.45, sole_pitch_rad=2.2)
NAMES = tuple(SENSORS)


def motion_of(gait: Gait) -> FootMotion:
    return footfalls(CORNERS, gait, +1)


def stream_of(
    gait: Gait = WALK, mounting: Rotation | None = None, quality: ImuQuality | None = None
) -> Stream:
    """What a unit on the left foot measures."""
    imu = boot_imu(
        motion_of(gait),
        walk_duration_s(CORNERS, gait),
        mounting or Rotation.identity(),
        quality or ImuQuality(),
        np.random.default_rng(1),
    )
    return Stream(START_NS + np.round(imu.time_s * 1e9).astype(np.int64), imu.accel_m_s2, imu.gyro_rad_s)


def strides_m(track: Track) -> np.ndarray:
    """Lengths of the steps that went somewhere."""
    lengths = np.array([math.hypot(*step.displacement_m[:2]) for step in track.steps])
    return lengths[lengths > 0.15]


def assert_holds(track: Track, gait: Gait = WALK, *, distance: float = 0.005, end_m: float = 0.15) -> None:
    """Strides are counted exactly; length of the way and distance from start to end are within bounds."""
    place = motion_of(gait).place_m
    true_m = np.linalg.norm(np.diff(place, axis=0), axis=1)
    found_m = strides_m(track)
    assert len(found_m) == len(true_m)
    assert found_m.sum() == pytest.approx(true_m.sum(), rel=distance)
    ends_m = float(np.linalg.norm(place[-1] - place[0]))
    assert np.linalg.norm(track.position_m[-1] - track.position_m[0]) == pytest.approx(ends_m, abs=end_m)
    assert track.counters["realignments"] == 0


@pytest.mark.parametrize("rate_hz", [60, 75, 100, 128, 200, 256, 400, 800])
def test_any_rate(rate_hz: float) -> None:
    track = navigate(stream_of(quality=ImuQuality(rate_hz=rate_hz)))
    assert_holds(track)
    assert abs(track.position_m[-1, 2] - track.position_m[0, 2]) < 0.2


@pytest.mark.parametrize("mounting", list(Rotation.create_group("O")), ids=range(24))
def test_axes_any_way_up(mounting: Rotation) -> None:
    assert_holds(navigate(stream_of(mounting=mounting)))


@pytest.mark.parametrize("sigma_ms", [0.5, 1.0])
def test_jittered_stamps(sigma_ms: float) -> None:
    """The stamp trembles, the sample does not; a stamp before its predecessor costs its sample."""
    stream = stream_of()
    jitter = np.random.default_rng(2).normal(0.0, sigma_ms * 1e6, len(stream.time_ns))
    stream.time_ns += np.round(jitter).astype(np.int64)
    assert_holds(navigate(stream))


@pytest.mark.parametrize("share", [0.05, 0.2, 0.4])
def test_missing_samples(share: float) -> None:
    """One in twenty, one in five or two in five are lost, anywhere."""
    stream = stream_of()
    kept = np.random.default_rng(3).random(len(stream.time_ns)) > share
    track = navigate(stream.only(kept))
    assert_holds(track, distance=0.01)
    assert abs(track.position_m[-1, 2] - track.position_m[0, 2]) < 0.2


def test_duplicates_change_nothing() -> None:
    stream = stream_of()
    count = len(stream.time_ns)
    twice = np.sort(np.concatenate([np.arange(count), np.random.default_rng(4).choice(count, 300, False)]))
    track, clean = navigate(stream.only(twice)), navigate(stream)
    assert track.counters["dropped"] == 300
    assert np.array_equal(track.position_m, clean.position_m)


def with_shocks(stream: Stream, gait: Gait, speed_m_s: float) -> Stream:
    """Every footfall rings: a velocity that begins and ends at 0, 50 Hz, gone after a few periods."""
    motion = motion_of(gait)
    time_s = (stream.time_ns - START_NS) * 1e-9
    ring = np.zeros(len(time_s))
    for fall_s in motion.swing_start_s[1:] + motion.swing_s:
        since = np.maximum(time_s - fall_s, 0.0)
        ring += speed_m_s * np.exp(-since / 0.012) * np.sin(100.0 * np.pi * since)
    shock = np.diff(ring, prepend=0.0) / np.gradient(time_s)
    return Stream(stream.time_ns, stream.accel + shock[:, None] * [0.5, 0.0, 1.0], stream.gyro)


def test_a_run_that_saturates_16_g_and_2000_degrees_a_second() -> None:
    loose = ImuQuality(rate_hz=400.0, accel_limit_m_s2=1e3, gyro_limit_rad_s=1e3)
    stream = with_shocks(stream_of(RUN, quality=loose), RUN, 1.2)
    accel_limit, gyro_limit = 16 * 9.80665, math.radians(2000.0)
    over = (np.abs(stream.accel) > accel_limit).sum(), (np.abs(stream.gyro) > gyro_limit).sum()
    assert min(over) > 20  # it does saturate
    cut = Stream(
        stream.time_ns,
        np.clip(stream.accel, -accel_limit, accel_limit),
        np.clip(stream.gyro, -gyro_limit, gyro_limit),
    )
    track = navigate(cut)
    assert track.counters["clippings"] > 0
    assert_holds(track, RUN, distance=0.03, end_m=0.6)


def test_what_a_cut_peak_takes_along_is_an_error_that_steps_share() -> None:
    """The same peak is cut off every stride: their turns err alike, beyond what a gyro's bias does (2.2 °/min)."""
    bias = math.radians(2.3 / 60.0)
    loose, cut = (
        [step.common_turn_sigma_rad_s for step in navigate(stream_of(RUN, quality=quality)).steps]
        for quality in (ImuQuality(gyro_limit_rad_s=1e3), ImuQuality(gyro_limit_rad_s=math.radians(400.0)))
    )
    assert max(loose) < bias
    assert np.median(cut) > 3.0 * bias


@pytest.mark.parametrize("accel", [0.99, 1.01])
@pytest.mark.parametrize("gyro", [0.99, 1.01])
def test_scale_errors_of_one_percent(accel: float, gyro: float) -> None:
    """A part of the force is the same part of the way; a part of the rate turns every corner too far."""
    stream = stream_of()
    scaled = Stream(stream.time_ns, stream.accel * accel, stream.gyro * gyro)
    assert_holds(navigate(scaled), distance=0.015, end_m=0.5)


@pytest.mark.parametrize("size", [1, 7, 10])
def test_batches_of_any_size_give_what_a_thousand_give(size: int) -> None:
    stream = stream_of()
    count = len(stream.time_ns)
    small, large = (
        navigate(stream, list(range(size, count, size))),
        navigate(stream, list(range(1000, count, 1000))),
    )
    for name in ("time_ns", "position_m", "yaw_rad", "stance"):
        assert np.array_equal(getattr(small, name), getattr(large, name)), name
    assert small.counters == large.counters
    for a, b in zip(small.steps, large.steps, strict=True):
        assert a.time_ns == b.time_ns
        assert np.array_equal(a.displacement_m, b.displacement_m)
        assert np.array_equal(a.covariance, b.covariance)


@pytest.mark.parametrize("sensor", NAMES)
def test_every_preset_walks(sensor: str) -> None:
    assert_holds(navigate(stream_of(), foot=convert({"sensor": sensor}, FootSettings, where="test")))


@pytest.mark.parametrize("sensor", ["mpu-6050", "unknown"])
@pytest.mark.parametrize("bias_rad_s", [0.05, 0.2])
def test_a_cheap_gyros_bias_is_learnt_at_rest_if_the_preset_says_so(sensor: str, bias_rad_s: float) -> None:
    stream = stream_of()
    biased = Stream(stream.time_ns, stream.accel, stream.gyro + bias_rad_s * np.array([1.0, -1.0, 1.0]))
    assert_holds(navigate(biased, foot=FootSettings(sensor=sensor)))


def test_a_bias_that_no_preset_expects_is_learnt_where_the_foot_rests_for_long() -> None:
    bias = np.array([0.06, -0.06, 0.06])
    stream = stream_of()
    biased = Stream(stream.time_ns, stream.accel, stream.gyro + bias)
    navigator = FootNavigator()
    navigator.process(biased.time_ns, biased.accel, biased.gyro)
    assert navigator.gyro_bias_rad_s == pytest.approx(bias, abs=0.006)
    assert_holds(navigate(biased))


@pytest.mark.parametrize("sensor", ["microstrain-gx3", "unknown"])
def test_a_slow_turn_as_a_foot_makes_it_is_no_bias(sensor: str) -> None:
    """0.15 rad/s about the vertical for four seconds, by a third unevenly, after rest."""
    turn = turning(4.0, 0.15)
    turn.gyro[:, 2] *= 1.0 + 0.33 * np.sin(2.0 * np.pi * 1.2 * np.arange(len(turn.gyro)) / 200.0)
    angle = turn.gyro[:, 2].sum() / 200.0
    track = navigate(Stream.joined(still(2.0), turn, still(2.0)), foot=FootSettings(sensor=sensor))
    assert sum(step.heading_change_rad for step in track.steps) == pytest.approx(angle, abs=0.02)


@pytest.mark.parametrize("scale", [0.97, 1.01, 1.03])
def test_gravity_is_what_the_accelerometer_measures_at_rest(scale: float) -> None:
    """dualfoot-fgo's left unit reads 9.90 m/s² at rest; a minute of it moves nothing by more than 5 mm."""
    rest = still(60.0)
    track = navigate(Stream(rest.time_ns, scale * rest.accel, rest.gyro))
    assert np.abs(track.position_m).max() < 0.005


def test_the_default_sensor_leaves_all_terms_alone() -> None:
    assert FootSettings() == FootSettings(sensor=REFERENCE)
    assert FootSettings().filter == FilterSettings()
    assert FootSettings().alignment == AlignmentSettings()


def test_a_preset_exchanges_the_sensors_own_part_of_the_noise() -> None:
    """GX3 0.03 and GX5 0.005 °/s/√Hz: the variances differ by what the sheets say."""
    default, gx5 = FootSettings().filter, FootSettings(sensor="microstrain-gx5").filter
    lost = math.radians(0.03) ** 2 - math.radians(0.005) ** 2
    assert gx5.gyro_noise_rad_s_sqrt_hz**2 == pytest.approx(default.gyro_noise_rad_s_sqrt_hz**2 - lost)
    assert FootSettings(sensor="xsens-mti").filter.accel_noise_m_s2_sqrt_hz > default.accel_noise_m_s2_sqrt_hz


def test_only_noise_terms_differ() -> None:
    noise = {"accel_noise_m_s2_sqrt_hz", "gyro_noise_rad_s_sqrt_hz"}
    bias = {"bias_sigma_rad_s", "rate_rad_s", "bias_walk_rad_s_sqrt_s"}
    for sensor in set(NAMES) - {REFERENCE}:
        preset = FootSettings(sensor=sensor)
        assert differing(preset.filter, FilterSettings()) <= noise
        assert differing(preset.alignment, AlignmentSettings()) == bias
        assert differing(preset, FootSettings()) == {"sensor", "filter", "alignment"}


def differing(one: msgspec.Struct, other: msgspec.Struct) -> set[str]:
    return {name for name in one.__struct_fields__ if getattr(one, name) != getattr(other, name)}


def test_a_term_set_by_hand_stays() -> None:
    settings = {"sensor": "ngimu", "filter": {"gyro_noise_rad_s_sqrt_hz": 0.002}}
    chosen = convert(settings, FootSettings, where="test").filter
    assert chosen.gyro_noise_rad_s_sqrt_hz == 0.002
    assert chosen.accel_noise_m_s2_sqrt_hz != FilterSettings().accel_noise_m_s2_sqrt_hz


def test_an_unknown_sensor_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ConfigError, match="microstrain-gx5"):
        convert({"sensor": "microstrain-gx7"}, FootSettings, where="[pdr.foot]")


def test_of_a_sensor_that_nobody_knows_the_worst_is_assumed() -> None:
    unknown = msgspec.structs.asdict(FootSettings(sensor="unknown").alignment)
    for sensor in set(NAMES) - {"unknown"}:
        known = msgspec.structs.asdict(FootSettings(sensor=sensor).alignment)
        assert all(unknown[name] >= known[name] for name in known)


def contradicts_itself(stream: Stream) -> bool:
    navigator = FootNavigator()
    navigator.process(stream.time_ns, stream.accel, stream.gyro)
    return navigator.contradicts_itself


def test_left_handed_axes_and_wrong_units_are_noticed_and_nothing_else_is() -> None:
    stream = stream_of()
    mirror = np.array([1.0, -1.0, 1.0])
    assert contradicts_itself(Stream(stream.time_ns, stream.accel * mirror, stream.gyro * mirror))
    assert contradicts_itself(Stream(stream.time_ns, stream.accel, np.degrees(stream.gyro)))
    assert not contradicts_itself(stream)
    assert not contradicts_itself(Stream(stream.time_ns, 1.03 * stream.accel, 0.97 * stream.gyro))


def test_only_what_a_cut_peak_turns_about_the_vertical_is_taken_for_a_turn() -> None:
    """Peaks about a level axis take tilt along, which gravity tells; those about one that leans take yaw too."""
    cut = ImuQuality(gyro_limit_rad_s=math.radians(400.0))
    level = stream_of(RUN, quality=cut)
    leaning = stream_of(RUN, quality=cut, mounting=Rotation.from_euler("x", 30.0, degrees=True))
    turns = [
        float(np.median([step.common_turn_sigma_rad_s for step in navigate(stream).steps]))
        for stream in (level, leaning)
    ]
    assert turns[1] > 2.0 * turns[0]
