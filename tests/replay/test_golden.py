"""Process replay: what every service makes of the small recording is what it made before.

A difference here is a decision: look at it, then ``make golden`` and commit both.
"""

import math

import pytest

from bootprint.bus import MemoryBus
from support.golden import GOLDEN, TABLES, play_small_walk, read_table

# Other processors may round differently in the last digits; nothing else may differ.
RELATIVE, ABSOLUTE = 1e-4, 1e-6


@pytest.fixture(scope="module")
def bus() -> MemoryBus:
    return play_small_walk()


def alike(golden: str, now: str) -> bool:
    """Equal to the letter, or equal numbers but for rounding."""
    if golden == now:
        return True
    try:
        return math.isclose(float(golden), float(now), rel_tol=RELATIVE, abs_tol=ABSOLUTE)
    except ValueError:
        return False


@pytest.mark.parametrize("name", TABLES)
def test_outputs_are_golden(name: str, bus: MemoryBus) -> None:
    golden, now = list(read_table(name)), TABLES[name](bus)
    for row, (expected, got) in enumerate(zip(golden, now, strict=False), start=1):
        same = len(expected) == len(got) and all(map(alike, expected, got))
        assert same, f"{GOLDEN.name}/{name}:{row}\n golden {expected}\n now    {got}"
    assert len(now) == len(golden), f"{name}: {len(now)} rows, golden has {len(golden)}"


def test_twice_the_same_recording_gives_the_same_bytes(bus: MemoryBus) -> None:
    again = play_small_walk()
    assert len(again.journal) > 500
    assert again.journal == bus.journal
