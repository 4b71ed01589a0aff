"""A request, read and checked, and how one is refused."""

from dataclasses import dataclass, field
from typing import Any

import msgspec

from sa_hub.page.access import Principal


class Refused(Exception):  # noqa: N818 - it is an answer, not a defect
    """A request that is not done: the HTTP status, and in one line why and what would be right."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status = status
        self.reason = reason


class Fault(msgspec.Struct, frozen=True):
    """Why a request was refused."""

    error: str


@dataclass(frozen=True)
class Ask:
    """Who asks, with the body and the query as structs, and the parts of the path."""

    who: Principal
    body: Any = None
    query: Any = None
    path: dict[str, str] = field(default_factory=dict)


def body_of(raw: bytes, type_: type[msgspec.Struct]) -> msgspec.Struct:
    """The JSON body as ``type_``; Refused (400, 422) tells what is wrong with it."""
    try:
        return msgspec.json.decode(raw, type=type_)
    except msgspec.ValidationError as error:
        raise Refused(422, str(error)) from error
    except msgspec.DecodeError as error:
        raise Refused(400, f"not JSON: {error}") from error
    except ValueError as error:  # what a message refuses by itself
        raise Refused(422, str(error)) from error


def query_of(values: dict[str, str], type_: type[msgspec.Struct]) -> msgspec.Struct:
    """The query as ``type_``; Refused (422) tells what is wrong with it."""
    try:
        return msgspec.convert(values, type_, strict=False)
    except msgspec.ValidationError as error:
        raise Refused(422, str(error)) from error
