"""What a message's annotations promise, checked when it is built; msgspec itself checks them only when decoding."""

import math
import sys
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
    plan = _plan(type(message))
    for name, low, high in plan.ranges:
        value = getattr(message, name)
        # A comparison refuses what is not a number (NaN), too.
        if value is not None and not low <= value <= high:
            _check_field(message, name, plan.limits[name])
    for name, least, most in plan.words:
        value = getattr(message, name)
        if not (isinstance(value, str) and least <= len(value) <= most):
            _check_field(message, name, plan.limits[name])
    for name in plan.others:
        _check_field(message, name, plan.limits[name])


def _check_field(message: msgspec.Struct, name: str, limits: _Limits | None) -> None:
    value = getattr(message, name)
    if value is None:
        return
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


@dataclass(frozen=True, slots=True)
class _Plan:
    """How a struct is checked: at a glance what is a plain number or word, with care all else and what seems wrong.

    ``ranges`` are (field, least, largest) of numbers, ``words`` (field, shortest, longest), ``others`` the rest.
    """

    ranges: tuple[tuple[str, float, float], ...]
    words: tuple[tuple[str, int, float], ...]
    others: tuple[str, ...]
    limits: dict[str, _Limits | None]


@cache
def _plan(type_: type[msgspec.Struct]) -> _Plan:
    info = inspect.type_info(type_)
    assert isinstance(info, inspect.StructType)
    limits = {field.name: _limits(field.type) for field in info.fields}
    words = [field.name for field in info.fields if isinstance(field.type, inspect.StrType)]
    found = {field.name: _range(field.type, limits[field.name]) for field in info.fields}
    return _Plan(
        ranges=tuple((name, *range_) for name, range_ in found.items() if range_ is not None),
        words=tuple((name, *_lengths(limits[name])) for name in words),
        others=tuple(
            field.name
            for field in info.fields
            if found[field.name] is None
            and field.name not in words
            and not _is_free(field.type, limits[field.name])
        ),
        limits=limits,
    )


def _range(info: inspect.Type, limits: _Limits | None) -> tuple[float, float] | None:
    """The finite range of a plain number (or None), itself included; None for any other type."""
    if isinstance(info, inspect.UnionType):
        numbers = [each for each in info.types if not isinstance(each, inspect.NoneType)]
        return _range(numbers[0], limits) if len(numbers) == 1 else None
    if not isinstance(info, inspect.IntType | inspect.FloatType):
        return None
    whole = isinstance(info, inspect.IntType)
    low, high = (-math.inf, math.inf) if whole else (-sys.float_info.max, sys.float_info.max)
    if limits is not None:
        low = low if limits.at_least is None else limits.at_least
        low = low if limits.above is None else math.nextafter(limits.above, math.inf)
        high = high if limits.at_most is None else limits.at_most
    return low, high


def _lengths(limits: _Limits | None) -> tuple[int, float]:
    """Shortest and longest."""
    if limits is None:
        return 0, math.inf
    return limits.min_length or 0, math.inf if limits.max_length is None else limits.max_length


def _is_free(info: inspect.Type, limits: _Limits | None) -> bool:
    """Whether any value of the type will do: words and yes or no, without a limit."""
    if isinstance(info, inspect.UnionType):
        return limits is None and all(_is_free(each, None) for each in info.types)
    free = inspect.StrType | inspect.LiteralType | inspect.BoolType | inspect.BytesType | inspect.NoneType
    return limits is None and isinstance(info, free)


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
