"""A fusion that is restarted in mid-walk goes on from its saved state, or says why not."""

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.messages import Position
from bootprint.remembering import Memory, RememberingPart
from bootprint.saved_state import StateFile
from fusion.config import FusionConfig
from fusion.engine import FusionCore
from fusion.memory import FILE, FORM, SAVE_EVERY_NS, Saved, kept_of, objection, understood
from support.foot_walks import (
    EAST,
    LEFT,
    NS,
    ORIGIN,
    RIGHT,
    T0,
    WHO,
    SimulatedWalk,
    in_time_order,
    rectangle,
)

CONFIG = FusionConfig(gnss_sources=(), start=EAST)
WALK = SimulatedWalk(rectangle(20, 8), 90.0)
MESSAGES = in_time_order(WALK.messages(LEFT), WALK.messages(RIGHT))


def fed(core: FusionCore, begin_s: float, end_s: float) -> list[Position]:
    """Positions out of what was sent between these times."""
    said: list[Envelope] = []
    for one in MESSAGES:
        if begin_s <= (one.message.time_ns - T0) / NS < end_s:
            said += core.handle(one)
    return [one.message for one in said if isinstance(one.message, Position)]


def saved_at(time_s: float) -> Saved:
    core = FusionCore(CONFIG, WHO, ORIGIN)
    fed(core, 0.0, time_s)
    saved = core.remembered()
    assert saved is not None
    return saved


def error_m(position: Position) -> float:
    truth = WALK.body(LEFT, RIGHT, time_s=(position.time_ns - T0) / NS)
    return math.hypot(position.east_m - truth[0], position.north_m - truth[1])


@pytest.mark.parametrize("told_again_s", [10.0, 0.0])
def test_a_restart_goes_on_within_a_second(told_again_s: float) -> None:
    """Killed at 42 s, saved at 40 s, back at 44 s: with the bus's cache of steps, and without it."""
    core = FusionCore(CONFIG, WHO, ORIGIN, saved=saved_at(40.0))
    said = fed(core, 44.0 - told_again_s, 80.0)
    assert core.counters["memory_gone_on_from"] == 1
    assert core.counters["start_refused"] == 0
    first = next(position for position in said if position.time_ns >= T0 + 45 * NS)
    assert first.mode == "boots"
    assert first.sequence > 190  # numbered on
    assert error_m(first) < (0.3 if told_again_s else 8.0)  # 1.4 m/s that nobody saw
    if told_again_s:
        assert max(error_m(position) for position in said) < 0.6
        assert core.counters["duplicate_steps"] > 0


def test_what_nobody_saw_is_owned_up_to() -> None:
    core = FusionCore(CONFIG, WHO, ORIGIN, saved=saved_at(40.0))
    said = fed(core, 46.0, 60.0)
    position = said[-1]
    variance = position.covariance_m2[0] + position.covariance_m2[3]
    assert error_m(position) < 3.0 * math.sqrt(variance)


def test_nothing_is_remembered_before_the_soldier_is_placed() -> None:
    core = FusionCore(FusionConfig(gnss_sources=()), WHO, ORIGIN)
    assert core.remembered() is None
    fed(core, 0.0, 20.0)
    assert core.remembered() is None


@pytest.mark.parametrize(
    ("resumed_s", "words"), [(160.0, "119 s old"), (-1000.0, "ahead of the first message")]
)
def test_a_state_of_another_time_is_refused_in_words(resumed_s: float, words: str) -> None:
    saved = saved_at(40.0)
    shift = round((40.0 - resumed_s) * NS) + NS
    aged = msgspec.structs.replace(saved, time_ns=saved.time_ns + shift)
    core = FusionCore(CONFIG, WHO, ORIGIN, saved=aged)
    fed(core, 40.0, 50.0)
    assert core.counters["memory_refused"] == 1
    assert words in core.figures().note
    assert core.counters["start_refused"] == 1  # and nobody claims to be at the door again


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"soldier": "b7"}, "soldier 'b7'"),
        ({"reference": "third_foot"}, "feet"),
        ({"start": None}, "configured anew"),
        ({"state": (0.0,)}, "size"),
    ],
)
def test_another_ones_state_is_refused(change: dict[str, object], reason: str) -> None:
    saved = msgspec.structs.replace(saved_at(20.0), **change)
    assert reason in (objection(saved, WHO.soldier, CONFIG) or "")


def test_a_covariance_that_is_none_is_refused() -> None:
    saved = saved_at(20.0)
    assert objection(saved, WHO.soldier, CONFIG) is None
    size = len(saved.state)
    for wrong in (-np.eye(size), np.full((size, size), math.nan), np.triu(np.ones((size, size)))):
        bad = msgspec.structs.replace(saved, covariance=tuple(wrong.ravel().tolist()))
        assert objection(bad, WHO.soldier, CONFIG) == "covariance is none"


def part_of(core: FusionCore, path: Path) -> RememberingPart:
    return RememberingPart(
        core, Memory(StateFile(path, FORM), SAVE_EVERY_NS, lambda: kept_of(core.remembered()))
    )


def saved_in(path: Path) -> Saved | None:
    kept = StateFile(path, FORM).load()
    return None if kept is None else understood(kept, WHO.soldier, CONFIG)


def test_the_file_is_written_in_event_time_and_read_back(tmp_path: Path) -> None:
    path = tmp_path / "state" / FILE
    core = FusionCore(CONFIG, WHO, ORIGIN)
    part = part_of(core, path)
    assert saved_in(path) is None
    for one in MESSAGES[:400]:
        list(part.handle(one))
        list(part.tick(one.message.time_ns))
    saved = saved_in(path)
    assert saved is not None
    assert MESSAGES[399].message.time_ns - saved.time_ns < 3 * NS
    list(part.close())
    assert saved_in(path) == core.remembered()


def test_a_disk_that_takes_nothing_costs_the_memory_only(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file where a folder should be")
    part = part_of(FusionCore(CONFIG, WHO, ORIGIN), tmp_path / "state" / "x")
    for one in MESSAGES[:200]:
        list(part.handle(one))
    list(part.close())
    figures = part.figures()
    assert figures.counters["memory_unsaved"] == 1
    assert "state is not saved" in figures.note
