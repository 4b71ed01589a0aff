"""Group key files: 32 bytes in hexadecimal, for their owner's eyes only, and the next key beside the present one.

``group.next.key`` beside ``group.key`` holds a second line, ``from 2026-12-01T06:00:00+00:00``: when it takes over.
"""

import os
import secrets
import stat
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from bootprint.clock import NS_PER_S
from bootprint.errors import ConfigError
from sa_hub.radio.net_keys import GROUP_KEY_BYTES, OVERLAP_NS, NextKey

_FROM: Final = "from "


def load_group_key(path: Path) -> bytes:
    """The 32 bytes of a key file; ConfigError if it is missing, readable by others, or not a key."""
    return _parse(_read(path), path)


def load_next_key(path: Path) -> NextKey | None:
    """The key that is to follow the one in ``path``, None if there is none; ConfigError if that is not right."""
    following = next_path(path)
    if not following.exists():
        return None
    key, _, line = _read(following).partition("\n")
    try:
        if not line.startswith(_FROM):
            raise ValueError("no second line")
        begins = datetime.fromisoformat(line.removeprefix(_FROM).strip())
        from_ns = round(begins.timestamp()) * NS_PER_S
        if begins.tzinfo is None:
            raise ValueError("no time zone")
    except ValueError as error:
        raise ConfigError(
            f"{following}: does not say when it begins ({error}), want `from 2026-12-01T06:00:00+00:00`"
        ) from None
    return NextKey(_parse(key, following), from_ns)


def next_path(path: Path) -> Path:
    """``group.next.key`` of ``group.key``."""
    return path.with_name(f"{path.stem}.next{path.suffix}")


def create_group_key(path: Path) -> None:
    """Write a fresh random key, readable by its owner only; ConfigError rather than overwrite anything."""
    _create(path, secrets.token_hex(GROUP_KEY_BYTES) + "\n")


def create_next_key(path: Path, begins: datetime) -> Path:
    """Write the key that follows the one in ``path`` from that time on, beside it."""
    load_group_key(path)
    if begins.tzinfo is None:
        begins = begins.replace(tzinfo=UTC)
    begins_utc = begins.astimezone(UTC).isoformat(timespec="seconds")
    _create(next_path(path), f"{secrets.token_hex(GROUP_KEY_BYTES)}\n{_FROM}{begins_utc}\n")
    return next_path(path)


def finish_roll(path: Path, now_s: float) -> None:
    """Put the next key in the place of the old one, when nobody uses that any more; ConfigError before."""
    following = load_next_key(path)
    if following is None:
        raise ConfigError(f"{next_path(path)}: there is no next key; `bootprint keys roll {path}` makes one")
    over_s = (following.from_ns + OVERLAP_NS) // NS_PER_S
    if now_s < over_s:
        raise ConfigError(
            f"{path}: is accepted until {datetime.fromtimestamp(over_s, UTC).isoformat()}, finish after that"
        )
    # First the whole new file, then the replacement: a power cut leaves the old key or the new one.
    fresh = path.with_name(f"{path.name}.fresh")
    fresh.unlink(missing_ok=True)
    _create(fresh, following.group_key.hex() + "\n")
    fresh.replace(path)
    next_path(path).unlink()


def _read(path: Path) -> str:
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
    return text.decode("ascii", "replace")


def _parse(text: str, path: Path) -> bytes:
    wanted = f"want {2 * GROUP_KEY_BYTES} hexadecimal digits"
    try:
        key = bytes.fromhex(text.strip())
    except ValueError:
        raise ConfigError(f"{path}: not a group key, {wanted}") from None
    if len(key) != GROUP_KEY_BYTES:
        raise ConfigError(f"{path}: a key of {len(key)} bytes, {wanted}")
    return key


def _create(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    except FileExistsError:
        raise ConfigError(f"{path}: exists already; a key is never overwritten, name another file") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be written: {error.strerror}") from error
    with os.fdopen(file, "w", encoding="ascii") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
