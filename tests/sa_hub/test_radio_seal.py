"""The seal: nothing forged, damaged or repeated is opened; no nonce comes twice, whatever is lost."""

import random
import tempfile
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.errors import ConfigError
from sa_hub.radio.counters import COUNTERS, Block, FileCounters, MemoryCounters, _Reserved
from sa_hub.radio.errors import FrameError
from sa_hub.radio.header import Header, read_header
from sa_hub.radio.replay import Heard
from sa_hub.radio.replay_file import LAG, MemoryFile
from sa_hub.radio.seal import NetKeys, Opener, Sealer
from support.host_clock import JAN_2026_S, HostClock

KEY = bytes(range(32))
NOW_NS = 1_790_000_000_000_000_000
S = 1_000_000_000
KEYS = NetKeys(KEY, "squad", 8)
SECONDS_2020_TO_2026 = 2192 * 86_400  # six years, two of them leap years


def sealer(number: int = 7, epoch: int = 1, keys: NetKeys = KEYS) -> Sealer:
    """A sender on the net."""
    return Sealer(keys, number, MemoryCounters(epoch))


def sealed(sender: Sealer, count: int, now_ns: int = NOW_NS) -> list[bytes]:
    """Some frames of it."""
    return [sender.seal(b"payload %d" % index, now_ns) for index in range(count)]


def cause(opener: Opener, frame: bytes) -> str:
    """Why the frame is not opened."""
    with pytest.raises(FrameError) as caught:
        opener.open(frame)
    return caught.value.cause


@pytest.mark.parametrize("tag_bytes", [8, 4])
def test_a_sealed_frame_is_opened_once_and_is_as_long_as_foretold(tag_bytes: int) -> None:
    keys = NetKeys(KEY, "squad", 8 if tag_bytes == 8 else 4)
    sender, opener = sealer(keys=keys), Opener(keys)
    for header_bytes in (8, 2, 2):
        overhead = sender.overhead_bytes(NOW_NS)
        frame = sender.seal(b"help", NOW_NS)
        assert len(frame) == overhead + 4 == header_bytes + 4 + tag_bytes
        opened = opener.open(frame)
        assert (opened.sender, opened.payload, opened.epoch) == (7, b"help", 1)
        assert cause(opener, frame) == "replayed"


def full_headers(sender: Sealer, begin_s: int, end_s: int) -> list[int]:
    """In which seconds a full header went out, of a frame a second."""
    lengths = {second: len(sealed(sender, 1, NOW_NS + second * S)[0]) for second in range(begin_s, end_s)}
    return [second for second, length in lengths.items() if length == 25]


def test_full_headers_come_ever_more_rarely_and_often_again_when_asked_for() -> None:
    sender = sealer()
    assert full_headers(sender, 0, 400) == [0, 1, 3, 7, 15, 31, 63, 127, 247, 367]
    sender.full_headers.begin()
    assert full_headers(sender, 400, 420) == [400, 401, 403, 407, 415]


def test_full_headers_are_rare_at_once_where_all_tell_what_they_hear() -> None:
    sender = sealer()
    assert full_headers(sender, 0, 5) == [0, 1, 3]
    sender.full_headers.known = True
    assert full_headers(sender, 5, 300) == [123, 243]
    sender.full_headers.known = (
        False  # somebody new was heard; eight times 1 s after 123 s, twice that after 243 s
    )
    assert full_headers(sender, 300, 400) == [300, 332, 396]


@pytest.mark.parametrize("asked_s", [10, 300])
def test_who_asks_for_full_headers_has_the_whole_row_though_all_others_tell_what_they_hear(
    asked_s: int,
) -> None:
    """One full header alone may be lost, and the asker would be deaf until he asks again."""
    sender = sealer()
    full_headers(sender, 0, 5)
    sender.full_headers.known = True
    full_headers(sender, 5, asked_s)
    sender.full_headers.asked(NOW_NS + asked_s * S)
    row = full_headers(sender, asked_s, asked_s + 300)
    assert [second - asked_s for second in row] == [0, 1, 3, 7, 15, 31, 63, 127, 247]


def test_the_row_for_who_asked_goes_on_after_the_clock_was_set_back() -> None:
    sender = sealer()
    sender.full_headers.known = True
    sender.full_headers.asked(NOW_NS + 100 * S)
    assert full_headers(sender, 100, 105) == [100, 101, 103]
    sender.set_back(100 * S)
    assert full_headers(sender, 5, 20) == [7, 15]
    sender.full_headers.asked(NOW_NS + 9 * S)  # less than 10 s after it was asked for last
    assert full_headers(sender, 20, 40) == [31]


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
    assert read_header(bytes(frame)).sender == 7
    frame[1] ^= 0x10  # sender's number: 2 bits, then 10
    assert read_header(bytes(frame)).sender == 6
    assert cause(Opener(KEYS), bytes(frame)) == "forged"


def test_a_late_listener_waits_for_a_full_header() -> None:
    sender, opener = sealer(), Opener(KEYS)
    sealed(sender, 3)
    assert cause(opener, sealed(sender, 1)[0]) == "unknown_epoch"
    sender.full_headers.begin()
    opener.open(sealed(sender, 1)[0])
    opener.open(sealed(sender, 1)[0])


@pytest.mark.parametrize("lost", [1, 7, 8, 31, 32, 100, 300, 472])
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
    for second, index in enumerate(arriving):
        opener.pass_time(NOW_NS + second * S)
        # Farther back than the window nothing is tried any more, so nothing is known of such a frame.
        causes = {"replayed"} if newest - index < 57 else {"replayed", "forged"}
        assert cause(opener, frames[index]) in causes
    assert opener.lost == newest + 1 - len(arriving)


@given(st.integers(0, 2**18 - 1), st.integers(0, 7))
def test_each_counter_around_the_newest_is_tried_once_and_few_always(highest: int, low: int) -> None:
    heard = Heard(1, highest)
    near, far = list(heard.near(low)), list(heard.far(low))
    reach = range(max(0, highest - 56), min(2**18, highest + 481))
    assert {counter for counter in reach if counter % 8 == low} <= {*near, *far}
    assert {counter for counter in range(highest - 24, highest + 33) if counter % 8 == low} & {*reach} <= {
        *near
    }
    assert len(near) <= 8
    assert len({*near, *far}) == len(near) + len(far) <= 68


def test_a_flood_of_garbage_is_cheap_and_does_not_keep_good_frames_out() -> None:
    sender, opener, tried = sealer(), CountingOpener(KEYS), []
    opener.open(sealed(sender, 1)[0])
    garbage = sealed(sealer(), 2)[1][:2] + bytes(20)
    for second in range(60):
        opener.pass_time(NOW_NS + second * S)
        before = opener.tries
        for _ in range(50):
            assert cause(opener, garbage) == "forged"
        tried.append(opener.tries - before)
        opener.open(sealed(sender, 1)[0])
    assert max(tried[-30:]) <= 50 * 8 + 64


class CountingOpener(Opener):
    """Counts how often a tag is tried."""

    tries = 0

    def _decrypt_with(self, keys: NetKeys, header: Header, number: bytes, frame: bytes) -> bytes | None:
        self.tries += 1
        return super()._decrypt_with(keys, header, number, frame)


def test_frames_of_an_earlier_epoch_are_replays() -> None:
    opener = Opener(KEYS)
    earlier, new = sealer(epoch=4), sealed(sealer(epoch=5), 5)
    old = sealed(earlier, 3) + sealed(earlier, 1, NOW_NS + S)
    opener.open(old[0])
    opener.open(new[0])
    # A short header says nothing of its epoch, so it is tried in the newest and fits nowhere.
    assert [cause(opener, frame) for frame in old] == ["replayed", "forged", "forged", "replayed"]
    opener.open(new[4])
    opener.open(new[1])


def test_what_was_heard_is_remembered_over_a_clean_restart(tmp_path: Path) -> None:
    opener, file = Opener(KEYS), MemoryFile(tmp_path / "squad.heard")
    frames = sealed(sealer(), 6)
    for frame in frames[:4]:
        opener.open(frame)
        file.keep(opener.memory)
    file.close(opener.memory)
    memory, sound = MemoryFile(file.path).load()
    restarted = Opener(KEYS, memory)
    assert sound
    assert [cause(restarted, frame) for frame in frames[:4]] == ["replayed"] * 4
    restarted.open(frames[4])


@given(
    st.lists(st.tuples(st.sampled_from([3, 7]), st.integers(1, 12)), min_size=1, max_size=40), st.booleans()
)
@settings(max_examples=40, deadline=None)
def test_after_a_power_cut_nothing_heard_is_taken_again_and_little_else_refused(
    heard: list[tuple[int, int]], clean_start: bool
) -> None:
    senders = {number: sealer(number) for number in (3, 7)}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "squad.heard"
        if clean_start:
            MemoryFile(path).close({})
        opener, file, taken = Opener(KEYS), MemoryFile(path), []
        for number, skipped in [(3, 1), (7, 1), *heard]:
            taken.append(sealed(senders[number], skipped)[-1])
            opener.open(taken[-1])
            file.keep(opener.memory)
        memory, sound = MemoryFile(path).load()  # the power is cut here: nothing but what is synced is left
    restarted = Opener(KEYS, memory)
    assert sound
    # A full header may follow any gap; of a short one far behind nothing is known.
    assert {cause(restarted, frame) for frame in taken} <= {"replayed", "forged"}
    for number in dict(heard):
        later = [sealed(senders[number], 1)[0] for _ in range(LAG + 1)]
        restarted.open(later[-1])


def test_the_memory_is_not_written_for_every_frame(tmp_path: Path) -> None:
    opener, file, written = Opener(KEYS), MemoryFile(tmp_path / "squad.heard"), set()
    for frame in sealed(sealer(), 100):
        opener.open(frame)
        file.keep(opener.memory)
        written.add(file.path.read_bytes())
    assert len(written) == 100 // (LAG + 1)


def test_memory_and_counters_are_written_under_names_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    temporary = []
    replace = Path.replace

    def noted(self: Path, target: Path) -> Path:
        temporary.append(self.name)
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", noted)
    HostClock().counters(tmp_path / "squad.counters").reserve()
    MemoryFile(tmp_path / "squad.heard").close({})
    assert len(set(temporary)) == 2


@pytest.mark.parametrize("content", [b"", b"{", b'{"x": 1}', b'{"7": {"epoch": "a", "highest": 1}}'])
def test_a_damaged_memory_is_reported_and_left_behind(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "squad.heard"
    path.write_bytes(content)
    assert MemoryFile(path).load() == ({}, False)
    assert MemoryFile(tmp_path / "none").load() == ({}, True)


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
    clock = HostClock()
    with tempfile.TemporaryDirectory() as folder:
        for reservations, spent, cut in boots:
            source = CutCounters(Path(folder) / "squad.counters", clock, 4, sleep=clock.sleep)
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
    clock = HostClock()
    one, two = (clock.counters(path) for _ in range(2))
    blocks = [source.reserve() for source in (one, two, one, one, two, two, two)]
    numbers = [number for block in blocks for number in used(block, 4)]
    assert len(numbers) == len(set(numbers)) == 28


def test_a_running_sender_goes_on_in_its_epoch(tmp_path: Path) -> None:
    clock = HostClock()
    source = clock.counters(tmp_path / "c")
    first = source.reserve()
    clock.now_s += 1000.0
    assert source.reserve() == Block(first.epoch, 4, 8)


def test_an_epoch_is_the_second_of_the_start_and_used_when_it_is_over(tmp_path: Path) -> None:
    clock = HostClock(JAN_2026_S + 0.75)
    assert clock.counters(tmp_path / "c").reserve() == Block(SECONDS_2020_TO_2026, 0, 4)
    assert clock.now_s == JAN_2026_S + 1.0


@given(st.lists(st.tuples(st.floats(0.0, 1.5), st.booleans()), min_size=1, max_size=20))
@settings(max_examples=40, deadline=None)
def test_no_counter_comes_twice_when_files_are_lost_and_the_clock_is_right(
    lives: list[tuple[float, bool]],
) -> None:
    clock, seen = HostClock(), set[tuple[int, int]]()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "c"
        for lived_s, lost in lives:
            take_new(seen, clock.counters(path).reserve(), 4)
            clock.now_s += lived_s
            if lost:
                path.unlink()
        assert max(epoch for epoch, _ in seen) <= clock.now_s - JAN_2026_S + SECONDS_2020_TO_2026


def test_restarts_do_not_take_epochs_ahead_of_the_clock(tmp_path: Path) -> None:
    path, clock = tmp_path / "c", HostClock()
    first = clock.counters(path).reserve()
    clock.now_s -= 3600.0
    assert [clock.counters(path).reserve() for _ in range(3)] == [
        Block(first.epoch, 4 * block, 4 * block + 4) for block in (1, 2, 3)
    ]


def test_lost_counters_of_a_hub_that_has_lived_are_not_made_up(tmp_path: Path) -> None:
    path, heard, clock = tmp_path / "squad.counters", tmp_path / "squad.heard", HostClock()
    clock.counters(path, earlier_life=heard).reserve()
    MemoryFile(heard).close({})
    clock.counters(path, earlier_life=heard).reserve()
    path.unlink()
    with pytest.raises(
        ConfigError, match=r"counters are lost.*squad\.heard.*restore.*new group key"
    ) as caught:
        clock.counters(path, earlier_life=heard).reserve()
    assert "\n" not in str(caught.value)
    assert not path.exists()


@pytest.mark.parametrize("now_s", [0.0, JAN_2026_S - SECONDS_2020_TO_2026 - 1.0, 2.7e9])
def test_a_first_start_with_an_unset_clock_is_refused(tmp_path: Path, now_s: float) -> None:
    with pytest.raises(ConfigError, match="clock is not between 2020 and 2054"):
        HostClock(now_s).counters(tmp_path / "c").reserve()
    clock = HostClock()
    clock.counters(tmp_path / "c").reserve()
    clock.now_s = now_s
    assert clock.counters(tmp_path / "c").reserve() == Block(SECONDS_2020_TO_2026, 4, 8)


def test_an_epoch_without_room_is_followed_by_the_next(tmp_path: Path) -> None:
    path = tmp_path / "c"
    path.write_text('{"epoch": 5, "end": 262141}')
    assert HostClock(0.0).counters(path).reserve() == Block(6, 0, 4)
    path.write_text('{"epoch": 5, "end": 262140}')
    assert HostClock(0.0).counters(path).reserve() == Block(5, 262140, 262144)


def test_counters_in_memory_end_as_those_on_disk_do() -> None:
    counters = MemoryCounters(epoch=5, block=1 << 16)
    blocks = [counters.reserve() for _ in range((COUNTERS >> 16) + 1)]
    assert blocks[-2] == Block(5, COUNTERS - (1 << 16), COUNTERS)
    assert blocks[-1] == Block(6, 0, 1 << 16)


def test_the_last_epoch_is_used_to_its_end_and_then_a_new_key_is_asked_for(tmp_path: Path) -> None:
    path, clock = tmp_path / "c", HostClock()
    path.write_text('{"epoch": 1073741823, "end": 262136}')
    assert clock.counters(path).reserve() == Block(1073741823, 262136, 262140)
    assert clock.counters(path).reserve() == Block(1073741823, 262140, 262144)
    with pytest.raises(ConfigError, match="new group key"):
        clock.counters(path).reserve()


@pytest.mark.parametrize(
    "content", ["", "{", '{"epoch": 1}', '{"epoch": "a", "end": 1}', '{"epoch": 1073741824, "end": 1}']
)
def test_damaged_counters_are_refused_in_one_line(tmp_path: Path, content: str) -> None:
    path = tmp_path / "c"
    path.write_text(content)
    with pytest.raises(ConfigError, match="damaged radio counters") as caught:
        HostClock().counters(path).reserve()
    assert "\n" not in str(caught.value)


def test_counters_that_cannot_be_kept_are_refused(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file where a folder is wanted")
    with pytest.raises(ConfigError, match="cannot be kept"):
        HostClock().counters(tmp_path / "state" / "c").reserve()


def test_a_new_block_of_a_new_epoch_starts_with_full_headers(tmp_path: Path) -> None:
    path, clock = tmp_path / "c", HostClock()
    mine = clock.counters(path)
    sender, opener = Sealer(KEYS, 7, mine), Opener(KEYS)
    frames = sealed(sender, 4)
    clock.now_s += 1.0
    clock.counters(path).reserve()  # another process takes an epoch
    clock.now_s += 1.0
    assert sender.overhead_bytes(NOW_NS) == 16
    for frame in (*frames, *sealed(sender, 6)):
        opener.open(frame)
