"""Databases for tests of the archive: SQLite in a file, and a PostgreSQL server of the test's own.

The server runs in a folder of its own on a socket in it, as an unprivileged user (it refuses root).
"""

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psycopg
import pytest

_USER = "nobody"


def _program(name: str) -> str | None:
    """Debian keeps the server's programs out of the path, by version."""
    newest_first = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{name}"), reverse=True)
    return shutil.which(name) or next(map(str, newest_first), None)


@contextmanager
def postgres(*, fsync: bool = False) -> Iterator[str]:
    """A running server's folder; skips where PostgreSQL is not installed. ``fsync``: as servers do for real."""
    initdb, server = _program("initdb"), _program("postgres")
    if initdb is None or server is None:
        pytest.skip(
            "PostgreSQL is not installed (Debian: apt-get install postgresql): its half is not tested"
        )
    folder = Path(tempfile.mkdtemp(prefix="bootprint-postgres-"))
    user = {} if os.geteuid() else {"user": _USER, "group": pwd.getpwnam(_USER).pw_gid, "extra_groups": []}
    if user:
        os.chown(folder, pwd.getpwnam(_USER).pw_uid, pwd.getpwnam(_USER).pw_gid)
    data = str(folder / "data")
    process = None
    try:
        setup = [initdb, "-D", data, "-U", "postgres", "--auth=trust", "--no-sync", "-E", "UTF8"]
        subprocess.run(setup, check=True, stdout=subprocess.DEVNULL, cwd="/", **user)
        options = ["-c", f"unix_socket_directories={folder}", "-c", "listen_addresses="]
        options += ["-c", f"fsync={'on' if fsync else 'off'}"]
        with (folder / "log").open("wb") as log:
            process = subprocess.Popen([server, "-D", data, *options], stderr=log, cwd="/", **user)
        _wait_for(folder, process)
        yield str(folder)
    finally:
        if process is not None:
            process.send_signal(signal.SIGINT)  # do not wait for clients
            process.wait(timeout=30)
        shutil.rmtree(folder, ignore_errors=True)


def _wait_for(folder: Path, process: "subprocess.Popen[bytes]") -> None:
    """Ask until it answers; the server tells readiness in no other way than by answering."""
    while True:
        try:
            psycopg.connect(f"host={folder} user=postgres dbname=postgres").close()
        except psycopg.OperationalError:
            assert process.poll() is None, (folder / "log").read_text()
        else:
            return


def new_database(folder: str, name: str) -> str:
    """An empty database on that server; its url for an archive."""
    with psycopg.connect(f"host={folder} user=postgres dbname=postgres", autocommit=True) as connection:
        connection.execute(f'CREATE DATABASE "{name}"'.encode())
    return f"postgresql+psycopg://postgres@/{name}?host={folder}"
