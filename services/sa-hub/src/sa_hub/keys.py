"""Group key files: 32 bytes in hexadecimal, for their owner's eyes only, and the next key beside the present one.

``group.next.key`` beside ``group.key`` holds a second line, ``from 2026-12-01T06:00:00+00:00``: when it takes over.
A third, ``the old key is lost``, says that the old one is refused from then on.
"""

import secrets
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from bootprint.clock import NS_PER_S
from bootprint.errors import ConfigError
from bootprint.keys.secret_files import create_secret, next_path, read_secret, replace_secret
from sa_hub.radio.net_keys import GROUP_KEY_BYTES, OVERLAP_NS, NextKey

_FROM: Final = "from "
_LOST: Final = "the old key is lost"


def load_group_key(path: Path) -> bytes:
    """The 32 bytes of a key file; ConfigError if it is missing, readable by others, or not a key."""
    return _parse(_read(path), path)


def load_next_key(path: Path) -> NextKey | None:
    """The key that is to follow the one in ``path``, None if there is none; ConfigError if that is not right."""
    following = next_path(path)
    if not following.exists():
        return None
    key, line, *more = [*_read(following).split("\n"), ""]
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
    return NextKey(_parse(key, following), from_ns, 0 if _LOST in more else OVERLAP_NS)


def create_group_key(path: Path) -> None:
    """Write a fresh random key, readable by its owner only; ConfigError rather than overwrite anything."""
    create_secret(path, _text(secrets.token_hex(GROUP_KEY_BYTES)))


def create_next_key(path: Path, begins: datetime, *, is_lost: bool = False) -> Path:
    """Write the key that follows the one in ``path`` from that time on, beside it; a lost one is refused then."""
    load_group_key(path)
    if begins.tzinfo is None:
        begins = begins.replace(tzinfo=UTC)
    begins_utc = begins.astimezone(UTC).isoformat(timespec="seconds")
    lines = [secrets.token_hex(GROUP_KEY_BYTES), f"{_FROM}{begins_utc}", *([_LOST] if is_lost else [])]
    create_secret(next_path(path), _text(*lines))
    return next_path(path)


def finish_roll(path: Path, now_s: float) -> None:
    """Put the next key in the place of the old one, when nobody uses that any more; ConfigError before."""
    following = load_next_key(path)
    if following is None:
        raise ConfigError(f"{next_path(path)}: there is no next key; `bootprint keys roll {path}` makes one")
    over_s = (following.from_ns + following.overlap_ns) // NS_PER_S
    if now_s < over_s:
        raise ConfigError(
            f"{path}: is accepted until {datetime.fromtimestamp(over_s, UTC).isoformat()}, finish after that"
        )
    replace_secret(path, _text(following.group_key.hex()))
    next_path(path).unlink()


def _read(path: Path) -> str:
    data = read_secret(path, "group key", f"`bootprint keys new {path}` makes one")
    return data.decode("ascii", "replace")


def _text(*lines: str) -> bytes:
    return "".join(f"{line}\n" for line in lines).encode("ascii")


def _parse(text: str, path: Path) -> bytes:
    wanted = f"want {2 * GROUP_KEY_BYTES} hexadecimal digits"
    try:
        key = bytes.fromhex(text.strip())
    except ValueError:
        raise ConfigError(f"{path}: not a group key, {wanted}") from None
    if len(key) != GROUP_KEY_BYTES:
        raise ConfigError(f"{path}: a key of {len(key)} bytes, {wanted}")
    return key
