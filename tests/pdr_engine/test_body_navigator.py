"""The body-worn navigator as a whole: any mounting, rate and batch size; gaps and rubbish; messages on the bus."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.config import Origin, convert
from bootprint.errors import ConfigError
from bootprint.geomagnetism import earth_field
from bootprint.messages import BodyStep, ImuBatch, Pressure
from bootprint.topics import Identity
from pdr_engine.body import BodyNavigator, BodySettings, BodyStepEstimate
from pdr_engine.body.methods import METHODS, settings_of
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from support.walking_trunk import START_NS, TrunkStream, trunk_walk

ME = Identity("bp", "alpha", "a1")
PLACE = Origin(latitude_deg=59.3, longitude_deg=18.1)
MOUNTINGS = {
    "as worn": Rotation.identity(),
    "leaning": Rotation.from_euler("YX", [0.3, -0.2]),
    "on its back": Rotation.from_euler("y", -math.pi / 2),
    "turned left": Rotation.from_euler("z", math.pi / 2),
}


def walk_by(
    stream: TrunkStream, settings: BodySettings | None = None, batch: int = 10
) -> list[BodyStepEstimate]:
    navigator = BodyNavigator(settings)
    cuts = [slice(k, k + batch) for k in range(0, len(stream.time_ns), batch)]
    return [
        step
        for cut in cuts
        for step in navigator.process(
            stream.time_ns[cut], stream.accel[cut], stream.gyro[cut], stream.mag[cut]
        )
    ]


def off_deg(azimuth_rad: float, true_rad: float) -> float:
    return abs(math.degrees(math.remainder(azimuth_rad - true_rad, math.tau)))


@pytest.mark.parametrize("mounting", MOUNTINGS)
def test_any_mounting_walks_east(mounting: str) -> None:
    stream = trunk_walk(40.0, azimuth=lambda t: np.full_like(t, 0.5 * np.pi), mounting=MOUNTINGS[mounting])
    steps = walk_by(stream)
    assert abs(len(steps) - 72) <= 2
    assert off_deg(steps[-1].azimuth_rad, 0.5 * math.pi) < 3.0
    assert [step.gait.frequency_hz for step in steps] == pytest.approx([1.8] * len(steps), rel=0.1)
    assert off_deg(steps[-1].compass_azimuth_rad or 0.0, 0.5 * math.pi) < 3.0
    stride = steps[-1].stride
    assert np.abs(stride.level_accel_m_s2[:, 1]).max() < 0.3  # the surge is all ahead
    assert np.abs(stride.level_accel_m_s2[:, 0]).max() > 1.5
    assert stride.level_accel_m_s2[:, 2].mean() == pytest.approx(0.0, abs=0.4)


@pytest.mark.parametrize("rate_hz", [25.0, 50.0, 104.0, 400.0])
def test_any_rate_gives_the_same_walk(rate_hz: float) -> None:
    steps = walk_by(trunk_walk(20.0, rate_hz=rate_hz))
    usual = walk_by(trunk_walk(20.0))
    assert abs(len(steps) - 36) <= 1
    length = np.median([step.length_m for step in steps])
    assert length == pytest.approx(np.median([step.length_m for step in usual]), rel=0.06)


@pytest.mark.parametrize("batch", [1, 7, 1000])
def test_batches_of_any_size_give_the_same_bits(batch: int) -> None:
    stream = trunk_walk(15.0, azimuth=lambda t: 0.1 * t)
    usual, other = walk_by(stream), walk_by(stream, batch=batch)
    assert [(s.time_ns, s.length_m, s.azimuth_rad) for s in usual] == [
        (s.time_ns, s.length_m, s.azimuth_rad) for s in other
    ]
    assert len(usual) > 20


@pytest.mark.parametrize("method", METHODS)
def test_a_square_closes_by_every_method_but_the_lagging_one(method: str) -> None:
    """Four sides of 10 s, quarter turns of 2 s. The cascade's filter of a thousandth of a degree overshoots."""

    def azimuth(time_s: np.ndarray) -> np.ndarray:
        side = np.floor(time_s / 12.0)
        return 0.5 * np.pi * (side + np.clip((time_s - 12.0 * side - 10.0) / 2.0, 0.0, 1.0))

    steps = walk_by(trunk_walk(48.0, azimuth=azimuth), settings_of(method))
    ways = [
        step.length_m * np.array([math.sin(step.azimuth_rad), math.cos(step.azimuth_rad)]) for step in steps
    ]
    distance = sum(step.length_m for step in steps)
    assert np.linalg.norm(sum(ways)) < (0.06 if method != "b2" else 0.6) * distance


def test_a_gap_breaks_the_walk_and_not_the_navigator() -> None:
    stream = trunk_walk(30.0)
    keep = (stream.time_ns < START_NS + 10_000_000_000) | (stream.time_ns > START_NS + 15_000_000_000)
    cut = TrunkStream(*(column[keep] for column in (stream.time_ns, stream.accel, stream.gyro, stream.mag)))
    steps = walk_by(cut)
    inside = [step for step in steps if 10.0 < (step.time_ns - START_NS) * 1e-9 < 15.0]
    assert not inside
    assert abs(len(steps) - 45) <= 4
    assert all(a.time_ns <= b.start_ns for a, b in pairwise(steps))


def test_rubbish_is_counted_and_survived() -> None:
    stream = trunk_walk(20.0)
    accel, mag = stream.accel.copy(), stream.mag.copy()
    accel[::7] = np.nan
    mag[::5] = np.inf
    navigator = BodyNavigator()
    steps = navigator.process(stream.time_ns, accel, stream.gyro, mag)
    assert abs(len(steps) - 36) <= 1
    counters = navigator.counters()
    assert counters["dropped"] == len(accel[::7])
    assert counters["fields_dropped"] > 0


def test_standing_makes_no_steps() -> None:
    assert walk_by(trunk_walk(20.0, walks=(5.0, 5.0))) == []


def engine_says(stream: TrunkStream, origin: Origin | None = PLACE) -> list[Envelope]:
    core = EngineCore(PdrConfig(places=("body",)), ME, origin)
    address = ME.address("imu", "body")
    out: list[Envelope] = []
    for number, k in enumerate(range(0, len(stream.time_ns), 10)):
        cut = slice(k, k + 10)
        batch = ImuBatch.from_arrays(
            number, stream.time_ns[cut], stream.accel[cut], stream.gyro[cut], stream.mag[cut]
        )
        out.extend(core.handle(Envelope(address, batch)))
    out.extend(core.close())
    assert core.figures().counters["body_body_steps"] == len(out)
    assert core.figures().gauges["body_rate_hz"] == pytest.approx(100.0, rel=0.02)
    return out


def test_steps_go_out_as_messages_from_true_north() -> None:
    envelopes = engine_says(trunk_walk(20.0))
    messages = [envelope.message for envelope in envelopes]
    assert {envelope.address.key for envelope in envelopes} == {"bp/@v1/alpha/a1/body_step/body"}
    assert all(isinstance(message, BodyStep) for message in messages)
    assert [message.sequence for message in messages] == list(range(len(messages)))
    last = messages[-1]
    assert isinstance(last, BodyStep)
    declination = earth_field(PLACE, START_NS).declination_rad
    assert off_deg(last.azimuth_rad, declination) < 1.0
    assert last.time_ns - last.start_time_ns == pytest.approx(1e9 / 1.8, rel=0.05)
    assert 0.3 < last.length_m < 0.9
    assert 0.05 < last.length_sigma_m / last.length_m < 0.6
    assert [wire.encode(m) for m in messages] == [
        wire.encode(e.message) for e in engine_says(trunk_walk(20.0))
    ]


def test_without_a_magnetometer_north_is_unknown_and_said_so() -> None:
    stream = trunk_walk(10.0)
    steps = BodyNavigator().process(stream.time_ns, stream.accel, stream.gyro)
    assert steps[-1].compass_azimuth_rad is None
    assert steps[-1].azimuth_sigma_rad > 1.8


def test_settings_are_strict() -> None:
    config = convert({"places": ["body"], "body": {"step_length": "weinberg"}}, PdrConfig, where="[pdr]")
    assert config.body.step_length == "weinberg"
    with pytest.raises(ConfigError, match="step_lenght"):
        convert({"body": {"step_lenght": "weinberg"}}, PdrConfig, where="[pdr]")


def test_steps_tell_direction_reliability_and_height_where_there_is_air() -> None:
    """30 s on the level, 101 325 Pa: height 0, floor 0; a clean compass checks azimuths, satellites do not."""
    stream = trunk_walk(30.0)
    core = EngineCore(PdrConfig(places=("body",)), ME, PLACE)
    steps: list[BodyStep] = []
    for number, k in enumerate(range(0, len(stream.time_ns), 10)):
        cut = slice(k, k + 10)
        when = int(stream.time_ns[k])
        if when >= START_NS + 10_000_000_000:
            core.handle(
                Envelope(
                    ME.address("pressure", "body"),
                    Pressure(time_ns=when, sequence=number, pressure_pa=101_325.0),
                )
            )
        batch = ImuBatch.from_arrays(
            number, stream.time_ns[cut], stream.accel[cut], stream.gyro[cut], stream.mag[cut]
        )
        steps += [e.message for e in core.handle(Envelope(ME.address("imu", "body"), batch))]  # type: ignore[misc]
    assert {step.direction for step in steps} == {"forward"}
    assert steps[5].height_m is None
    assert steps[-1].height_m == pytest.approx(0.0, abs=0.05)
    assert steps[-1].floor == 0
    assert 50.0 < (steps[-1].class_pct or 0.0) <= 100.0
    assert steps[-1].planimetry_redundancy_pct == 0.0  # nobody calibrated the steps
    assert (steps[-1].external_reliability_m or 0.0) > (steps[-2].external_reliability_m or 0.0)


def test_what_satellites_told_of_north_is_doubted_more_the_longer_ago_it_was() -> None:
    """Without a compass nobody else knows: the doubt is theirs, and grows as a gyro drifts."""
    stream = trunk_walk(150.0, azimuth=lambda t: np.full_like(t, 0.5 * np.pi))
    navigator, settings = BodyNavigator(), BodySettings().heading
    doubts: list[tuple[float, float]] = []
    for second in range(150):
        cut = slice(100 * second, 100 * (second + 1))
        steps = navigator.process(stream.time_ns[cut], stream.accel[cut], stream.gyro[cut])
        doubts += [
            (second, math.sqrt(step.azimuth_sigma_rad**2 - settings.sway_sigma_rad**2)) for step in steps
        ]
        if second < 60:
            navigator.hear_fix(START_NS + second * 10**9, 1.3 * second, 0.0, 3.0)
    first, taught, last = (next(doubt for at, doubt in doubts if at >= since) for since in (5, 60, 145))
    assert first > 1.0
    assert taught < 0.25
    drifted = settings.gyro_drift_rad_s * (
        145.0 - 54.0
    )  # the last stretch ended some seconds before the minute
    assert last == pytest.approx(math.hypot(taught, drifted), rel=0.1)
