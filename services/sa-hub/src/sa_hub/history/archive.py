"""The archive: every message that the command post keeps, by time, soldier and subject, in SQLite or PostgreSQL.

A message stands at its own time, whenever it came, so reports that were late or filled in afterwards are in their
place. All methods may be called from any thread. The page and the exports read through this class alone.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from sqlalchemy import Connection, Select, create_engine, exc, func, insert, select, tuple_
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.engine import URL, make_url

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.errors import ConfigError, RecordingError, WireError
from bootprint.topics import parse_key
from sa_hub.history.schema import ADDRESS, ARCHIVE, MESSAGE, METADATA, VERSION, keep_all

_DRIVERS: Final = ("sqlite", "postgresql+psycopg")
_PAGE: Final = 2000
_BUSY_S: Final = 30.0
_TRACK: Final = "track"


class Archive:
    """Messages on a disk or a server; two with the same key and time are the same, and the first one stays.

    ``url``: ``sqlite:////folder/history.db`` or ``postgresql+psycopg://user@host/name``; tables are made where
    there are none, unless ``create`` is false. Raises ConfigError for an address that cannot be one, and
    RecordingError, as all methods do, for a database that is missing, damaged, out of reach or of a newer version.
    """

    def __init__(self, url: str, *, create: bool = True) -> None:
        address = _checked(url)
        self.name = address.render_as_string(hide_password=True)
        self.unreadable = 0
        """Stored messages that could not be read back: of another version, or damaged."""
        self._ids: dict[tuple[str, str], int] = {}
        is_file = address.get_backend_name() == "sqlite"
        self._insert = sqlite.insert if is_file else postgresql.insert
        if is_file:
            _check_file(Path(address.database or ""), create)
        self._engine = create_engine(address, connect_args={"timeout": _BUSY_S} if is_file else {})
        if is_file:
            keep_all(self._engine)
        try:
            self._open(create)
        except RecordingError:
            self.close()
            raise

    def _open(self, create: bool) -> None:
        with self._told(), self._engine.begin() as connection:
            if create:
                METADATA.create_all(connection)
            elif not self._engine.dialect.has_table(connection, ARCHIVE.name):
                raise RecordingError(f"{self.name}: holds no history of a hub")
            version = connection.scalar(select(ARCHIVE.c.version))
            if version is None:
                connection.execute(insert(ARCHIVE).values(version=VERSION))
            elif version > VERSION:
                raise RecordingError(f"{self.name}: is of version {version}, this program knows {VERSION}")

    @contextmanager
    def _told(self) -> Iterator[None]:
        """What goes wrong in the database, in one line."""
        try:
            yield
        except exc.SQLAlchemyError as error:
            cause = str(getattr(error, "orig", None) or error).strip().splitlines()[0]
            raise RecordingError(f"{self.name}: {cause}") from error

    def store(self, envelopes: Sequence[Envelope]) -> None:
        """Keep these messages in one transaction; they are on the disk when this returns.

        One with the key and time of an earlier one is passed over.
        """
        if not envelopes:
            return
        with self._told(), self._engine.begin() as connection:
            ids = self._address_ids(connection, envelopes)
            rows = [
                {
                    "subject": each.address.subject,
                    "time_ns": each.message.time_ns,
                    "address": ids[_about(each)],
                    "payload": wire.encode(each.message),
                }
                for each in envelopes
            ]
            connection.execute(self._insert(MESSAGE).on_conflict_do_nothing(), rows)
        self._ids = ids  # only what has been committed is known for good

    def _address_ids(
        self, connection: Connection, envelopes: Sequence[Envelope]
    ) -> dict[tuple[str, str], int]:
        """The numbers of all (key, soldier) known so far and in these envelopes; new ones are given numbers."""
        ids = dict(self._ids)
        new = {_about(each): each.address.subject for each in envelopes if _about(each) not in ids}
        if not new:
            return ids
        rows = [
            {"key": key, "soldier": soldier, "subject": subject} for (key, soldier), subject in new.items()
        ]
        connection.execute(self._insert(ADDRESS).on_conflict_do_nothing(), rows)
        keys = sorted({key for key, _ in new})
        for row in connection.execute(select(ADDRESS).where(ADDRESS.c.key.in_(keys))):
            ids[row.key, row.soldier] = row.id
        return ids

    def span_ns(self) -> tuple[int, int] | None:
        """The first and the last time (UTC ns) of any message, None without any; times before 1970 are no times."""
        of_address = select(MESSAGE.c.time_ns).where(MESSAGE.c.address == ADDRESS.c.id, MESSAGE.c.time_ns > 0)
        first = of_address.order_by(MESSAGE.c.time_ns).limit(1).scalar_subquery()
        last = of_address.order_by(MESSAGE.c.time_ns.desc()).limit(1).scalar_subquery()
        ends = select(first.label("first"), last.label("last")).select_from(ADDRESS).subquery()
        ((first_ns, last_ns),) = self._rows(select(func.min(ends.c.first), func.max(ends.c.last)))
        return None if first_ns is None else (first_ns, last_ns)

    def soldiers(self) -> list[str]:
        """Ids of all soldiers of whom there are tracks, sorted."""
        tracked = select(ADDRESS.c.soldier).where(ADDRESS.c.subject == _TRACK).distinct()
        return sorted(soldier for (soldier,) in self._rows(tracked))

    def picture_at(self, time_ns: int) -> list[Envelope]:
        """The newest track of every soldier at or before a time (UTC ns), as it was published, by soldier.

        Its ``state`` is that of its publication: `bootprint.display.shown` tells what it had become by ``time_ns``.
        """
        newest = (
            select(func.max(MESSAGE.c.time_ns))
            .where(MESSAGE.c.address == ADDRESS.c.id, MESSAGE.c.time_ns <= time_ns)
            .correlate(ADDRESS)
            .scalar_subquery()
        )
        tracks = _joined().where(ADDRESS.c.subject == _TRACK, MESSAGE.c.time_ns == newest)
        by_soldier = {
            row.soldier: row for row in sorted(self._rows(tracks), key=lambda row: (row.time_ns, row.key))
        }
        return list(self._decoded(by_soldier[soldier] for soldier in sorted(by_soldier)))

    def messages(
        self, subject: str, begin_ns: int, end_ns: int, soldier: str | None = None
    ) -> Iterator[Envelope]:
        """The messages of a subject with ``begin_ns <= time_ns < end_ns``, in order of time (then of address).

        With ``soldier`` only what is about that soldier. Read in pages: whoever stops early holds up nobody.
        """
        place = tuple_(MESSAGE.c.time_ns, MESSAGE.c.address)
        if soldier is None:
            wanted = MESSAGE.c.subject == subject
        else:
            # Addresses imply the subject; naming it, too, would make SQLite search by it, through everybody.
            wanted = MESSAGE.c.address.in_(self._addresses(subject, soldier))
        query = _joined().where(wanted, MESSAGE.c.time_ns < end_ns)
        query = query.order_by(MESSAGE.c.time_ns, MESSAGE.c.address).limit(_PAGE)
        page = self._rows(query.where(MESSAGE.c.time_ns >= begin_ns))
        while page:
            yield from self._decoded(page)
            if len(page) < _PAGE:
                return
            last = page[-1]
            page = self._rows(
                query.where(MESSAGE.c.time_ns >= last.time_ns, place > (last.time_ns, last.address))
            )

    def count(self, subject: str, begin_ns: int, end_ns: int) -> int:
        """How many messages `messages` would give, for everybody."""
        within = (MESSAGE.c.subject == subject, MESSAGE.c.time_ns >= begin_ns, MESSAGE.c.time_ns < end_ns)
        ((count,),) = self._rows(select(func.count()).select_from(MESSAGE).where(*within))
        return int(count)

    def _addresses(self, subject: str, soldier: str) -> list[int]:
        wanted = select(ADDRESS.c.id).where(ADDRESS.c.subject == subject, ADDRESS.c.soldier == soldier)
        return [number for (number,) in self._rows(wanted)]

    def _rows(self, query: Select[Any]) -> list[Any]:
        with self._told(), self._engine.connect() as connection:
            return list(connection.execute(query))

    def _decoded(self, rows: Any) -> Iterator[Envelope]:
        for row in rows:
            try:
                address = parse_key(row.key)
                envelope = Envelope(address, wire.decode(address.subject, row.payload))
            except WireError:
                self.unreadable += 1
                continue
            yield envelope

    def close(self) -> None:
        """Let go of the database; safe to call twice."""
        self._engine.dispose()


def _joined() -> Select[Any]:
    """Messages with their keys and soldiers."""
    return select(MESSAGE, ADDRESS.c.key, ADDRESS.c.soldier).join(ADDRESS, ADDRESS.c.id == MESSAGE.c.address)


def _about(envelope: Envelope) -> tuple[str, str]:
    """A message's key, and whom it is about: whom it names, else whose bus it was on."""
    soldier: str = getattr(envelope.message, "soldier", envelope.address.soldier)
    return envelope.address.key, soldier.replace("\0", "")  # PostgreSQL's text has no such character


def _checked(url: str) -> URL:
    try:
        address = make_url(url)
    except exc.ArgumentError:
        address = None
    if address is None or address.drivername not in _DRIVERS or address.database in (None, "", ":memory:"):
        raise ConfigError(
            f"history url {url!r} must be like sqlite:////var/lib/bootprint/history.db "
            "or postgresql+psycopg://user@host/name"
        )
    return address


def _check_file(path: Path, create: bool) -> None:
    """The file's folder is there, and without ``create`` the file, too."""
    if not create and not path.is_file():
        raise RecordingError(f"{path}: no such history")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be made: {error.strerror}") from error
