"""Files of state: the newest whole slot comes back, whatever a kill, a power cut or a stranger has done to them."""

import os
import signal
import stat
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.figures import Figures
from bootprint.remembering import Memory, RememberingPart, recall
from bootprint.saved_state import Form, Kept, StateError, StateFile

FORM = Form("walk", 3, 10_000)


def written(path: Path, *payloads: bytes) -> Path:
    file = StateFile(path, FORM)
    for number, payload in enumerate(payloads):
        file.save(Kept(number, payload))
    file.close()
    return path


def test_the_newest_comes_back_and_only_its_owner_may_read_it(tmp_path: Path) -> None:
    path = written(tmp_path / "state" / "walk", b"one", b"two", b"three")
    assert StateFile(path, FORM).load() == Kept(2, b"three")
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert StateFile(tmp_path / "none", FORM).load() is None


def test_a_new_process_writes_over_the_older_slot(tmp_path: Path) -> None:
    path = written(tmp_path / "walk", b"one", b"two", b"three")
    again = StateFile(path, FORM)
    again.load()
    again.save(Kept(3, b"four"))
    assert StateFile(path, FORM).load() == Kept(3, b"four")
    path.write_bytes(path.read_bytes()[: FORM.slot_bytes])  # the slot of "four" is gone
    assert StateFile(path, FORM).load() == Kept(2, b"three")


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_no_damage_is_taken_for_state(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    path = written(tmp_path_factory.mktemp("s") / "walk", b"a" * 300, b"b" * 500)
    raw = bytearray(path.read_bytes())
    for at in data.draw(st.lists(st.integers(0, len(raw) - 1), min_size=1, max_size=4)):
        raw[at] ^= data.draw(st.integers(1, 255))
    path.write_bytes(raw[: data.draw(st.integers(0, len(raw)))])
    try:
        kept = StateFile(path, FORM).load()
    except StateError:
        return
    assert kept in (Kept(0, b"a" * 300), Kept(1, b"b" * 500))


@pytest.mark.parametrize(
    ("form", "reason"),
    [(Form("other", 3, 10_000), "of walk version 3, not other 3"), (Form("walk", 4, 10_000), "not walk 4")],
)
def test_state_of_another_kind_is_refused_with_the_reason(tmp_path: Path, form: Form, reason: str) -> None:
    left = recall(StateFile(written(tmp_path / "walk", b"one"), form), lambda kept: kept.payload)
    assert left.value is None
    assert reason in left.refusal


def test_more_than_there_is_room_for_is_no_state(tmp_path: Path) -> None:
    file = StateFile(tmp_path / "walk", FORM)
    with pytest.raises(OSError, match="room for 10000"):
        file.save(Kept(0, bytes(10_001)))


def write_for_ever(path: Path, ready: int) -> None:
    """In a process of its own: state after state, each of one repeated byte."""
    try:
        file = StateFile(path, FORM)
        for turn in range(10_000_000):
            file.save(Kept(turn, bytes([turn % 256]) * 9_000))
            os.write(ready, b"+")
    finally:
        os._exit(1)


@pytest.mark.filterwarnings("ignore:.*use of fork:DeprecationWarning")  # the child only writes, and is killed
def test_whoever_is_killed_while_writing_leaves_the_newest_or_the_one_before(tmp_path: Path) -> None:
    for number in range(20):
        path = tmp_path / f"walk{number}"
        heard, ready = os.pipe()
        child = os.fork()
        if child == 0:
            write_for_ever(path, ready)
        os.close(ready)
        saved = sum(len(os.read(heard, 1)) for _ in range(5 + number))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        while chunk := os.read(heard, 4096):
            saved += len(chunk)
        os.close(heard)
        kept = StateFile(path, FORM).load()
        assert kept is not None
        assert kept.time_ns in (saved - 1, saved)
        assert kept.payload == bytes([kept.time_ns % 256]) * 9_000


class Counting:
    """A core whose state is how often it was asked."""

    def __init__(self) -> None:
        self.asked = 0

    def handle(self, envelope: object) -> tuple[()]:
        return ()

    def tick(self, now_ns: int) -> tuple[()]:
        return ()

    def figures(self) -> Figures:
        return Figures(note="counting")

    def remembered(self) -> Kept:
        self.asked += 1
        return Kept(self.asked, b"")


def test_a_disk_that_refuses_is_told_until_it_takes_again(tmp_path: Path) -> None:
    folder, core = tmp_path / "state", Counting()
    folder.write_text("a file where a folder should be")
    part = RememberingPart(core, Memory(StateFile(folder / "walk", FORM), 10, core.remembered))
    for now_ns in (0, 9, 10):
        part.tick(now_ns)
    figures = part.figures()
    assert (figures.state, figures.counters["memory_unsaved"]) == ("degraded", 2)
    assert figures.note == "counting; state is not saved: File exists"
    folder.unlink()
    part.tick(20)
    assert part.figures().note == "counting"
    assert StateFile(folder / "walk", FORM).load() == Kept(3, b"")
