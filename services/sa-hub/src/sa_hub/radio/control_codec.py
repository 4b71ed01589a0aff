"""Acknowledgements, requests and fragments to bits and back."""

from typing import Final

from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.control import Acknowledgement, Asked, Control, Fragment, Request
from sa_hub.radio.errors import FrameError
from sa_hub.radio.layout import (
    ACKNOWLEDGED,
    ACKNOWLEDGEMENT,
    ASKED,
    FRAGMENT,
    KIND_BITS,
    REQUEST,
    UNREAD,
    Kind,
    read_fields,
    write_fields,
)

_EVERYBODY: Final = 15
_MOST_KNOWN: Final = 63

Heard = tuple[bool, Control, Asked | None]


def encode_control(content: Control, *, exercise: bool, asked: Asked | None) -> bytes:
    """The payload; a fragment's data must fit the frame, that is its maker's business."""
    writer = BitWriter()
    match content:
        case Acknowledgement():
            _write_acknowledgement(writer, content, exercise)
        case Request():
            _write_request(writer, content, exercise)
        case Fragment():
            _write_fragment(writer, content, exercise, asked)
    return writer.to_bytes()


def _write_acknowledgement(writer: BitWriter, content: Acknowledgement, exercise: bool) -> None:
    writer.put(Kind.ACKNOWLEDGEMENT, KIND_BITS)
    write_fields(writer, ACKNOWLEDGEMENT, {"exercise": int(exercise), "frames": len(content.heard) - 1})
    for sender, counter in content.heard:
        write_fields(writer, ACKNOWLEDGED, {"of": sender, "counted": counter})


def _write_request(writer: BitWriter, content: Request, exercise: bool) -> None:
    writer.put(Kind.REQUEST, KIND_BITS)
    unread = () if content.unread is None else content.unread
    count = _EVERYBODY if content.unread is None else len(unread)
    values = {"exercise": int(exercise), "known": min(content.known, _MOST_KNOWN), "unread": count}
    write_fields(writer, REQUEST, values)
    for number in unread:
        write_fields(writer, UNREAD, {"number": number})


def _write_fragment(writer: BitWriter, content: Fragment, exercise: bool, asked: Asked | None) -> None:
    writer.put(Kind.FRAGMENT, KIND_BITS)
    values = {
        "exercise": int(exercise),
        "message": content.message,
        "index": content.index,
        "last": content.last,
        "data_bytes": len(content.data),
    }
    write_fields(writer, FRAGMENT, values | asked_values(asked))
    write_asked(writer, asked)
    writer.put_bytes(content.data)


def decode_acknowledgement(reader: BitReader, _now_tick: int) -> Heard:
    """Whether it is exercise, and what was heard."""
    values = read_fields(reader, ACKNOWLEDGEMENT, {})
    frames = [read_fields(reader, ACKNOWLEDGED, {}) for _ in range(values["frames"] + 1)]
    heard = tuple((frame["of"], frame["counted"]) for frame in frames)
    return bool(values["exercise"]), Acknowledgement(heard), None


def decode_request(reader: BitReader, _now_tick: int) -> Heard:
    """Whether it is exercise, and what is wanted."""
    values = read_fields(reader, REQUEST, {})
    if values["unread"] == _EVERYBODY:
        return bool(values["exercise"]), Request(values["known"], None), None
    unread = tuple(read_fields(reader, UNREAD, {})["number"] for _ in range(values["unread"]))
    return bool(values["exercise"]), Request(values["known"], unread), None


def decode_fragment(reader: BitReader, _now_tick: int) -> Heard:
    """Whether it is exercise, and the part."""
    values = read_fields(reader, FRAGMENT, {})
    if values["index"] > values["last"]:
        raise FrameError("range", f"part {values['index']} of {values['last']}")
    asked = read_asked(reader, values)
    data = reader.take_bytes(values["data_bytes"])
    return bool(values["exercise"]), Fragment(values["message"], values["index"], values["last"], data), asked


def asked_values(asked: Asked | None) -> dict[str, int]:
    """The fields that tell who is to acknowledge."""
    return {"asked": int(asked is not None), "among": len(asked.numbers) if asked else 0}


def write_asked(writer: BitWriter, asked: Asked | None) -> None:
    """Who is to acknowledge, by number."""
    for number in asked.numbers if asked else ():
        write_fields(writer, ASKED, {"number": number})


def read_asked(reader: BitReader, values: dict[str, int]) -> Asked | None:
    """Who is to acknowledge; None if nobody is."""
    if not values["asked"]:
        return None
    return Asked(tuple(read_fields(reader, ASKED, {})["number"] for _ in range(values["among"])))
