"""What a message's annotations promise, checked when it is built; msgspec itself checks them only when decoding."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import msgspec
from msgspec import inspect


@dataclass(frozen=True, slots=True)
class _Limits:
    """What one field may be; None where there is no limit. Lengths are of tuples and strings."""

    at_least: float | None = None
    above: float | None = None
    at_most: float | None = None
    min_length: int | None = None
    max_length: int | None = None

    def violation(self, value: Any) -> str | None:
        """What is wrong with the value, as the rest of a sentence; None if nothing is."""
        if isinstance(value, tuple | str):
            return self._length_violation(len(value))
        if self.at_least is not None and value < self.at_least:
            return f"is {value}, want at least {self.at_least}"
        if self.above is not None and value <= self.above:
            return f"is {value}, want more than {self.above}"
        if self.at_most is not None and value > self.at_most:
            return f"is {value}, want at most {self.at_most}"
        return None

    def _length_violation(self, length: int) -> str | None:
        if self.min_length is not None and length < self.min_length:
            return f"has length {length}, want at least {self.min_length}"
        if self.max_length is not None and length > self.max_length:
            return f"has length {length}, want at most {self.max_length}"
        return None


def check(message: msgspec.Struct) -> None:
    """ValueError if a number is not finite or a field breaks the limits of its annotation."""
    for name, limits in _fields(type(message)):
        value = getattr(message, name)
        if value is None:
            continue
        if not _all_finite(value):
            raise ValueError(f"{name} is not finite")
        violation = limits and limits.violation(value)
        if violation:
            raise ValueError(f"{name} {violation}")


def _all_finite(value: object) -> bool:
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, tuple):
        return all(_all_finite(item) for item in value)
    if isinstance(value, dict):
        return all(_all_finite(item) for item in value.values())
    return True


@cache
def _fields(type_: type[msgspec.Struct]) -> tuple[tuple[str, _Limits | None], ...]:
    """Each field of a struct with its limits, None if it has none."""
    info = inspect.type_info(type_)
    assert isinstance(info, inspect.StructType)
    return tuple((field.name, _limits(field.type)) for field in info.fields)


def _limits(info: inspect.Type) -> _Limits | None:
    match info:
        case inspect.UnionType(types=types):
            return next((limits for limits in map(_limits, types) if limits), None)
        case inspect.IntType() | inspect.FloatType():
            found = _Limits(at_least=info.ge, above=info.gt, at_most=info.le)
        case inspect.TupleType(item_types=items):
            found = _Limits(min_length=len(items), max_length=len(items))
        case inspect.VarTupleType() | inspect.StrType():
            found = _Limits(min_length=info.min_length, max_length=info.max_length)
        case _:
            return None
    return None if found == _Limits() else found
