"""The seal: nothing forged, damaged or repeated is opened; no nonce comes twice, whatever is lost."""

import random
import tempfile
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.errors import ConfigError
from sa_hub.radio.counters import Block, FileCounters, MemoryCounters, _Reserved
from sa_hub.radio.errors import FrameError
from sa_hub.radio.layout import Kind
from sa_hub.radio.replay_file import load_memory, save_memory
from sa_hub.radio.seal import NetKeys, Opener, Sealer, read_header

KEY = bytes(range(32))
NOW_NS = 1_790_000_000_000_000_000
MINUTE_NS = 60_000_000_000
KEYS = NetKeys(KEY, "squad", 8)
JAN_2026_S = 1_767_225_600.0


def sealer(number: int = 7, epoch: int = 1, keys: NetKeys = KEYS) -> Sealer:
    """A sender on the net."""
    return Sealer(keys, number, MemoryCounters(epoch))


def sealed(sender: Sealer, count: int, now_ns: int = NOW_NS) -> list[bytes]:
    """Some frames of it."""
    return [sender.seal(Kind.SELF, b"payload %d" % index, now_ns) for index in range(count)]


def cause(opener: Opener, frame: bytes) -> str:
    """Why the frame is not opened."""
    with pytest.raises(FrameError) as caught:
        opener.open(frame)
    return caught.value.cause


@pytest.mark.parametrize("tag_bytes", [8, 4])
def test_a_sealed_frame_is_opened_once_and_is_as_long_as_foretold(tag_bytes: int) -> None:
    keys = NetKeys(KEY, "squad", 8 if tag_bytes == 8 else 4)
    sender, opener = sealer(keys=keys), Opener(keys)
    for header_bytes in (8, 8, 8, 3, 3):
        overhead = sender.overhead_bytes(NOW_NS)
        frame = sender.seal(Kind.ALERT, b"help", NOW_NS)
        assert len(frame) == overhead + 4 == header_bytes + 4 + tag_bytes
        opened = opener.open(frame)
        assert (opened.kind, opened.sender, opened.payload) == (Kind.ALERT, 7, b"help")
        assert cause(opener, frame) == "replayed"


def test_a_full_header_comes_once_a_minute() -> None:
    sender = sealer()
    sealed(sender, 3)
    lengths = [len(sealed(sender, 1, NOW_NS + step * MINUTE_NS // 2)[0]) for step in range(5)]
    assert lengths == [20, 20, 25, 20, 25]


@settings(deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 255))
def test_any_damage_is_refused_and_does_no_harm(place: int, flip: int) -> None:
    sender, opener = sealer(), Opener(KEYS)
    *first, frame = sealed(sender, 5)
    for each in first:
        opener.open(each)
    damaged = bytearray(frame)
    damaged[place % len(frame)] ^= flip
    with pytest.raises(FrameError):
        opener.open(bytes(damaged))
    assert opener.open(frame).payload == b"payload 4"


def test_every_single_bit_flip_of_full_and_short_headers_is_refused() -> None:
    sender, opener = sealer(), Opener(KEYS)
    frames = sealed(sender, 4)
    opener.open(frames[0])
    for frame in frames[2:]:
        for bit in range(8 * len(frame)):
            flipped = bytearray(frame)
            flipped[bit // 8] ^= 0x80 >> bit % 8
            with pytest.raises(FrameError):
                opener.open(bytes(flipped))
        opener.open(frame)


@settings(deadline=None)
@given(st.binary(max_size=60))
def test_any_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(FrameError):
        Opener(KEYS).open(data)


@pytest.mark.parametrize(
    "keys",
    [NetKeys(bytes(32), "squad", 8), NetKeys(KEY, "company", 8), NetKeys(KEY, "squad", 4)],
    ids=["another key", "another net", "another tag length"],
)
def test_frames_of_another_key_net_or_tag_are_forged_here(keys: NetKeys) -> None:
    assert cause(Opener(KEYS), sealed(sealer(keys=keys), 1)[0]) == "forged"


def test_a_sender_cannot_speak_for_another() -> None:
    frame = bytearray(sealed(sealer(number=7), 1)[0])
    header, _ = read_header(bytes(frame))
    assert header.sender == 7
    frame[1] ^= 0x08  # sender's number: 2 + 3 bits, then 10
    assert read_header(bytes(frame))[0].sender != 7
    assert cause(Opener(KEYS), bytes(frame)) == "forged"


def test_a_late_listener_waits_for_a_full_header() -> None:
    sender, opener = sealer(), Opener(KEYS)
    sealed(sender, 3)
    assert cause(opener, sealed(sender, 1)[0]) == "unknown_epoch"
    opener.open(sealed(sender, 1, NOW_NS + MINUTE_NS)[0])
    opener.open(sealed(sender, 1, NOW_NS + MINUTE_NS)[0])


@pytest.mark.parametrize("lost", [1, 100, 191, 192, 255, 256, 700, 900])
def test_a_sender_is_heard_again_after_many_lost_frames(lost: int) -> None:
    sender, opener = sealer(), Opener(KEYS)
    opener.open(sealed(sender, 4)[0])
    sealed(sender, lost)
    opener.open(sealed(sender, 1)[0])
    assert opener.lost == lost + 3


@given(st.integers(0, 2**32), st.floats(0.0, 0.6), st.integers(1, 40))
@settings(max_examples=25, deadline=None)
def test_under_loss_and_reordering_each_frame_is_opened_exactly_once(
    seed: int, loss: float, reach: int
) -> None:
    rng, sender, opener = random.Random(seed), sealer(), Opener(KEYS)
    first, *frames = sealed(sender, 300)
    opener.open(first)
    kept = [(index + rng.uniform(0, reach), index) for index in range(len(frames)) if rng.random() >= loss]
    arriving = [index for _, index in sorted(kept)]
    opened = Counter(opener.open(frames[index]).payload for index in arriving)
    assert opened == Counter(b"payload %d" % (index + 1) for index in arriving)
    newest = max(arriving, default=-1)
    for index in arriving:
        # A short header too far behind the newest is taken for one ahead, and does not fit that counter either.
        causes = {"replayed"} if newest - index < 64 else {"replayed", "forged"}
        assert cause(opener, frames[index]) in causes
    assert opener.lost == newest + 1 - len(arriving)


def test_frames_of_an_earlier_epoch_are_replays() -> None:
    opener = Opener(KEYS)
    old, new = sealed(sealer(epoch=4), 5), sealed(sealer(epoch=5), 5)
    opener.open(old[0])
    opener.open(new[0])
    assert cause(opener, old[1]) == "replayed"
    opener.open(new[4])
    opener.open(new[1])


def test_what_was_heard_is_remembered_over_a_restart(tmp_path: Path) -> None:
    opener, path = Opener(KEYS), tmp_path / "squad.heard"
    frames = sealed(sealer(), 6)
    for frame in frames[:4]:
        opener.open(frame)
    save_memory(path, opener.memory)
    memory, sound = load_memory(path)
    restarted = Opener(KEYS, memory)
    assert sound
    assert [cause(restarted, frame) for frame in frames[:4]] == ["replayed"] * 4
    restarted.open(frames[4])


@pytest.mark.parametrize("content", [b"", b"{", b'{"x": 1}', b'{"7": {"epoch": "a", "highest": 1}}'])
def test_a_damaged_memory_is_reported_and_left_behind(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "squad.heard"
    path.write_bytes(content)
    assert load_memory(path) == ({}, False)
    assert load_memory(tmp_path / "none") == ({}, True)


# -- counters -------------------------------------------------------------------------------------------------


class PowerCutError(Exception):
    """The computer is off."""


def used(block: Block, count: int) -> set[tuple[int, int]]:
    """The first numbers of a block."""
    return {(block.epoch, counter) for counter in range(block.first, min(block.end, block.first + count))}


@given(
    st.lists(
        st.tuples(st.integers(1, 4), st.integers(0, 4), st.sampled_from(["", "before", "after"])), max_size=6
    )
)
@settings(max_examples=20, deadline=None)
def test_no_counter_comes_twice_over_restarts_and_power_cuts(boots: list[tuple[int, int, str]]) -> None:
    seen: set[tuple[int, int]] = set()
    with tempfile.TemporaryDirectory() as folder:
        for reservations, spent, cut in boots:
            source = CutCounters(Path(folder) / "squad.counters", lambda: JAN_2026_S, block=4)
            for _ in range(reservations):
                take_new(seen, source.reserve(), 4)
            take_new(seen, source.reserve(), spent)
            source.cut = cut
            if cut:
                with pytest.raises(PowerCutError):
                    source.reserve()


class CutCounters(FileCounters):
    """A disk that loses power just before, or just after, the file is replaced."""

    cut = ""

    def _write(self, reserved: _Reserved) -> None:
        if self.cut != "before":
            super()._write(reserved)
        if self.cut:
            raise PowerCutError


def take_new(seen: set[tuple[int, int]], block: Block, count: int) -> None:
    """Use the first numbers of a block, none of which may have been used."""
    numbers = used(block, count)
    assert not numbers & seen
    seen |= numbers


def test_two_processes_on_one_file_never_share_a_counter(tmp_path: Path) -> None:
    path = tmp_path / "squad.counters"
    one, two = (FileCounters(path, lambda: JAN_2026_S, block=4) for _ in range(2))
    blocks = [source.reserve() for source in (one, two, one, one, two, two, two)]
    numbers = [number for block in blocks for number in used(block, 4)]
    assert len(numbers) == len(set(numbers)) == 28


def test_a_running_sender_goes_on_in_its_epoch(tmp_path: Path) -> None:
    source = FileCounters(tmp_path / "c", lambda: JAN_2026_S, block=4)
    first, second = source.reserve(), source.reserve()
    assert second == Block(first.epoch, 4, 8)


def test_a_lost_file_is_made_good_by_the_clock(tmp_path: Path) -> None:
    path, later_s = tmp_path / "c", JAN_2026_S + 61
    before = FileCounters(path, lambda: JAN_2026_S).reserve()
    path.unlink()
    assert FileCounters(path, lambda: later_s).reserve().epoch > before.epoch


def test_a_clock_set_back_does_not_take_the_epoch_back(tmp_path: Path) -> None:
    path = tmp_path / "c"
    clocks_s = iter((JAN_2026_S, 0.0, 4e9, 1e6))
    epochs = [FileCounters(path, clocks_s.__next__).reserve().epoch for _ in range(4)]
    assert epochs == sorted(set(epochs))


def test_the_last_epoch_is_used_to_its_end_and_then_a_new_key_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "c"
    path.write_text('{"epoch": 16777215, "end": 16777208}')
    assert FileCounters(path, lambda: JAN_2026_S, block=4).reserve() == Block(16777215, 16777208, 16777212)
    assert FileCounters(path, lambda: JAN_2026_S, block=4).reserve() == Block(16777215, 16777212, 16777216)
    with pytest.raises(ConfigError, match="new group key"):
        FileCounters(path, lambda: JAN_2026_S, block=4).reserve()


@pytest.mark.parametrize("content", ["", "{", '{"epoch": 1}', '{"epoch": "a", "end": 1}'])
def test_damaged_counters_are_refused_in_one_line(tmp_path: Path, content: str) -> None:
    path = tmp_path / "c"
    path.write_text(content)
    with pytest.raises(ConfigError, match="damaged radio counters") as caught:
        FileCounters(path, lambda: JAN_2026_S).reserve()
    assert "\n" not in str(caught.value)


def test_counters_that_cannot_be_kept_are_refused(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file where a folder is wanted")
    with pytest.raises(ConfigError, match="cannot be kept"):
        FileCounters(tmp_path / "state" / "c", lambda: JAN_2026_S).reserve()


def test_a_new_block_of_a_new_epoch_starts_with_full_headers(tmp_path: Path) -> None:
    path = tmp_path / "c"
    mine = FileCounters(path, lambda: JAN_2026_S, block=4)
    sender, opener = Sealer(KEYS, 7, mine), Opener(KEYS)
    frames = sealed(sender, 4)
    FileCounters(path, lambda: JAN_2026_S, block=4).reserve()  # another process takes an epoch
    assert sender.overhead_bytes(NOW_NS) == 16
    for frame in (*frames, *sealed(sender, 6)):
        opener.open(frame)
