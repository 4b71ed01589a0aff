"""Hypothesis strategies for every message type, addresses and envelopes, drawn from the types' own annotations."""

from typing import Any

import msgspec
import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from msgspec import inspect

from bootprint import messages as m
from bootprint.bus import Envelope
from bootprint.topics import TOPICS, Address

quick = settings(max_examples=25, deadline=None)
"""For properties that are tried on every message type, on a machine that may be busy."""

finite = st.floats(allow_nan=False, allow_infinity=False)
times_ns = st.integers(-(2**63), 2**63 - 1)
parts = st.text("abcXYZ019_.-", min_size=1, max_size=64)


def values(info: inspect.Type) -> st.SearchStrategy[Any]:
    """Values of a field's type, within its limits."""
    match info:
        case inspect.NoneType():
            return st.none()
        case inspect.BoolType():
            return st.booleans()
        case inspect.IntType(ge=low, le=high):
            return st.integers(-(2**63) if low is None else low, 2**63 - 1 if high is None else high)
        case inspect.FloatType():
            low = info.ge if info.gt is None else info.gt
            return st.floats(
                low, info.le, exclude_min=info.gt is not None, allow_nan=False, allow_infinity=False
            )
        case inspect.StrType():
            return st.text(min_size=info.min_length or 0, max_size=info.max_length)
        case inspect.LiteralType(values=words):
            return st.sampled_from(words)
        case inspect.UnionType(types=types):
            return st.one_of(*map(values, types))
        case inspect.TupleType(item_types=types):
            return st.tuples(*map(values, types))
        case inspect.VarTupleType(item_type=item):
            return st.lists(values(item), min_size=info.min_length or 0, max_size=info.max_length or 5).map(
                tuple
            )
        case inspect.DictType(key_type=key, value_type=value):
            return st.dictionaries(values(key), values(value), max_size=5)
        case inspect.StructType():
            return structs(info)
    raise NotImplementedError(f"no strategy for {info}")


@st.composite
def imu_batches(draw: st.DrawFn) -> m.ImuBatch:
    """Batches of one to twelve samples, with or without a magnetometer."""
    count = draw(st.integers(1, 12))
    times = draw(st.lists(times_ns, min_size=count, max_size=count))
    triples = st.lists(st.tuples(finite, finite, finite), min_size=count, max_size=count)
    return m.ImuBatch.from_arrays(
        draw(st.integers(0, 2**63 - 1)),
        np.array(times, dtype=np.int64),
        draw(triples),
        draw(triples),
        draw(st.none() | triples),
    )


def messages(type_: type[m.Message]) -> st.SearchStrategy[Any]:
    """Messages of one type, optional fields present or not."""
    if type_ is m.ImuBatch:
        return imu_batches()
    info = inspect.type_info(type_)
    assert isinstance(info, inspect.StructType)
    return structs(info)


def structs(info: inspect.StructType) -> st.SearchStrategy[Any]:
    """Instances of a struct, optional fields present or not."""
    required = {field.name: values(field.type) for field in info.fields if field.required}
    optional = {field.name: values(field.type) for field in info.fields if not field.required}
    return st.fixed_dictionaries(required, optional=optional).map(lambda fields: info.cls(**fields))


def addresses(subject: str) -> st.SearchStrategy[Address]:
    """Addresses of one subject."""
    return st.builds(Address, parts, parts, parts, st.just(subject), parts)


envelopes: st.SearchStrategy[Envelope] = st.sampled_from(TOPICS).flatmap(
    lambda topic: st.builds(Envelope, addresses(topic.subject), messages(topic.message))
)


def plain(message: m.Message) -> dict[str, Any]:
    """A message's fields by name, structs in them likewise; tuples within tuples are lists, as they are read."""
    return {name: _plain(value) for name, value in msgspec.structs.asdict(message).items()}


def _plain(value: Any, within: type[tuple[Any, ...]] | type[list[Any]] = tuple) -> Any:
    if isinstance(value, tuple):
        return within(_plain(each, list) for each in value)
    return msgspec.structs.asdict(value) if isinstance(value, msgspec.Struct) else value
