"""Every message type: over the wire and back, readable without schema, and refused when it is not what it says."""

import contextlib
import math
from typing import Any

import msgpack
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from bootprint import messages as m
from bootprint import wire
from bootprint.errors import WireError
from bootprint.topics import TOPICS, Topic
from support.messages import finite, messages, plain, quick, times_ns

each_topic = pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.subject)


def fields_with_numbers(type_: type[m.Message]) -> list[str]:
    """Fields that hold floats, alone or in a tuple or map."""
    schema = msgspec.json.schema_components([type_])[1][type_.__name__]["properties"]
    return [name for name, field in schema.items() if '"number"' in msgspec.json.encode(field).decode()]


@each_topic
@quick
@given(data=st.data())
def test_what_is_encoded_is_decoded(topic: Topic, data: st.DataObject) -> None:
    message = data.draw(messages(topic.message))
    assert wire.decode(topic.subject, wire.encode(message)) == message


@each_topic
@quick
@given(data=st.data())
def test_plain_messagepack_reads_a_map_of_the_field_names(topic: Topic, data: st.DataObject) -> None:
    message = data.draw(messages(topic.message))
    read = msgpack.unpackb(wire.encode(message))
    for name, value in plain(message).items():
        default = next(f.default for f in msgspec.structs.fields(topic.message) if f.name == name)
        expected = list(value) if isinstance(value, tuple) else value
        # Fields that stand at their default stay off the wire; nothing else does.
        assert name in read or value in (default, {}), name
        assert read.pop(name, expected) == expected
    assert not read


@each_topic
@quick
@given(data=st.data())
def test_unknown_fields_are_ignored(topic: Topic, data: st.DataObject) -> None:
    message = data.draw(messages(topic.message))
    newer = msgpack.unpackb(wire.encode(message)) | {"field_of_a_later_version": [1, {"a": None}]}
    assert wire.decode(topic.subject, msgpack.packb(newer)) == message


@quick
@given(message=messages(m.Health))
def test_the_same_message_gives_the_same_bytes(message: m.Health) -> None:
    again = msgspec.structs.replace(message, counters=dict(reversed(message.counters.items())))
    assert wire.encode(message) == wire.encode(again)


@each_topic
@quick
@given(payload=st.binary(max_size=200))
def test_any_bytes_are_a_message_or_a_wire_error(topic: Topic, payload: bytes) -> None:
    with pytest.raises(WireError, match=topic.subject):
        wire.decode(topic.subject, payload)


@each_topic
@quick
@given(data=st.data())
def test_damaged_bytes_are_a_message_or_a_wire_error(topic: Topic, data: st.DataObject) -> None:
    payload = bytearray(wire.encode(data.draw(messages(topic.message))))
    at = data.draw(st.integers(0, len(payload) - 1))
    payload[at] ^= 1 << data.draw(st.integers(0, 7))
    with contextlib.suppress(WireError):
        assert isinstance(wire.decode(topic.subject, bytes(payload)), topic.message)
    with pytest.raises(WireError):
        wire.decode(topic.subject, bytes(payload[:at]))


def test_deeply_nested_and_oversized_payloads_are_wire_errors() -> None:
    with pytest.raises(WireError):
        wire.decode("health", b"\x81\xa1x" + b"\x91" * 100_000)
    with pytest.raises(WireError, match="more than 1048576"):
        wire.decode("health", bytes(wire.MAX_MESSAGE_BYTES + 1))


def poison(value: Any, bad: float) -> Any:
    """The value with one number replaced."""
    if isinstance(value, tuple | list):
        return type(value)([*value[:-1], bad])
    return {"gauge": bad} if isinstance(value, dict) else bad


@each_topic
@quick
@given(data=st.data(), bad=st.sampled_from([math.nan, math.inf, -math.inf]))
def test_what_is_not_finite_is_refused(topic: Topic, data: st.DataObject, bad: float) -> None:
    message = data.draw(messages(topic.message))
    for name in fields_with_numbers(topic.message):
        fields = plain(message)
        fields[name] = poison(fields[name], bad)
        with pytest.raises(ValueError, match=name):
            topic.message(**fields)
        sent = {key: value for key, value in fields.items() if value is not None}
        with pytest.raises(WireError):
            wire.decode(topic.subject, msgpack.packb(sent))


BATCH = m.ImuBatch.from_arrays(0, [1, 2], np.zeros((2, 3)), np.ones((2, 3)), np.ones((2, 3)))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("sample_time_ns", b""),
        ("sample_time_ns", bytes(15)),
        ("sample_time_ns", bytes(24)),
        ("accel_m_s2", bytes(47)),
        ("gyro_rad_s", bytes(72)),
        ("mag_ut", bytes(24)),
        ("gyro_rad_s", np.array([0, 0, 0, 0, 0, np.nan]).tobytes()),
        ("mag_ut", np.array([np.inf, 0, 0, 0, 0, 0]).tobytes()),
    ],
)
def test_a_batch_of_wrong_shape_or_value_is_refused(field: str, value: bytes) -> None:
    fields = plain(BATCH) | {field: value}
    with pytest.raises(ValueError, match=r"bytes|finite"):
        m.ImuBatch(**fields)
    with pytest.raises(WireError, match=r"bytes|finite"):
        wire.decode("imu", msgpack.packb(fields))


def test_a_batch_refuses_arrays_of_another_shape() -> None:
    with pytest.raises(ValueError, match=r"\(n, 3\)"):
        m.ImuBatch.from_arrays(0, [1, 2], np.zeros((3, 2)), np.zeros((2, 3)))
    with pytest.raises(ValueError, match="want 48"):
        m.ImuBatch.from_arrays(0, [1, 2], np.zeros((3, 3)), np.zeros((2, 3)))


@quick
@given(times=st.lists(times_ns, min_size=1, max_size=5), data=st.data())
def test_a_batch_gives_its_arrays_back(times: list[int], data: st.DataObject) -> None:
    rows = st.lists(st.tuples(finite, finite, finite), min_size=len(times), max_size=len(times))
    accel, gyro = data.draw(rows), data.draw(rows)
    batch = m.ImuBatch.from_arrays(7, np.array(times, dtype=np.int64), accel, gyro)
    assert (batch.time_ns, batch.mag) == (times[0], None)
    assert_array_equal(batch.times, times)
    assert_array_equal(batch.accel, accel)
    assert_array_equal(batch.gyro, gyro)


def test_arrays_on_the_wire_are_little_endian() -> None:
    read = msgpack.unpackb(wire.encode(BATCH))
    assert read["sample_time_ns"] == b"\1\0\0\0\0\0\0\0\2\0\0\0\0\0\0\0"
    assert read["gyro_rad_s"] == b"\0\0\0\0\0\0\xf0\x3f" * 6


POSITION: dict[str, Any] = {
    "time_ns": 1,
    "mode": "boots",
    "latitude_deg": 47.0,
    "longitude_deg": 8.0,
    "height_m": 500.0,
    "east_m": 0.0,
    "north_m": 0.0,
    "up_m": 0.0,
    "covariance_m2": (1.0, 0.0, 0.0, 1.0, 0.0, 1.0),
}
STEP: dict[str, Any] = {
    "time_ns": 2,
    "start_time_ns": 1,
    "displacement_m": (1.0, 0.0, 0.0),
    "heading_change_rad": 0.1,
    "covariance": (1.0,) * 10,
}
TRACK: dict[str, Any] = {
    "time_ns": 1,
    "soldier": "a3",
    "number": 3,
    "state": "fresh",
    "latitude_deg": 47.0,
    "longitude_deg": 8.0,
    "height_m": None,
    "accuracy_m": 1.0,
}


@pytest.mark.parametrize(
    ("type_", "good", "field", "bad"),
    [
        (m.Position, POSITION, "latitude_deg", 90.001),
        (m.Position, POSITION, "longitude_deg", -181.0),
        (m.Position, POSITION, "covariance_m2", (1.0,) * 5),
        (m.Position, POSITION, "velocity_m_s", (1.0, 2.0, 3.0, 4.0)),
        (m.Position, POSITION, "reliability_pct", 100.5),
        (m.Position, POSITION, "time_ns", 2**63),
        (m.FootStep, STEP, "covariance", (1.0,) * 9),
        (m.FootStep, STEP, "covariance", (1.0,) * 11),
        (m.Pressure, {"time_ns": 1, "pressure_pa": 101_325.0}, "pressure_pa", 0.0),
        (m.Track, TRACK, "number", 1024),
        (m.Track, TRACK, "number", -1),
        (m.Track, TRACK, "soldier", ""),
        (m.Track, TRACK, "soldier", "x" * 65),
    ],
)
def test_limits_hold_when_building_and_when_decoding(
    type_: type[m.Message], good: dict[str, Any], field: str, bad: object
) -> None:
    subject = next(topic.subject for topic in TOPICS if topic.message is type_)
    assert wire.decode(subject, msgpack.packb(good)) == type_(**good)
    with pytest.raises(ValueError, match=field):
        type_(**good | {field: bad})
    with pytest.raises(WireError, match=field):
        wire.decode(subject, msgpack.packb(good | {field: bad}))


def test_numpy_scalars_travel_as_numbers() -> None:
    message = m.Pressure(time_ns=1, pressure_pa=np.float64(99_000.5), sequence=np.int64(3))  # type: ignore[arg-type]
    assert msgpack.unpackb(wire.encode(message)) == {"time_ns": 1, "pressure_pa": 99_000.5, "sequence": 3}
    with pytest.raises(TypeError, match="a complex cannot travel"):
        wire.encode(m.Health(time_ns=1, service="x", state="ok", note=1j))  # type: ignore[arg-type]


def test_the_upper_triangle_is_taken_row_by_row() -> None:
    assert m.upper_triangle([[1, 2, 3], [2, 4, 5], [3, 5, 6]]) == (1, 2, 3, 4, 5, 6)


@quick
@given(size=st.integers(1, 7), data=st.data())
def test_symmetric_is_the_inverse_of_upper_triangle(size: int, data: st.DataObject) -> None:
    count = size * (size + 1) // 2
    triangle = tuple(data.draw(st.lists(finite, min_size=count, max_size=count)))
    matrix = m.symmetric(triangle)
    assert matrix.shape == (size, size)
    assert_array_equal(matrix, matrix.T)
    assert m.upper_triangle(matrix) == triangle


@pytest.mark.parametrize("count", [2, 4, 5, 7, 20])
def test_other_counts_are_no_triangle(count: int) -> None:
    with pytest.raises(ValueError, match=f"{count} numbers"):
        m.symmetric([0.0] * count)
