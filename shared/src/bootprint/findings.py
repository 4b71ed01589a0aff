"""What an examination of a computer finds, and the examinations that every room shares.

A room adds its own through the entry-point group ``bootprint.findings``: a function ``(Computer) -> findings``.
"""

import grp
import os
import shutil
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from bootprint.errors import BootprintError

GROUP: Final = "bootprint.findings"
Level = Literal["ok", "warning", "fault"]
_SCARCE_BYTES, _FULL_BYTES = 2_000_000_000, 200_000_000


@dataclass(frozen=True)
class Finding:
    """One thing looked at: how it is, and what mends it if it is not well."""

    level: Level
    subject: str
    what: str
    mend: str = ""


def examined(subject: str, examine: Callable[[], object], well: str) -> Finding:
    """Well if ``examine`` raises nothing; else its error, which says what would be right."""
    try:
        examine()
    except BootprintError as error:
        return Finding("fault", subject, str(error))
    return Finding("ok", subject, well)


def folder(subject: str, path: Path) -> Iterator[Finding]:
    """Whether files can be written in a folder (made if need be), and whether its disk has room."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / ".doctor"
        probe.write_bytes(b"x")
        probe.unlink()
    except OSError as error:
        yield Finding(
            "fault",
            subject,
            f"{path}: cannot be written: {error.strerror}",
            f"chown it to {_user()}, or mount it rw",
        )
        return
    free = shutil.disk_usage(path).free
    level: Level = "fault" if free < _FULL_BYTES else "warning" if free < _SCARCE_BYTES else "ok"
    mend = "" if level == "ok" else "make room: recordings need some 60 MB an hour and soldier"
    yield Finding(level, subject, f"{path}: can be written, {free / 1e9:.1f} GB free", mend)


def device(subject: str, path: str) -> Finding:
    """Whether a serial device is there and may be used."""
    try:
        status = Path(path).stat()
    except OSError:
        mend = "plug it in; `ls /dev/serial/by-id` shows what is"
        return Finding("fault", subject, f"{path}: not there", mend)
    if os.access(path, os.R_OK | os.W_OK):
        return Finding("ok", subject, f"{path}: there, and may be used")
    group, mode = grp.getgrgid(status.st_gid).gr_name, stat.filemode(status.st_mode)
    return Finding(
        "fault",
        subject,
        f"{path}: {_user()} may not use it ({mode})",
        f"usermod -aG {group} {_user()}, then log in anew",
    )


def _user() -> str:
    return os.environ.get("USER") or f"user {os.getuid()}"
