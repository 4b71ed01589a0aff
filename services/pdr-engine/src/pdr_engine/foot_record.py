"""A foot navigator's record as bytes that can be saved, and back: of its rings only what may still be looked at."""

import numpy as np
import numpy.typing as npt

from pdr_engine.foot.memory import ALIGNING, MASK, RING, STATE

Record = npt.NDArray[np.void]
_LOOKED_BACK_S = 1.2  # the learned detector's longest window ends a second before its sample
_NAMES = STATE.names or ()
_RINGS = tuple(name for name in _NAMES if STATE[name].shape[:1] == (RING,))
_REST = np.dtype([(name, STATE[name]) for name in _NAMES if name not in _RINGS])
_ROW = np.dtype([(name, STATE[name].base, STATE[name].shape[1:]) for name in _RINGS])


def condensed(state: Record) -> bytes:
    """The record (`STATE`, shape (1,)) without the samples that are behind it for good."""
    rest = np.zeros(1, _REST)
    for name in _REST.names or ():
        rest[name] = state[name]
    first, head = _first(state), int(state["head"][0])
    places = np.arange(first, head) & MASK
    rows = np.zeros(len(places), _ROW)
    for name in _RINGS:
        rows[name] = state[name][0][places]
    return rest.tobytes() + rows.tobytes()


def _first(state: Record) -> int:
    """The oldest sample that anything may look at."""
    record = state[0]
    oldest = [record["done"], record["start"] if record["mode"] == ALIGNING else record["done"]]
    oldest += [record["swing"], record["lifted"]] + ([record["stop_block"]] if record["stop_samples"] else [])
    usual_s = 1e-9 * float(record["usual_ns"])
    back = RING if usual_s <= 0.0 else min(RING, int(_LOOKED_BACK_S / usual_s))
    return int(max(0, record["head"] - RING, min(oldest) - back))


def restored(data: bytes) -> Record:
    """The record out of `condensed`'s bytes, shape (1,); ValueError if they can be none."""
    if len(data) < _REST.itemsize or (len(data) - _REST.itemsize) % _ROW.itemsize:
        raise ValueError("a foot's record of another size")
    rest = np.frombuffer(data, _REST, count=1)
    rows = np.frombuffer(data, _ROW, offset=_REST.itemsize)
    _check(rest, len(rows))
    state = np.zeros(1, STATE)
    for name in _REST.names or ():
        state[name] = rest[name]
    head = int(rest["head"][0])
    places = np.arange(head - len(rows), head) & MASK
    for name in _RINGS:
        state[name][0][places] = rows[name]
    return state


def _check(rest: Record, rows: int) -> None:
    """That counts are in order and the filter's numbers are numbers: the kernel trusts its own record."""
    counts = [int(rest[name][0]) for name in ("done", "clean", "head")]
    if not (0 <= counts[0] <= counts[1] <= counts[2] and rows <= min(RING, counts[2])):
        raise ValueError("a foot's record whose counts contradict each other")
    if not all(np.isfinite(rest[name]).all() for name in ("position", "velocity", "attitude", "yaw", "P")):
        raise ValueError("a foot's record with numbers that are none")
