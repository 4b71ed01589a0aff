"""The engine's core on the bus's messages: same input, same bytes; steps and poses that belong together."""

import dataclasses
import math
import re

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.config import convert
from bootprint.errors import ConfigError
from bootprint.messages import FootPose, FootStep, ImuBatch, Pressure, symmetric
from bootprint.topics import Identity
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from support.foot_streams import START_NS, Stream, navigate, walk

ME = Identity("bp", "alpha", "a1")
WALK = walk(6)


def batches(stream: Stream, place: str, size: int = 10) -> list[Envelope]:
    address = ME.address("imu", place)
    return [
        Envelope(
            address,
            ImuBatch.from_arrays(
                k // size, stream.time_ns[k : k + size], stream.accel[k : k + size], stream.gyro[k : k + size]
            ),
        )
        for k in range(0, len(stream.time_ns), size)
    ]


def run(inputs: list[Envelope], config: PdrConfig | None = None, tick_every: int = 0) -> list[Envelope]:
    core = EngineCore(config or PdrConfig(), ME)
    out: list[Envelope] = []
    for count, envelope in enumerate(inputs):
        out.extend(core.handle(envelope))
        if tick_every and count % tick_every == 0:
            assert not list(core.tick(envelope.message.time_ns))
    return [*out, *core.close()]


def of_kind(envelopes: list[Envelope], kind: type) -> list:
    return [envelope.message for envelope in envelopes if isinstance(envelope.message, kind)]


def as_bytes(envelopes: list[Envelope]) -> list[tuple[str, bytes]]:
    return [(envelope.address.key, wire.encode(envelope.message)) for envelope in envelopes]


def test_the_same_input_gives_the_same_bytes_whatever_the_ticks() -> None:
    inputs = [
        e for pair in zip(batches(WALK, "left_foot"), batches(WALK, "right_foot"), strict=True) for e in pair
    ]
    first = as_bytes(run(inputs))
    assert len(first) > 100
    assert first == as_bytes(run(inputs, tick_every=3))


@settings(max_examples=10, deadline=None)
@given(st.integers(1, 500))
def test_the_size_of_batches_changes_no_byte(size: int) -> None:
    assert as_bytes(run(batches(WALK, "left_foot", size))) == as_bytes(run(batches(WALK, "left_foot")))


def test_steps_are_the_navigator_s_in_order_and_without_holes() -> None:
    out = run(batches(WALK, "left_foot"))
    steps, expected = of_kind(out, FootStep), navigate(WALK).steps
    assert [step.sequence for step in steps] == list(range(len(expected)))
    assert [step.time_ns for step in steps] == [step.time_ns for step in expected]
    for step, own in zip(steps, expected, strict=True):
        assert step.displacement_m == tuple(own.displacement_m)
        np.testing.assert_allclose(symmetric(step.covariance), own.covariance, rtol=1e-9, atol=1e-15)
    assert [step.motion for step in steps].count("walking") == 6
    assert {e.address.key for e in out} == {
        f"bp/@v1/alpha/a1/{s}/left_foot" for s in ("foot_step", "foot_pose")
    }


def test_poses_lie_on_the_grid_and_continue_their_step() -> None:
    out = run(batches(WALK, "left_foot"))
    poses, track = of_kind(out, FootPose), navigate(WALK)
    cells = [pose.time_ns // 100_000_000 for pose in poses]
    assert cells == list(range(cells[0], cells[0] + len(cells)))
    assert all(pose.time_ns % 100_000_000 < 5_000_000 for pose in poses)
    ends = {k: (step.time_ns, step) for k, step in enumerate(track.steps)}
    position, yaw = np.zeros(3), 0.0
    reached = {}
    for k, step in enumerate(track.steps):
        c, s = math.cos(yaw), math.sin(yaw)
        position = position + np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ step.displacement_m
        yaw += step.heading_change_rad
        reached[k] = position, yaw
    for pose in poses:
        assert pose.step_sequence == max(k for k, (end_ns, _) in ends.items() if end_ns <= pose.time_ns)
        start, heading = reached[pose.step_sequence]
        c, s = math.cos(heading), math.sin(heading)
        here = start + np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ pose.displacement_m
        at = np.searchsorted(track.time_ns, pose.time_ns)
        np.testing.assert_allclose(here, track.position_m[at], atol=1e-9)
        assert pose.in_stance == track.stance[at]


def test_a_step_comes_before_the_poses_that_build_on_it() -> None:
    known = -1
    newest = 0
    for message in (envelope.message for envelope in run(batches(WALK, "left_foot"))):
        assert message.time_ns >= newest
        newest = message.time_ns
        if isinstance(message, FootStep):
            known = message.sequence
        else:
            assert isinstance(message, FootPose)
            assert message.step_sequence == known >= 0


def test_other_places_and_subjects_are_left_to_others() -> None:
    core = EngineCore(PdrConfig(places=("left_foot",)), ME)
    for place in ("body", "right_foot"):
        assert list(core.handle(batches(WALK, place)[0])) == []
    pressure = Envelope(ME.address("pressure", "body"), Pressure(time_ns=START_NS, pressure_pa=1e5))
    assert list(core.handle(pressure)) == []
    assert core.figures().counters["other_places"] == 3


def test_figures_tell_of_sensors_that_contradict_each_other() -> None:
    right, mirror = walk(12), np.array([1.0, 1.0, -1.0])
    left = Stream(right.time_ns, right.accel * mirror, right.gyro * mirror)
    told = []
    for stream in (right, left):
        core = EngineCore(PdrConfig(), ME)
        for envelope in batches(stream, "left_foot"):
            list(core.handle(envelope))
        told.append(core.figures())
    assert [figures.state for figures in told] == ["ok", "degraded"]
    assert told[1].note == "axes or units contradict each other: left_foot"


def test_figures_tell_rates_counts_and_silence() -> None:
    core = EngineCore(PdrConfig(), ME)
    for envelope in batches(WALK, "left_foot"):
        core.handle(envelope)
    figures = core.figures()
    assert figures.counters["left_foot_accepted"] == len(WALK.time_ns)
    assert figures.counters["left_foot_steps"] >= 6
    assert figures.counters["right_foot_accepted"] == 0
    assert figures.gauges["left_foot_rate_hz"] == pytest.approx(200.0, rel=0.02)
    core.tick(int(WALK.time_ns[-1]) + 1_000_000_000)
    assert core.figures().state == "ok"
    core.tick(int(WALK.time_ns[-1]) + 3_000_000_000)
    assert core.figures().state == "degraded"
    assert "left_foot" in core.figures().note


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"plces": ["left_foot"]}, "unknown key 'plces'; did you mean 'places'"),
        ({"foot": {"method": "magic"}}, "foot.method is 'magic'"),
        ({"foot": {"detector": {"shoe_window_s": 0.0}}}, "foot.detector.shoe_window_s"),
        ({"places": []}, "places"),
    ],
)
def test_a_wrong_section_is_refused_by_name(values: dict, complaint: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(complaint)):
        convert(values, PdrConfig, where="[pdr]")


def test_a_step_message_tells_all_that_the_navigator_tells() -> None:
    """Only arrays change their shape on the way; whoever adds a figure to a step adds it to the message."""
    messages = of_kind(run(batches(WALK, "left_foot")), FootStep)
    for message, step in zip(messages, navigate(WALK).steps, strict=True):
        for field in dataclasses.fields(step):
            if field.name == "covariance":
                np.testing.assert_allclose(
                    symmetric(message.covariance), step.covariance, rtol=1e-9, atol=1e-20
                )
            else:
                told = getattr(step, field.name)
                assert getattr(message, field.name) == (
                    tuple(told) if field.name == "displacement_m" else told
                )
        assert message.length_m == math.dist((0.0, 0.0, 0.0), step.displacement_m)
        assert message.horizontal_length_m == math.hypot(*step.displacement_m[:2])


def test_a_step_of_an_older_engine_leaves_what_it_does_not_know_unknown() -> None:
    (message, *_) = of_kind(run(batches(WALK, "left_foot")), FootStep)
    plain = msgspec.msgpack.decode(wire.encode(message))
    new = ("direction", "length_m", "clearance_m", "swing_s", "stance_s", "quality_pct", "common_scale_sigma")
    older = {name: value for name, value in plain.items() if name not in new}
    decoded = msgspec.convert(older, FootStep)
    assert [getattr(decoded, name) for name in new] == [None] * len(new)
    assert decoded.covariance == message.covariance
