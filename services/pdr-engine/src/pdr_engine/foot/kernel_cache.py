"""Where machine code of the kernel is kept: one folder for each digest of all the kernel's sources.

The first choice is ``NUMBA_CACHE_DIR``, then the folder beside the sources, then the user's cache (an installed
system is often read-only). Files carry a digest of their own: one that a power cut or a full disk left torn is
as good as none.
"""

import hashlib
import os
import secrets
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

_HERE = Path(__file__).parent
_SEAL_BYTES = hashlib.sha256().digest_size


@cache
def _digest() -> str:
    sources = b"".join(path.read_bytes() for path in sorted(_HERE.glob("*.py")))
    return hashlib.sha256(sources).hexdigest()[:16]


def _candidates() -> Iterator[Path]:
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(chosen)
    yield _HERE / "__pycache__"
    if home := os.environ.get("XDG_CACHE_HOME") or os.environ.get("HOME"):
        yield Path(home, "bootprint" if os.environ.get("XDG_CACHE_HOME") else ".cache/bootprint")


def cache_folders() -> list[Path]:
    """Every folder where code of these sources may lie, the best first."""
    return [folder / f"kernel-{_digest()}" for folder in _candidates()]


def writable_folder() -> Path:
    """The first of `cache_folders` that can be written, else a folder that goes with this process."""
    for folder in cache_folders():
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    folder = Path(_own_folder().name, f"kernel-{_digest()}")
    folder.mkdir(exist_ok=True)
    return folder


@cache
def _own_folder() -> "tempfile.TemporaryDirectory[str]":
    return tempfile.TemporaryDirectory(prefix="bootprint-kernel-")


def write_sealed(path: Path, content: bytes) -> None:
    """Write ``content`` behind its digest, in one move: other processes may write the same file now."""
    part = path.with_name(f"{path.name}.{secrets.token_hex(4)}")
    try:
        part.write_bytes(hashlib.sha256(content).digest() + content)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def read_sealed(path: Path) -> bytes | None:
    """What `write_sealed` wrote; None if there is no such file or it is damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    seal, content = data[:_SEAL_BYTES], data[_SEAL_BYTES:]
    return content if hashlib.sha256(content).digest() == seal else None
