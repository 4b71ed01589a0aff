"""Damaged recordings: never a crash, never a wrong message, and every intact one is saved."""

import random
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from bootprint import mcap_survey
from bootprint.bus import Envelope
from bootprint.errors import RecordingError
from bootprint.messages import Pressure
from bootprint.recording import Recorder, Recording
from bootprint.topics import Identity

A3 = Identity("bp", "alpha", "a3")
PER_CHUNK, CHUNKS = 10, 6
SENT = [
    Envelope(
        A3.address("pressure", "body" if sequence % 3 else "left_foot"),
        Pressure(time_ns=1000 + sequence, sequence=sequence, pressure_pa=1e5 + sequence),
    )
    for sequence in range(PER_CHUNK * CHUNKS)
]
damages = settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A finished recording of six chunks of ten messages."""
    path = tmp_path_factory.mktemp("whole") / "whole.mcap"
    with Recorder(path) as recorder:
        for number, envelope in enumerate(SENT):
            if number % PER_CHUNK == 0:
                recorder.flush()
            recorder.write(envelope)
    return path.read_bytes()


@pytest.fixture(scope="module")
def chunks(whole: bytes, tmp_path_factory: pytest.TempPathFactory) -> list[tuple[int, int]]:
    """Where the chunks stand, by the library's own reader of the summary."""
    path = tmp_path_factory.mktemp("chunks") / "whole.mcap"
    path.write_bytes(whole)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    return [(c.chunk_start_offset, c.chunk_start_offset + c.chunk_length) for c in summary.chunk_indexes]


def salvaged(path: Path, data: bytes) -> tuple[list[int], Recording]:
    path.write_bytes(data)
    recording = Recording(path, salvage=True)
    read = [envelope for _, envelope in recording.envelopes()]
    assert all(SENT[envelope.message.sequence] == envelope for envelope in read)
    return [envelope.message.sequence for envelope in read], recording


def test_the_fixture_is_what_it_says(chunks: list[tuple[int, int]], whole: bytes, tmp_path: Path) -> None:
    assert len(chunks) == CHUNKS
    read, recording = salvaged(tmp_path / "a.mcap", whole)
    assert read == list(range(len(SENT)))
    assert (recording.report.faults, recording.report.truncated_at) == ((), None)


def test_cut_anywhere_it_keeps_every_whole_chunk(
    whole: bytes, chunks: list[tuple[int, int]], tmp_path: Path
) -> None:
    edges = {end + step for _, end in chunks for step in (-1, 0, 1)}
    for cut in sorted(edges | set(range(0, len(whole), 37)) | {7, 8, len(whole) - 1}):
        (tmp_path / "a.mcap").write_bytes(whole[:cut])
        recording = Recording(tmp_path / "a.mcap")
        complete = sum(end <= cut for _, end in chunks)
        read = [envelope.message.sequence for _, envelope in recording.envelopes()]
        assert read == list(range(complete * PER_CHUNK)), cut
        truncated_at = recording.report.truncated_at
        assert truncated_at is not None
        assert truncated_at <= cut
        assert f"ends at byte {truncated_at}" in recording.report.sentence()


@damages
@given(data=st.data())
def test_a_flipped_bit_costs_a_chunk_at_most_and_is_never_passed_over(
    whole: bytes, chunks: list[tuple[int, int]], tmp_path: Path, data: st.DataObject
) -> None:
    at = data.draw(st.integers(0, len(whole) - 1))
    flipped = bytearray(whole)
    flipped[at] ^= 1 << data.draw(st.integers(0, 7))
    read, recording = salvaged(tmp_path / "a.mcap", bytes(flipped))
    hit = [PER_CHUNK * n + i for n, (a, b) in enumerate(chunks) if a <= at < b for i in range(PER_CHUNK)]
    assert set(range(len(SENT))) - set(read) <= set(hit)
    if recording.report.faults:
        with pytest.raises(RecordingError, match="messages are intact"):
            Recording(tmp_path / "a.mcap")
    else:
        assert read == list(range(len(SENT)))


@damages
@given(data=st.data())
def test_noise_in_the_middle_costs_only_what_it_covers(
    whole: bytes, chunks: list[tuple[int, int]], tmp_path: Path, data: st.DataObject
) -> None:
    start = data.draw(st.integers(8, len(whole) - 1))
    end = min(len(whole), start + data.draw(st.integers(1, 700)))
    noise = random.Random(data.draw(st.integers(0, 2**32))).randbytes(end - start)
    read, recording = salvaged_or_nothing(tmp_path / "a.mcap", whole[:start] + noise + whole[end:])
    # A chunk also needs the definition of its channels, of which the file holds three copies.
    untouched = [n for n, (a, b) in enumerate(chunks) if end <= a or b <= start]
    wanted = {PER_CHUNK * n + i for n in untouched for i in range(PER_CHUNK)}
    assert wanted <= set(read)
    if recording is not None and not recording.report.faults and recording.report.truncated_at is None:
        assert read == list(range(len(SENT)))  # only an index was hit, which nobody needs


def salvaged_or_nothing(path: Path, data: bytes) -> tuple[list[int], Recording | None]:
    try:
        return salvaged(path, data)
    except RecordingError:
        return [], None


@pytest.mark.parametrize("size", [1, 9, 500])
def test_noise_between_chunks_costs_nothing(
    whole: bytes, chunks: list[tuple[int, int]], tmp_path: Path, size: int
) -> None:
    at = chunks[3][0]
    noise = random.Random(size).randbytes(size)
    read, recording = salvaged(tmp_path / "a.mcap", whole[:at] + noise + whole[at:])
    assert read == list(range(len(SENT)))
    assert recording.report.faults
    with pytest.raises(
        RecordingError, match=rf"{size} bytes are no record at byte {at}; 60 messages are intact"
    ):
        Recording(tmp_path / "a.mcap")


def test_a_damaged_chunk_is_told_with_place_and_loss(
    whole: bytes, chunks: list[tuple[int, int]], tmp_path: Path
) -> None:
    start, end = chunks[2]
    damaged = whole[: end - 20] + bytes([whole[end - 20] ^ 0xFF]) + whole[end - 19 :]
    read, recording = salvaged(tmp_path / "a.mcap", damaged)
    assert read == [*range(20), *range(30, 60)]
    assert recording.report.lost == PER_CHUNK
    [fault] = recording.report.faults
    assert (fault.offset, fault.what[:13]) == (start, "damaged chunk")
    with pytest.raises(
        RecordingError, match=rf"at byte {start}; 50 messages are intact, 10 are lost; salvage"
    ):
        Recording(tmp_path / "a.mcap")


def test_without_the_chunk_that_defines_them_channels_are_known_from_elsewhere(
    whole: bytes, chunks: list[tuple[int, int]], tmp_path: Path
) -> None:
    """From the summary in a finished file, from our own directory record in one that was cut off."""
    a, b = chunks[0]
    damaged = whole[: b - 20] + bytes(10) + whole[b - 10 :]
    for data in (damaged, damaged[: chunks[-1][1]]):
        assert salvaged(tmp_path / "a.mcap", data)[0] == list(range(10, 60))
    directory = whole.find(mcap_survey.DIRECTORY.encode())
    assert 0 < directory < a
    blotted = damaged[: directory - 13] + bytes(a - directory + 13) + damaged[a : chunks[-1][1]]
    (tmp_path / "a.mcap").write_bytes(blotted)
    report = Recording(tmp_path / "a.mcap", salvage=True).report
    assert report.messages == 0
    assert {fault.what for fault in report.faults} >= {
        "34 messages of channel 2, which is defined nowhere",
        "16 messages of channel 1, which is defined nowhere",
    }


def test_a_file_without_its_first_bytes_is_refused_but_can_be_salvaged(whole: bytes, tmp_path: Path) -> None:
    read, _ = salvaged(tmp_path / "a.mcap", bytes(8) + whole[8:])
    assert read == list(range(len(SENT)))
    with pytest.raises(RecordingError, match="does not begin as an MCAP file does at byte 0; 60 messages"):
        Recording(tmp_path / "a.mcap")


def test_salvage_makes_a_whole_recording_again(
    whole: bytes, chunks: list[tuple[int, int]], tmp_path: Path
) -> None:
    at = chunks[1][1] - 30
    damaged = whole[:at] + bytes(20) + whole[at + 20 : -100]
    read, recording = salvaged(tmp_path / "a.mcap", damaged)
    with Recorder(tmp_path / "b.mcap") as mended:
        recording.copy_to(mended)
    again = Recording(tmp_path / "b.mcap")
    assert [e.message.sequence for _, e in again.envelopes()] == read == [*range(10), *range(20, 60)]


@pytest.mark.parametrize("content", [b"time_s,ax,ay,az\n0,0,0,9.81\n" * 50, bytes(4096), b"\x06" * 300])
def test_what_is_no_recording_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.mcap").write_bytes(content)
    for salvage in (False, True):
        with pytest.raises(RecordingError, match=r"a\.mcap: no intact MCAP recording \(does not begin"):
            Recording(tmp_path / "a.mcap", salvage=salvage)


def test_a_missing_recording_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"none\.mcap: no such recording"):
        Recording(tmp_path / "none.mcap")
    with pytest.raises(RecordingError, match="cannot be read"):
        Recording(tmp_path)


@settings(max_examples=300, deadline=None)
@given(data=st.binary(max_size=400))
def test_no_bytes_crash_the_survey(data: bytes) -> None:
    for candidate in (data, mcap_survey.MAGIC + data, mcap_survey.MAGIC + data + mcap_survey.MAGIC):
        assert mcap_survey.survey(candidate).found == 0
