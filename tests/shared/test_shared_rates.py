"""Rates in event time, and messages as one line, without knowing any type."""

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bootprint import wire
from bootprint.commands.bus import line
from bootprint.commands.rates import KeyRate, RateMeter
from bootprint.messages import CameraMotion, Health, ImuBatch
from bootprint.topics import Identity
from support.messages import quick

A3 = Identity("bp", "alpha", "a3")
S = 1_000_000_000
PRESSURE = A3.address("pressure", "body").key  # 10 Hz in the table
IMU = A3.address("imu", "left_foot").key  # 20 Hz in the table
GNSS = A3.address("gnss", "gnss").key  # 1 Hz in the table
POSITION = A3.address("position", "fusion").key  # 5 Hz in the table
STEP = A3.address("foot_step", "left_foot").key  # events


def heard(*series: tuple[str, float, float, float]) -> dict[str, KeyRate]:
    """Rows after series of (key, from s, to s, rate Hz), each message of 10 bytes."""
    stamps = [
        (round((start + n / rate) * S), key)
        for key, start, end, rate in series
        for n in range(round((end - start) * rate) + 1)
    ]
    meter = RateMeter()
    for time_ns, key in sorted(stamps):
        payload = msgpack.packb({"time_ns": time_ns + 2**40})
        assert len(payload) == 18
        meter.observe(key, payload)
    return {row.key: row for row in meter.rows()}


def test_rates_are_of_event_time() -> None:
    rows = heard((PRESSURE, 0.0, 3.0, 10.0), (STEP, 0.0, 3.0, 1.0))
    assert rows[PRESSURE] == KeyRate(PRESSURE, 31, pytest.approx(10.0), 10.0, pytest.approx(180.0), "ok")
    assert rows[STEP] == KeyRate(STEP, 4, pytest.approx(1.0), None, pytest.approx(18.0), "event")


@pytest.mark.parametrize(
    ("key", "rate_hz", "state"),
    [
        # Positions (5 Hz) may be a fifth off, batches of samples (20 Hz, 10 Hz) half or twice as many.
        *(
            (POSITION, rate, state)
            for rate, state in [(4.1, "slow"), (4.3, "ok"), (5.9, "ok"), (6.1, "fast")]
        ),
        *(
            (PRESSURE, rate, state)
            for rate, state in [(4.9, "slow"), (5.1, "ok"), (19.9, "ok"), (21.0, "fast")]
        ),
        (IMU, 100.0 / 7.0, "ok"),
    ],
)
def test_what_is_off_the_expected_rate_is_told(key: str, rate_hz: float, state: str) -> None:
    assert heard((key, 0.0, 9.0, rate_hz))[key].state == state


@pytest.mark.parametrize(("key", "rate_hz", "patience_s"), [(IMU, 20.0, 2.0), (GNSS, 1.0, 3.0)])
def test_who_says_nothing_for_three_periods_and_two_seconds_is_silent(
    key: str, rate_hz: float, patience_s: float
) -> None:
    for quiet_s, state in ((patience_s + 0.2, "silent"), (patience_s - 0.2, "ok")):
        assert heard((PRESSURE, 0.0, 5.0 + quiet_s, 10.0), (key, 0.0, 5.0, rate_hz))[key].state == state


def test_only_the_last_ten_seconds_count() -> None:
    rows = heard((PRESSURE, 0.0, 100.0, 1.0), (PRESSURE, 101.0, 120.0, 10.0))
    assert rows[PRESSURE].messages == 101 + 191
    assert rows[PRESSURE].rate_hz == pytest.approx(10.0)


def test_one_message_has_no_rate() -> None:
    assert heard((PRESSURE, 0.0, 0.0, 1.0))[PRESSURE] == KeyRate(PRESSURE, 1, None, 10.0, None, "ok")


def test_other_versions_and_broken_messages_are_counted() -> None:
    meter = RateMeter()
    meter.observe("bp/@v2/x", b"\xc1")
    meter.observe(PRESSURE, b"\xc1")
    assert [(row.key, row.messages, row.state) for row in meter.rows()] == [
        (PRESSURE, 1, "unreadable"),
        ("bp/@v2/x", 1, "unknown"),
    ]


def test_a_message_is_one_line_with_its_arrays_summarised() -> None:
    time_ns = 1_700_000_000 * S + 123_456_789  # 2023-11-14 22:13:20 UTC
    batch = ImuBatch.from_arrays(4, [time_ns, time_ns + 1], np.zeros((2, 3)), np.zeros((2, 3)))
    assert line(IMU, wire.encode(batch)) == (
        f"{IMU} 22:13:20.123 sample_time_ns=<16 B> accel_m_s2=<48 B> gyro_rad_s=<48 B> sequence=4"
    )
    motion = CameraMotion(
        time_ns=0,
        start_time_ns=0,
        translation_m=(1.0, 0.5, 0.0),
        rotation_rad=(0, 0, 0),
        covariance=(0.0,) * 21,
    )
    assert line("k", wire.encode(motion)) == (
        "k 00:00:00.000 start_time_ns=0 translation_m=(1, 0.5, 0) rotation_rad=(0, 0, 0) covariance=[21 items]"
    )
    health = Health(time_ns=0, service="fusion", state="ok", gauges={"age_s": 0.25})
    assert line("k", wire.encode(health)) == "k 00:00:00.000 service=fusion state=ok gauges={age_s: 0.25}"


@pytest.mark.parametrize(
    ("payload", "shown"),
    [
        (b"", "k not MessagePack, 0 B"),
        (b"\xc1", "k not MessagePack, 1 B"),
        (b"\x91" * 2000, "k not MessagePack, 2000 B"),
        (b"\x01\x02", "k not MessagePack, 2 B"),
        (msgpack.packb([1, "a"]), "k (1, a)"),
        (msgpack.packb({"a": 1}), "k --:--:--.--- a=1"),
        (msgpack.packb({"time_ns": "x"}), "k --:--:--.---"),
        (msgpack.packb({"time_ns": [7]}), "k --:--:--.---"),
        (msgpack.packb({"time_ns": 0, "a": "b\nc\x1b[0m"}), "k 00:00:00.000 a=b\\nc\\x1b[0m"),
    ],
)
def test_anything_can_be_shown(payload: bytes, shown: str) -> None:
    assert line("k", payload).startswith(shown)
    assert line("k", payload).isprintable()


@quick
@given(payload=st.binary(max_size=60), key=st.text(max_size=20))
def test_any_bytes_are_one_printable_line(payload: bytes, key: str) -> None:
    assert line(key, payload).isprintable()
