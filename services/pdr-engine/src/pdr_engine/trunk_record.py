"""The body navigator as bytes that can be saved, and back.

It is a tree of plain Python objects, and pickled as such. Unpickling is held to the body's own estimators, numpy's
arrays and the standard containers ("Restricting Globals" in Python's manual of pickle): a file of state that
somebody has made up can build wrong objects, but calls nothing else. Records belong to the sources that wrote them.
"""

import hashlib
import io
import pickle
from functools import cache
from importlib import import_module
from inspect import isfunction
from pathlib import Path
from typing import Any, Final

_ESTIMATORS: Final = "pdr_engine.body."
_OTHERS: Final = {
    ("bootprint.config", "Origin"),
    ("bootprint.geodesy", "LocalFrame"),
    ("bootprint.geomagnetism", "EarthField"),
    ("builtins", "complex"),
    ("builtins", "frozenset"),
    ("builtins", "set"),
    ("collections", "Counter"),
    ("collections", "OrderedDict"),
    ("collections", "defaultdict"),
    ("collections", "deque"),
    ("filterpy.kalman.kalman_filter", "KalmanFilter"),
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("numpy.linalg", "inv"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy._core.numeric", "_frombuffer"),
    ("copyreg", "_reconstructor"),
    ("builtins", "object"),
}


class _Reader(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        """A class or function of the estimators by its plain name, or one of the few others."""
        if (module, name) in _OTHERS:
            return getattr(import_module(module), name)
        found = getattr(import_module(module), name, None) if module.startswith(_ESTIMATORS) else None
        if (isinstance(found, type) or isfunction(found)) and found.__module__ == module:
            return found
        raise pickle.UnpicklingError(f"{module}.{name} is no part of a navigator")


def frozen(parts: dict[str, Any]) -> bytes:
    """The parts as bytes; ValueError if one of them cannot be pickled."""
    try:
        return pickle.dumps(parts, protocol=5)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise ValueError(f"the body's navigator cannot be saved: {error}") from error


def thawed(data: bytes) -> dict[str, Any]:
    """The parts again; ValueError if the bytes are no such thing."""
    try:
        parts = _Reader(io.BytesIO(data)).load()
    except Exception as error:  # pickle documents that anything may be raised
        raise ValueError(f"no body navigator: {error}") from error
    if not isinstance(parts, dict):
        raise ValueError("no body navigator")
    return parts


@cache
def sources_digest() -> str:
    """Of all sources of this package: what other ones wrote is not read."""
    here = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(here.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
