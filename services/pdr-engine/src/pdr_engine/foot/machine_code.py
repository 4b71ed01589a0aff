"""The kernel as machine code without its compiler: numba makes an object file once, LLVM's linker loads it.

numba takes 80 MB of every process that it runs in. So another process compiles `stream.feed` behind a plain C
signature (`build_kernel`), the object file is kept by sources, processor and versions (`kernel_cache`), and this
process needs the linker alone. Where any of that fails, numba itself runs the kernel: the same bits in more memory.
"""

import ctypes
import hashlib
import mmap
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm

from pdr_engine.foot.kernel_cache import cache_folders, read_sealed, writable_folder
from pdr_engine.foot.tables import Tables

ENTRY = "feed"  # its name in the object file: state, parameters, batch, estimates, steps, count, ends
Run = Callable[[int, bool], None]  # samples in the batch, whether the stream ends with them

_PATIENCE_S = 600.0  # for a compilation, which takes a quarter of a minute
_POINTER = ctypes.c_void_p
# The interpreter's lock is held, as in a call of numba's: nobody else may touch the tables meanwhile.
_SIGNATURE = ctypes.PYFUNCTYPE(None, *[_POINTER] * 5, ctypes.c_int64, ctypes.c_bool)
# All that the kernel may call: it knows neither the interpreter nor numba.
C_LIBRARY = (
    *("acos", "asin", "atan", "atan2", "cos", "cosh", "sin", "sincos", "sinh", "tan", "tanh"),
    *("exp", "exp2", "expm1", "log", "log10", "log1p", "log2", "pow", "sqrt", "cbrt", "hypot", "fmod"),
    *("ceil", "fabs", "floor", "nearbyint", "rint", "round", "trunc", "memcpy", "memmove", "memset"),
)


class KernelError(Exception):
    """The kernel cannot be had as machine code alone; says why in a line."""


@dataclass(frozen=True, slots=True)
class Kernel:
    """`stream.feed`, to be bound to tables; ``fallback`` tells why numba runs it, None if it does not."""

    bind: Callable[[Tables], Run]
    fallback: str | None = None


@cache
def load_kernel() -> Kernel:
    """The kernel as machine code alone if that can be had, else run by numba."""
    try:
        return Kernel(linked(_object_code()))
    except Exception as error:  # whatever it is that fails here, numba can do without
        return Kernel(run_by_numba, fallback=f"{type(error).__name__}: {error}")


def linked(code: bytes) -> Callable[[Tables], Run]:
    """The `ENTRY` of an object file, to be bound to tables; RuntimeError if what it calls is not to be found."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    builder = llvm.JITLibraryBuilder().add_object_img(code).export_symbol(ENTRY)
    process = ctypes.CDLL(None)
    for name in C_LIBRARY:
        if hasattr(process, name):
            builder.import_symbol(name, ctypes.cast(getattr(process, name), _POINTER).value)
    library = builder.link(llvm.create_lljit_compiler(), ENTRY)
    _hand_back_linker()
    return partial(_bound, library)


def _hand_back_linker() -> None:
    """Let go of the pages of LLVM's code, 40 to 100 MB of this process that nobody needs once it has linked.

    They are clean pages of a file: should one be needed after all, it comes back by itself. Linux only.
    """
    maps = Path("/proc/self/maps")
    if not maps.exists():
        return
    advise = ctypes.CDLL(None).madvise
    advise.argtypes = [_POINTER, ctypes.c_size_t, ctypes.c_int]
    for line in maps.read_text(encoding="utf-8").splitlines():
        addresses, rights, *_, path = line.split(maxsplit=5)
        if rights == "r-xp" and "llvmlite" in path:
            start, end = (int(address, 16) for address in addresses.split("-"))
            advise(start, end - start, mmap.MADV_DONTNEED)


def _bound(library: llvm.ResourceTracker, tables: Tables) -> Run:
    """The call on these tables. What it points to lives as long as it does."""
    function: Any = _SIGNATURE(library[ENTRY])
    function.library = library  # it unloads the code when it goes
    pointed = (tables.state, tables.parameters, tables.batch, tables.estimates, tables.steps)
    return partial(function, *(table.ctypes.data_as(_POINTER) for table in pointed))


def run_by_numba(tables: Tables) -> Run:
    """`stream.feed` on these tables, as numba runs it."""
    return partial(_feed, tables)


def _feed(tables: Tables, count: int, ends: bool) -> None:
    from pdr_engine.foot.stream import feed  # brings numba

    feed(tables.state, tables.parameters, tables.batch, count, ends, tables.estimates, tables.steps)


def _object_code() -> bytes:
    """The object file of these sources and this processor, from disk or made now."""
    for folder in cache_folders():
        if code := read_sealed(folder / _file_name()):
            return code
    path = writable_folder() / _file_name()
    _build(path)
    if code := read_sealed(path):
        return code
    raise KernelError(f"{path} is damaged although it was written just now")


def _file_name() -> str:
    marks = (
        *(version("numba"), version("llvmlite"), sys.implementation.cache_tag),
        *(llvm.get_process_triple(), llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()),
    )
    return f"feed-{hashlib.sha256(repr(marks).encode()).hexdigest()[:16]}.kernel"


def _build(path: Path) -> None:
    """Let another process, of the same sources, write the object file."""
    command = [sys.executable, "-P", "-m", "pdr_engine.foot.build_kernel", str(path)]
    surroundings = os.environ | {
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "NUMBA_CACHE_DIR": str(path.parent.parent),
    }
    built = subprocess.run(
        command,
        env=surroundings,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=_PATIENCE_S,
        check=False,
    )
    if built.returncode != 0:
        last = (built.stderr.strip() or f"exit code {built.returncode}").splitlines()[-1]
        raise KernelError(f"the kernel cannot be compiled: {last}")
