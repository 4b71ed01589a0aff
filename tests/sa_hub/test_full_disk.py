"""A real disk that is full, has room again, and is read-only: what was kept stays, what can go on goes on."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from bootprint.bus import Envelope
from bootprint.errors import BootprintError, RecordingError
from bootprint.messages import Pressure, Track
from bootprint.recording import Recorder, Recording
from bootprint.saved_state import Form, Kept, StateFile
from bootprint.topics import Identity
from sa_hub.history.archive import Archive
from support.disks import Disk, small_disk

CP = Identity("bp", "hq", "cp")
FORM = Form("walk", 1, 60_000)
END = 2**62


def write_all(recorder: Recorder, envelopes: list[Envelope]) -> None:
    for envelope in envelopes:
        recorder.write(envelope)


def store_for_ever(archive: Archive, taken: list[int]) -> None:
    """Batch after batch; ``taken`` tells which were."""
    for number in range(len(taken), 10_000):
        archive.store(tracks(number))
        taken.append(number)


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Disk]:
    with small_disk(tmp_path / "disk", 1500) as mounted:
        yield mounted


def tracks(number: int) -> list[Envelope]:
    place = {
        "state": "fresh",
        "latitude_deg": 59.0,
        "longitude_deg": 18.0,
        "height_m": None,
        "accuracy_m": 1.0,
    }
    return [
        Envelope(
            CP.address("track", f"a{soldier}"),
            Track(time_ns=number + 1, soldier=f"a{soldier}", number=soldier, **place),  # type: ignore[arg-type]
        )
        for soldier in range(20)
    ]


def test_state_is_the_last_that_found_room_and_goes_on_when_there_is_room_again(disk: Disk) -> None:
    file = StateFile(disk.path / "walk", FORM)
    file.save(Kept(1, b"1" * 1000))
    filler = disk.fill()
    for time_ns in (2, 3):  # each slot's turn
        with pytest.raises(OSError, match="No space left"):
            file.save(Kept(time_ns, b"2" * 50_000))
    kept = StateFile(disk.path / "walk", FORM).load()
    assert kept == Kept(1, b"1" * 1000)
    filler.unlink()
    file.save(Kept(4, b"4" * 50_000))
    assert StateFile(disk.path / "walk", FORM).load() == Kept(4, b"4" * 50_000)


def test_a_read_only_disk_still_gives_the_state_that_is_on_it(disk: Disk) -> None:
    path = disk.path / "walk"
    file = StateFile(path, FORM)
    file.save(Kept(1, b"one"))
    file.close()
    disk.read_only(True)
    again = StateFile(path, FORM)
    assert again.load() == Kept(1, b"one")
    with pytest.raises(OSError, match="Read-only"):
        again.save(Kept(2, b"two"))
    disk.read_only(False)
    again.save(Kept(2, b"two"))
    assert StateFile(path, FORM).load() == Kept(2, b"two")


def test_a_recording_that_finds_no_room_says_so_and_what_was_flushed_is_whole(disk: Disk) -> None:
    path = disk.path / "walk.mcap"
    address = CP.address("pressure", "baro")
    recorder = Recorder(path)
    for number in range(100):
        recorder.write(Envelope(address, Pressure(time_ns=number + 1, pressure_pa=1e5)))
    recorder.flush()
    disk.fill()
    late = [Envelope(address, Pressure(time_ns=101 + n, pressure_pa=1e5 + n)) for n in range(100_000)]
    with pytest.raises(RecordingError, match="cannot be written: No space left"):
        write_all(recorder, late)
    with pytest.raises(RecordingError):
        recorder.close()
    times = [envelope.message.time_ns for _, envelope in Recording(path, salvage=True).envelopes()]
    assert times[:100] == list(range(1, 101))


def test_an_archive_loses_nothing_that_it_took_and_takes_again_when_there_is_room(disk: Disk) -> None:
    url = f"sqlite:///{disk.path}/history.db"
    taken: list[int] = []
    with closing(Archive(url)) as archive:
        archive.store(tracks(0))
        taken.append(0)
        filler = disk.fill()
        with pytest.raises(BootprintError):
            store_for_ever(archive, taken)
        filler.unlink()
        last = taken[-1] + 1
        archive.store(tracks(last))
        taken.append(last)
    with closing(Archive(url, create=False)) as archive:
        found = [each.message.time_ns - 1 for each in archive.messages("track", 0, END)]
    assert found == [number for number in taken for _ in range(20)]
