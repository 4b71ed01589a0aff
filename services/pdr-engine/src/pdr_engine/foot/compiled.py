"""How the kernel's functions are compiled: numba, cached on disk under a digest of all their sources.

numba's own cache looks only at the file of the function it compiles, not at the files of the functions that it
calls: after an edit of a callee it would go on serving the old machine code. Hence one folder a digest
(`kernel_cache`).
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

from pdr_engine.foot.kernel_cache import writable_folder

Function = TypeVar("Function", bound=Callable[..., Any])
Record = Any  # one row of a structured array: attribute access to named fields, as numba sees it

_CACHE = str(writable_folder())


def compiled(function: Function) -> Function:
    """Compile ``function`` to machine code without the interpreter, kept on disk for the next process."""
    configuration = cast(Any, numba.config)
    before, configuration.CACHE_DIR = configuration.CACHE_DIR, _CACHE
    try:
        return cast(Function, numba.njit(cache=True, error_model="numpy")(function))
    finally:
        configuration.CACHE_DIR = before
