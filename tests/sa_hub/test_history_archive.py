"""The archive on SQLite and on a real PostgreSQL: the same suite, the same answers."""

import itertools
import tempfile
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.errors import ConfigError, RecordingError
from bootprint.messages import Alert, Health, Track
from bootprint.topics import Identity
from sa_hub.history.archive import Archive
from support.databases import new_database, postgres
from support.messages import envelopes

CP = Identity("bp", "hq", "cp")
T0 = 1_760_000_000_000_000_000
S = 1_000_000_000
_names = (f"db{number}" for number in itertools.count())


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with postgres() as folder:
        yield folder


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """A database that holds nothing yet."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path}/state/history.db"
    return new_database(request.getfixturevalue("server"), next(_names))


@pytest.fixture
def archive(url: str) -> Iterator[Archive]:
    opened = Archive(url)
    yield opened
    opened.close()


def track(soldier: str, at_s: float, latitude_deg: float = 59.0) -> Envelope:
    message = Track(
        time_ns=T0 + round(at_s * S),
        soldier=soldier,
        number=1,
        state="fresh",
        latitude_deg=latitude_deg,
        longitude_deg=18.0,
        height_m=None,
        accuracy_m=2.0,
    )
    return Envelope(CP.address("track", soldier), message)


def alert(soldier: str, at_s: float) -> Envelope:
    message = Alert(time_ns=T0 + round(at_s * S), soldier=soldier, kind="contact", text="two, north")
    return Envelope(CP.address("alert", soldier), message)


def times_s(envelopes: Iterator[Envelope]) -> list[float]:
    return [(each.message.time_ns - T0) / S for each in envelopes]


def test_what_was_stored_comes_back_as_it_was(archive: Archive) -> None:
    stored = [track("a1", 1), alert("a2", 2), track("a2", 3)]
    archive.store(stored)
    assert list(archive.messages("track", T0, T0 + 10 * S)) == [stored[0], stored[2]]
    assert list(archive.messages("alert", T0, T0 + 10 * S)) == [stored[1]]
    assert archive.soldiers() == ["a1", "a2"]
    assert archive.span_ns() == (T0 + S, T0 + 3 * S)


def test_an_empty_archive_knows_nobody(archive: Archive) -> None:
    archive.store([])
    assert archive.span_ns() is None
    assert archive.soldiers() == []
    assert archive.picture_at(T0) == []
    assert list(archive.messages("track", 0, 2**62)) == []


def test_late_reports_stand_in_their_place(archive: Archive) -> None:
    archive.store([track("a1", 1), track("a1", 9)])
    archive.store([track("a1", 5), track("a2", 4)])
    assert times_s(archive.messages("track", T0, T0 + 10 * S)) == [1, 4, 5, 9]
    assert [each.message.time_ns for each in archive.picture_at(T0 + 8 * S)] == [T0 + 5 * S, T0 + 4 * S]


def test_the_picture_is_the_newest_at_or_before(archive: Archive) -> None:
    archive.store([track("a1", at_s) for at_s in range(10)] + [track("a2", 6)])
    assert archive.picture_at(T0 - 1) == []
    assert archive.picture_at(T0 + 3 * S) == [track("a1", 3)]
    assert archive.picture_at(T0 + 6 * S - 1) == [track("a1", 5)]
    assert archive.picture_at(T0 + 60 * S) == [track("a1", 9), track("a2", 6)]


def test_a_soldier_in_two_hubs_pictures_is_shown_once_by_the_newest(archive: Archive) -> None:
    elsewhere = Envelope(Identity("bp", "alpha", "a9").address("track", "a1"), track("a1", 7, 60.0).message)
    archive.store([track("a1", 5), elsewhere])
    assert archive.picture_at(T0 + 6 * S) == [track("a1", 5)]
    assert archive.picture_at(T0 + 9 * S) == [elsewhere]


def test_the_first_of_two_with_the_same_key_and_time_stays(archive: Archive) -> None:
    archive.store([track("a1", 1, 10.0), track("a1", 1, 20.0)])
    archive.store([track("a1", 1, 30.0), track("a1", 2, 30.0)])
    assert list(archive.messages("track", T0, T0 + 5 * S)) == [track("a1", 1, 10.0), track("a1", 2, 30.0)]


def test_a_span_begins_with_its_begin_and_ends_before_its_end(archive: Archive) -> None:
    archive.store([track("a1", at_s) for at_s in range(5)])
    assert times_s(archive.messages("track", T0 + S, T0 + 3 * S)) == [1, 2]
    assert archive.count("track", T0 + S, T0 + 3 * S) == 2


def test_one_soldiers_messages_are_those_about_the_soldier(archive: Archive) -> None:
    own = Envelope(CP.address("alert", "person"), alert("a1", 3).message)
    archive.store([alert("a1", 1), alert("a2", 2), own])
    assert times_s(archive.messages("alert", T0, T0 + 9 * S, "a1")) == [1, 3]
    assert list(archive.messages("alert", T0, T0 + 9 * S, "nobody")) == []


def test_pages_join_without_a_gap_where_times_are_equal(
    archive: Archive, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sa_hub.history.archive._PAGE", 3)
    stored = [track(f"a{number}", at_s) for at_s in range(4) for number in range(5)]
    archive.store(stored)
    assert list(archive.messages("track", T0, T0 + 9 * S)) == stored
    assert times_s(archive.messages("track", T0, T0 + 9 * S, "a3")) == [0, 1, 2, 3]


def test_times_before_1970_do_not_stretch_the_span(archive: Archive) -> None:
    unset = Health(time_ns=0, service="sa-hub", state="ok")
    archive.store([Envelope(CP.address("health", "sa-hub"), unset), track("a1", 1)])
    assert archive.span_ns() == (T0 + S, T0 + S)


def test_it_is_all_there_when_opened_again(url: str) -> None:
    first = Archive(url)
    first.store([track("a1", 1)])
    first.close()
    again = Archive(url, create=False)
    again.store([track("a1", 2)])
    assert times_s(again.messages("track", T0, T0 + 9 * S)) == [1, 2]
    again.close()


def test_readers_and_the_writer_do_not_wait_for_each_other(archive: Archive) -> None:
    archive.store([track("a1", at_s) for at_s in range(10)])
    reading = archive.messages("track", T0, T0 + 9 * S)
    next(reading)
    writer = threading.Thread(target=archive.store, args=([track("a1", 100)],))
    writer.start()
    writer.join(timeout=20)
    assert not writer.is_alive()
    assert times_s(reading) == [1, 2, 3, 4, 5, 6, 7, 8]


@settings(max_examples=10, deadline=None)
@given(stored=st.lists(envelopes, max_size=8))
def test_every_kind_of_message_comes_back(stored: list[Envelope]) -> None:
    with tempfile.TemporaryDirectory() as folder, closing(Archive(f"sqlite:///{folder}/h.db")) as archive:
        archive.store(stored)
        first = {}
        for each in stored:
            about = getattr(each.message, "soldier", "")
            first.setdefault((each.address.key, about, each.message.time_ns), each)
        found = [
            each
            for subject in sorted({each.address.subject for each in stored})
            for each in archive.messages(subject, -(2**63), 2**63 - 1)
        ]
        expected = [each for each in first.values() if each.message.time_ns < 2**63 - 1]
        assert sorted(map(on_the_wire, found)) == sorted(map(on_the_wire, expected))


def on_the_wire(envelope: Envelope) -> tuple[str, bytes]:
    """What two equal envelopes share whatever the order of their messages' tables."""
    return envelope.address.key, wire.encode(envelope.message)


def test_what_cannot_be_an_archive_is_told_in_a_line(tmp_path: Path, server: str) -> None:
    for url in ("history.db", "mysql://host/name", "sqlite://", "sqlite:///:memory:"):
        with pytest.raises(ConfigError, match="must be like"):
            Archive(url)
    (tmp_path / "text.db").write_text("this is no database, but it is long enough to be taken for one" * 20)
    with pytest.raises(RecordingError, match="file is not a database"):
        Archive(f"sqlite:///{tmp_path}/text.db")
    with pytest.raises(RecordingError, match="no such history"):
        Archive(f"sqlite:///{tmp_path}/nowhere.db", create=False)
    with pytest.raises(RecordingError, match='database "nowhere" does not exist'):
        Archive(f"postgresql+psycopg://postgres@/nowhere?host={server}")
    with pytest.raises(RecordingError, match="holds no history"):
        Archive(new_database(server, "bare"), create=False)


def test_an_archive_of_a_newer_version_is_refused(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sa_hub.history.archive.VERSION", 2)
    Archive(url).close()
    monkeypatch.undo()
    with pytest.raises(RecordingError, match="is of version 2, this program knows 1"):
        Archive(url)
