"""Files for their owner's eyes only: written whole, never over another one, refused when others may read them."""

import os
import stat
from pathlib import Path
from typing import Final

from bootprint.errors import ConfigError

_LARGEST_BYTES: Final = 1 << 20
_OTHERS: Final = 0o077


def create_secret(path: Path, data: bytes) -> None:
    """Write a new file that only its owner may read, synced; ConfigError rather than overwrite anything."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    except FileExistsError:
        raise ConfigError(f"{path}: exists already; a key is never overwritten, name another file") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be written: {error.strerror}") from error
    with os.fdopen(file, "wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())


def replace_secret(path: Path, data: bytes) -> None:
    """Put a new content in the place of the old one: a power cut leaves the one or the other, whole."""
    fresh = path.with_name(f"{path.name}.fresh")
    fresh.unlink(missing_ok=True)
    create_secret(fresh, data)
    fresh.replace(path)


def read_secret(path: Path, what: str, mend: str) -> bytes:
    """What stands in the file; ConfigError, with ``mend``, if it is not there or others may read it."""
    try:
        with path.open("rb") as file:
            mode = stat.S_IMODE(os.fstat(file.fileno()).st_mode)
            data = file.read(_LARGEST_BYTES)
    except OSError as error:
        raise ConfigError(f"{path}: no {what} there ({error.strerror}); {mend}") from error
    if mode & _OTHERS:
        raise ConfigError(f"{path}: others may read this {what} (mode {mode:03o}); chmod 600 it")
    return data


def next_path(path: Path) -> Path:
    """Where the key stands that is to follow one: ``group.next.key`` of ``group.key``."""
    return path.with_name(f"{path.stem}.next{path.suffix}")
