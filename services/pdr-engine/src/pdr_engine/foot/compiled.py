"""How the kernel's functions are compiled: numba, cached on disk under a digest of all their sources.

numba's own cache looks only at the file of the function it compiles, not at the files of the functions that it
calls: after an edit of a callee it would go on serving the old machine code. Hence one folder a digest, beside the
sources if that can be written, else in the user's cache (an installed system is often read-only).
"""

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])
Record = Any  # one row of a structured array: attribute access to named fields, as numba sees it

_HERE = Path(__file__).parent


def _digest() -> str:
    sources = b"".join(path.read_bytes() for path in sorted(_HERE.glob("*.py")))
    return hashlib.sha256(sources).hexdigest()[:16]


def _candidates() -> Iterator[Path]:
    """Where the cache may live, the best first."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(chosen)
    yield _HERE / "__pycache__"
    if home := os.environ.get("XDG_CACHE_HOME") or os.environ.get("HOME"):
        yield Path(home, "bootprint" if os.environ.get("XDG_CACHE_HOME") else ".cache/bootprint")


def _cache_folder() -> str:
    """The first candidate that can be written."""
    for folder in _candidates():
        chosen = folder / f"kernel-{_digest()}"
        try:
            chosen.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(chosen, os.W_OK):
            return str(chosen)
    return tempfile.mkdtemp(prefix="bootprint-kernel-")


_CACHE = _cache_folder()


def compiled(function: Function) -> Function:
    """Compile ``function`` to machine code without the interpreter, kept on disk for the next process."""
    configuration = cast(Any, numba.config)
    before, configuration.CACHE_DIR = configuration.CACHE_DIR, _CACHE
    try:
        return cast(Function, numba.njit(cache=True, error_model="numpy")(function))
    finally:
        configuration.CACHE_DIR = before
