"""kill -9 in the middle of writing, fifty times: what was acknowledged is there, and the archive opens again."""

import os
import signal
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from bootprint.bus import Envelope
from bootprint.messages import Track
from bootprint.topics import Identity
from sa_hub.history.archive import Archive
from support.databases import new_database, postgres

CP = Identity("bp", "hq", "cp")
T0 = 1_760_000_000_000_000_000
KILLS = 50
SOLDIERS = 20
END = 2**62


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path}/history.db"
        return
    with postgres() as folder:
        yield new_database(folder, "killed")


def batch(number: int) -> list[Envelope]:
    """Everyone's track of one moment."""
    return [
        Envelope(
            CP.address("track", f"a{soldier}"),
            Track(
                time_ns=T0 + number,
                soldier=f"a{soldier}",
                number=soldier,
                state="fresh",
                latitude_deg=59.0,
                longitude_deg=18.0,
                height_m=None,
                accuracy_m=1.0,
            ),
        )
        for soldier in range(SOLDIERS)
    ]


def write_until_killed(url: str, first: int, acknowledge: int) -> None:
    """In a process of its own: store batch after batch, and say so of each when it is stored."""
    try:
        archive = Archive(url)
        for number in range(first, first + 10_000):
            archive.store(batch(number))
            os.write(acknowledge, b"+")
    finally:
        os._exit(1)


def killed_writer(url: str, first: int, after: int) -> int:
    """How many batches a writer had acknowledged when it was killed, right after that many were seen."""
    heard, acknowledge = os.pipe()
    child = os.fork()
    if child == 0:
        write_until_killed(url, first, acknowledge)
    os.close(acknowledge)
    acknowledged = 0
    while acknowledged < after:
        acknowledged += len(os.read(heard, 1))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    while os.read(heard, 1):
        acknowledged += 1
    os.close(heard)
    return acknowledged


@pytest.mark.filterwarnings("ignore:.*use of fork:DeprecationWarning")  # the child only writes, and is killed
def test_nothing_that_was_acknowledged_is_lost(url: str) -> None:
    Archive(url).close()
    first = 0
    for kill in range(KILLS):
        acknowledged = killed_writer(url, first, after=1 + kill % 3)
        with closing(Archive(url, create=False)) as archive:
            found = [each.message.time_ns - T0 for each in archive.messages("track", T0 + first, END)]
            assert len(archive.picture_at(END)) == SOLDIERS
        batches = len(found) // SOLDIERS
        assert acknowledged <= batches <= acknowledged + 1, "one more may be stored and not yet acknowledged"
        assert found == [first + n for n in range(batches) for _ in range(SOLDIERS)], "batches are whole"
        first += batches
