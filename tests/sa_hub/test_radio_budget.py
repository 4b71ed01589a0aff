"""The law of the budget: in every window of T seconds at most rate · T + depth bits, from an empty start."""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sa_hub.radio.budget import TokenBucket, depth_bits
from sa_hub.radio.meter import LinkMeter

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


def test_what_the_law_allows_is_granted_to_the_bit() -> None:
    bucket = TokenBucket(1200)
    assert not bucket.take(1, START_NS)
    assert not bucket.take(20, START_NS + S * 160 // 1200)
    assert bucket.take(20, START_NS + -(-S * 160 // 1200))
    assert bucket.take(500, START_NS + 100 * S)
    assert not bucket.take(1, START_NS + 100 * S)


def test_the_meter_counts_the_last_ten_seconds() -> None:
    meter = LinkMeter()
    for second in range(20):
        meter.sent(25, START_NS + second * S)
    assert meter.bits_per_s(START_NS + 19 * S) == 200.0
    assert meter.bits_per_s(START_NS + 24 * S) == 100.0
    assert meter.bits_per_s(START_NS + 29 * S) == 0.0
    assert (meter.frames_sent, meter.bytes_sent) == (20, 500)
