"""The group key: one file of 32 bytes in hexadecimal, for its owner's eyes only."""

import os
import secrets
import stat
from pathlib import Path

from bootprint.errors import ConfigError
from sa_hub.radio.seal import GROUP_KEY_BYTES


def load_group_key(path: Path) -> bytes:
    """The 32 bytes of a key file; ConfigError if it is missing, readable by others, or not a key."""
    try:
        with path.open("rb") as file:
            mode = stat.S_IMODE(os.fstat(file.fileno()).st_mode)
            text = file.read(1024)
    except OSError as error:
        raise ConfigError(
            f"{path}: no group key there ({error.strerror}); `bootprint keys new {path}` makes one"
        ) from error
    if mode & 0o077:
        raise ConfigError(f"{path}: others may read this key (mode {mode:03o}); chmod 600 it")
    return _parse(text, path)


def _parse(text: bytes, path: Path) -> bytes:
    wanted = f"want {2 * GROUP_KEY_BYTES} hexadecimal digits"
    try:
        key = bytes.fromhex(text.decode("ascii").strip())
    except ValueError:
        raise ConfigError(f"{path}: not a group key, {wanted}") from None
    if len(key) != GROUP_KEY_BYTES:
        raise ConfigError(f"{path}: a key of {len(key)} bytes, {wanted}")
    return key


def create_group_key(path: Path) -> None:
    """Write a fresh random key, readable by its owner only; ConfigError rather than overwrite anything."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    except FileExistsError:
        raise ConfigError(f"{path}: exists already; a key is never overwritten, name another file") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be written: {error.strerror}") from error
    with os.fdopen(file, "w", encoding="ascii") as stream:
        stream.write(secrets.token_hex(GROUP_KEY_BYTES) + "\n")
