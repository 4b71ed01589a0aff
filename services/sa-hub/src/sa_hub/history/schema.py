"""The archive's tables, their version, and how SQLite is told to lose nothing.

``address`` holds each bus key once, with the soldier that its messages are about. ``message`` holds the messages as
they were on the wire, clustered by (subject, time) for reading a span of everybody, and indexed by (address, time)
for one soldier and for the newest at a time.
"""

from typing import Any, Final

from sqlalchemy import (
    BigInteger,
    Column,
    Engine,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    Table,
    Text,
    UniqueConstraint,
    event,
)

VERSION: Final = 1
"""Of these tables; an archive of a newer one is refused."""
METADATA: Final = MetaData()
ARCHIVE: Final = Table("archive", METADATA, Column("version", Integer, primary_key=True))
ADDRESS: Final = Table(
    "address",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("key", Text, nullable=False),
    Column("soldier", Text, nullable=False),
    Column("subject", Text, nullable=False),
    UniqueConstraint("key", "soldier"),
)
MESSAGE: Final = Table(
    "message",
    METADATA,
    Column("subject", Text, primary_key=True),
    Column("time_ns", BigInteger, primary_key=True),
    Column("address", Integer, ForeignKey("address.id"), primary_key=True),
    Column("payload", LargeBinary, nullable=False),
    Index("message_by_address", "address", "time_ns"),
    sqlite_with_rowid=False,
)


def keep_all(engine: Engine) -> None:
    """SQLite: a write-ahead log, so that readers and writer do not wait for each other, synced at each commit."""

    @event.listens_for(engine, "connect")
    def on_connect(connection: Any, _record: object) -> None:
        for pragma in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON"):
            connection.execute(f"PRAGMA {pragma}")
