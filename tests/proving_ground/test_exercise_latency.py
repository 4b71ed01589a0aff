"""How late tracks are, with the start by itself."""

import pytest

from bootprint.clock import NS_PER_S
from proving_ground.exercises.scoring.heard import Heard, latencies_ms


def test_the_start_is_told_by_itself() -> None:
    start_ns = 1_000 * NS_PER_S
    slow = Heard(latencies=[(start_ns + NS_PER_S, 4.0), (start_ns + 10 * NS_PER_S, 0.5)])
    quick = Heard(latencies=[(start_ns + 20 * NS_PER_S, 0.5)])
    told = latencies_ms([slow, quick, Heard()], start_ns)
    assert told == {"latency_p99_ms": pytest.approx(500.0), "latency_start_p99_ms": pytest.approx(4000.0)}


def test_who_told_nothing_was_not_late() -> None:
    assert latencies_ms([Heard()], 0) == {"latency_p99_ms": None, "latency_start_p99_ms": None}
