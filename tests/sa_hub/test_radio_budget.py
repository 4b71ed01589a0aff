"""The law of the budget: in every window of T seconds at most rate · T + depth bits, from an empty start."""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sa_hub.radio.budget import TokenBucket, depth_bits
from sa_hub.radio.link_profile import LinkProfile
from sa_hub.radio.medium import Medium
from sa_hub.radio.meter import LinkMeter
from sa_hub.radio.profiles import names

S = 1_000_000_000
START_NS = 1_790_000_000 * S


@pytest.mark.parametrize(
    ("rate_bits_per_s", "depth"),
    [(10, 400), (75, 3000), (100, 4000), (1200, 4000), (2000, 4000), (9600, 19_200), (1_000_000, 2_000_000)],
)
def test_depth_is_rate_times_two_to_forty_seconds(rate_bits_per_s: int, depth: int) -> None:
    assert depth_bits(rate_bits_per_s) == depth
    assert depth == rate_bits_per_s * min(max(4000 / rate_bits_per_s, 2), 40)


@settings(deadline=None)
@given(
    st.integers(1, 200_000),
    st.lists(st.tuples(st.integers(-2 * S, 20 * S), st.integers(1, 400)), max_size=60),
)
def test_no_window_carries_more_than_the_law_allows(rate: int, wishes: list[tuple[int, int]]) -> None:
    bucket, now_ns = TokenBucket(rate), START_NS
    bucket.fill(now_ns)
    sent: list[tuple[int, int]] = []
    newest_ns = now_ns
    for wait_ns, air_bytes in wishes:
        now_ns += wait_ns
        newest_ns = max(newest_ns, now_ns)
        if bucket.take(air_bytes, now_ns):
            sent.append((newest_ns, 8 * air_bytes))
    for first, (begin_ns, _) in enumerate(sent):
        total = 0
        for end_ns, bits in sent[first:]:
            total += bits
            assert total <= Fraction(rate * (end_ns - begin_ns), S) + bucket.depth_bits
    running = 0
    for end_ns, bits in sent:  # empty at start: from there not even the depth is granted
        running += bits
        assert running <= Fraction(rate * (end_ns - START_NS), S)


@settings(deadline=None, max_examples=40)
@given(
    st.sampled_from(names()),
    st.lists(st.tuples(st.integers(0, 60 * S), st.integers(1, 250), st.booleans()), max_size=60),
)
def test_the_law_holds_for_every_radio_and_frames_never_overlap(
    name: str, wishes: list[tuple[int, int, bool]]
) -> None:
    link = LinkProfile(name="net", profile=name)
    bucket, now_ns = TokenBucket(link.rate_bits_per_s, link.depth_bits, link.pace_bits_per_s), START_NS
    bucket.fill(now_ns)
    sent: list[tuple[int, int]] = []
    for wait_ns, size, busy in wishes:
        now_ns += wait_ns
        bucket.busy = busy
        if bucket.take(link.air_bytes(size), now_ns):
            assert not busy
            sent.append((now_ns, 8 * link.air_bytes(size)))
    for first, (begin_ns, _) in enumerate(sent):
        total = 0
        for end_ns, bits in sent[first:]:
            assert total <= Fraction(
                link.channel_bits_per_s * (end_ns - begin_ns), S
            )  # all before it has left
            total += bits
            assert total <= Fraction(link.rate_bits_per_s * (end_ns - begin_ns), S) + link.depth_bits


def test_a_frame_waits_until_the_last_has_left_and_the_modem_is_free() -> None:
    bucket = TokenBucket(1200, channel_bits_per_s=2400)
    bucket.fill(START_NS)
    now_ns = START_NS + 10 * S
    assert bucket.take(30, now_ns)  # 240 bits: a tenth of a second at 2,400 bit/s
    assert not bucket.take(1, now_ns + S // 10 - 1)
    assert bucket.refused
    assert bucket.take(30, now_ns + S // 10)
    bucket.busy = True
    assert not bucket.take(1, now_ns + S)
    bucket.busy = False
    assert bucket.take(1, now_ns + S)


def test_what_the_law_allows_is_granted_to_the_bit() -> None:
    bucket = TokenBucket(1200)
    assert not bucket.take(1, START_NS)
    assert not bucket.take(20, START_NS + S * 160 // 1200)
    assert bucket.take(20, START_NS + -(-S * 160 // 1200))
    assert bucket.take(500, START_NS + 100 * S)
    assert not bucket.take(1, START_NS + 100 * S)


def test_the_meter_counts_the_last_ten_seconds() -> None:
    meter = LinkMeter(Medium(rate_bits_per_s=1200, header_bytes=0, mtu_bytes=250))
    for second in range(20):
        meter.sent(25, START_NS + second * S)
    assert meter.bits_per_s(START_NS + 19 * S) == 200.0
    assert meter.bits_per_s(START_NS + 24 * S) == 100.0
    assert meter.bits_per_s(START_NS + 29 * S) == 0.0
    assert (meter.frames_sent, meter.bytes_sent) == (20, 500)


def test_the_meter_tells_the_airtime_of_the_last_hour_and_what_the_duty_cycle_leaves() -> None:
    """100 frames of 125 bytes at 1,000 bit/s: one second each; ten percent of an hour are 360 s."""
    medium = Medium(rate_bits_per_s=1000, header_bytes=0, mtu_bytes=250, duty_cycle=0.1)
    meter = LinkMeter(medium)
    for minute in range(100):
        meter.sent(125, START_NS + 60 * minute * S)
    now_ns = START_NS + 99 * 60 * S
    assert meter.airtime_share(now_ns) == pytest.approx(60 / 3600)
    assert meter.duty_left_s(now_ns) == pytest.approx(300.0)
    meter.set_back(1800 * S)
    assert meter.duty_left_s(now_ns - 1800 * S) == pytest.approx(300.0)
    assert meter.duty_left_s(now_ns + 2 * 3600 * S) == 360.0
    assert LinkMeter(Medium(rate_bits_per_s=1000, header_bytes=0, mtu_bytes=250)).duty_left_s(now_ns) is None
