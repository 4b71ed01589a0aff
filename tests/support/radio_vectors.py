"""Test vectors of the radio's frames, for decoders in other languages: ``make vectors`` writes them anew.

``tests/sa_hub/vectors/layout.json`` holds the layout's tables and of which of them each kind is made,
``frames.json`` sealed frames of every kind with the numbers in them and what those mean.
"""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from bootprint.config import Origin
from sa_hub.radio import layout
from sa_hub.radio.bits import BitReader
from sa_hub.radio.content import (
    AlertNotice,
    Content,
    Entry,
    Facing,
    Feedback,
    Level,
    Notice,
    ObservationNotice,
    Quality,
    Report,
    Reports,
    StatusNotice,
    Update,
)
from sa_hub.radio.control import Acknowledgement, Asked, Fragment, Request
from sa_hub.radio.counters import MemoryCounters
from sa_hub.radio.frame import Codec
from sa_hub.radio.grid import Grid
from sa_hub.radio.header import read_header
from sa_hub.radio.layout import Field, Kind
from sa_hub.radio.net_keys import NetKeys, TagBytes
from sa_hub.radio.quantise import PACES
from sa_hub.radio.references import References
from sa_hub.radio.seal import Opened, Opener, Sealer

FOLDER = Path(__file__).parents[1] / "sa_hub" / "vectors"
S = 1_000_000_000
NOW_NS = 1_790_000_000 * S
ORIGIN = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=50.0)
GROUP_KEY = bytes(range(32))
NET = "squad"
SENDER = 7


@dataclass(frozen=True)
class Part:
    """Fields that come ``repeat`` times (an expression of fields before; ``left``: bits that are left).

    ``then_bytes``: the field that tells how many bytes follow. ``rice``: the parameter (an expression) of the Rice
    code of a number, "gap", before each but the first. ``while_left``: unless the field "counted" is 1, they come
    as long as so many bits are left.
    """

    fields: Sequence[Field]
    repeat: str = "1"
    then_bytes: str = ""
    rice: str = ""
    while_left: int = 0


_ASKED = Part(layout.ASKED, "asked ? among : 0", "text_bytes")
_FEEDBACK = Part(layout.FEEDBACK, "left >= 8 ? 1 : 0")
STRUCTURE: dict[Kind, list[Part]] = {
    Kind.SELF: [Part(layout.SELF), _FEEDBACK],
    Kind.SQUAD: [Part(layout.SQUAD), Part(layout.SOLDIER, "count + 1"), _FEEDBACK],
    Kind.ALERT: [Part(layout.ALERT), _ASKED],
    Kind.OBSERVATION: [Part(layout.OBSERVATION), _ASKED],
    Kind.STATUS: [Part(layout.STATUS)],
    Kind.SQUAD_UPDATE: [
        Part(layout.UPDATE),
        Part(layout.ENTRY, "counted ? count + 1 : own ? 1 : 64", rice="2 * gap_code", while_left=7),
        _FEEDBACK,
    ],
    Kind.ACKNOWLEDGEMENT: [Part(layout.ACKNOWLEDGEMENT), Part(layout.ACKNOWLEDGED, "frames + 1")],
    Kind.REQUEST: [Part(layout.REQUEST), Part(layout.UNREAD, "unread == 15 ? 0 : unread")],
    Kind.FRAGMENT: [Part(layout.FRAGMENT), replace(_ASKED, then_bytes="data_bytes")],
    Kind.FEEDBACK: [Part(layout.FEEDBACK_ALONE), Part(layout.FEEDBACK)],
}
TABLES: dict[str, tuple[Sequence[str], Sequence[int]]] = {
    "cells": (("lattice", "wide"), [resolution for resolution, _ in layout.LATTICES]),
    "reach": (("lattice", "wide"), [reach for _, reach in layout.LATTICES]),
    "most_missed": (("misses",), layout.MISSES),
    "pace_speed": (("pace",), PACES),
}
"""Numbers that a field is the code of, by the name under which expressions speak of them: (the field
that is there of these, numbers)."""


def contents() -> Iterator[tuple[str, Content, Asked | None]]:
    """Something of every kind: (what it shows, content, who is to acknowledge it)."""
    walker = Report(SENDER, NOW_NS - S, 59.3514, 18.0721, 1.2, 0.7, 1.1, 52.0, floor=2)
    far = Report(SENDER, NOW_NS, -33.86, 151.21, 30.0, mode="gnss", condition="wounded", facing_deg=200.0)
    yield "own report, walking on the second floor", Reports((walker,)), None
    yield "own report, far from the origin, standing", Reports((far,)), None
    squad = tuple(
        Report(n, NOW_NS - n * S // 5, 59.35 + n * 1e-4, 18.07 - n * 1e-4, 2.0, 1.0, 0.0, 50.0 + n, hops=1)
        for n in (2, 3, 4, 9)
    )
    yield "squad report, four soldiers of different age", Reports(squad), None
    yield from _reports_for_updates()
    yield from _updates()
    yield "alert, everybody is asked", AlertNotice(SENDER, NOW_NS, "contact", "norra väggen"), Asked()
    yield "alert, relayed, two are asked", AlertNotice(3, NOW_NS - 9 * S, "help", hops=2), Asked((2, 1023))
    seen = ObservationNotice(SENDER, NOW_NS, 59.3601, 18.0502, 7.0, "två fordon", code="vehicle")
    yield "observation with code and text", seen, Asked()
    yield "observation by code alone", ObservationNotice(1, NOW_NS, 0.0, -180.0, 0.4, code="ied"), None
    yield "status", StatusNotice(SENDER, NOW_NS, "wounded", 41.0), None
    yield "status, battery unknown", StatusNotice(SENDER, NOW_NS, "out"), None
    yield "acknowledgement of two frames", Acknowledgement(((3, 17), (1023, 255))), None
    yield "request of a newcomer", Request(1, None), None
    yield "request of one who cannot open two senders", Request(12, (4, 1001)), None
    yield "fragment", Fragment(5, 1, 2, "förrådet".encode()), Asked((8,))
    yield "feedback alone", Feedback(1, 0x3A9, 16, 0b1101_0111_1111_0001), None


def _reports_for_updates() -> Iterator[tuple[str, Content, None]]:
    old = Report(12, NOW_NS - 380 * S, 59.3493, 18.0688, 4.0, -1.9, 0.0, 47.0, mode="gnss", floor=-1, hops=2)
    newer = Report(30, NOW_NS - 5 * S // 2, 59.3513, 18.0723, 1.0, 0.0, -1.3, hops=1)
    tick = NOW_NS * 10 // S
    yield (
        "squad report, two of whom one is long not heard, no height of the other",
        Reports((old, newer)),
        None,
    )
    told = Reports((newer,), Feedback(1, 0x3A7, 8, 0b1011_0111), tick)
    yield "squad report of one, later than he was there, with feedback", told, None
    own = Report(SENDER, NOW_NS - S // 2, 59.3518, 18.0719, 1.2, 0.9, 1.0, 53.0, floor=1)
    yield "own report with feedback", Reports((own,), Feedback(1023, 255, 32, 0x8000_0001)), None


def _updates() -> Iterator[tuple[str, Content, None]]:
    """Of the soldiers that were told in full before; 1000 never was."""
    yield (
        "update of the sender itself, on foot",
        _update(3, 4, 0, _entry(SENDER, 59.3519, 18.0721, (3, 6))),
        None,
    )
    four = (_entry(n, 59.35 + n * 1e-4, 18.07 - n * 9e-5, (n, 4) if n % 2 else None) for n in (2, 3, 4, 9))
    yield "update of four, some standing", _update(3, 5, 4, *four), None
    changed = (
        _entry(4, 59.3505, 18.0696, None, 60, Quality(2, 4, 1, 2), Level(3, 54)),
        # By the damped rule he is 114 m on, by a straight one 722 m.
        _entry(12, 59.3493, 18.0667, (12, 11), 0, None, Level(None, None)),
        _entry(30, 59.3512, 18.0723, (8, 5), 25, Quality(7, 6, 3, 0)),
        _entry(1000, 59.35, 18.07, None),
    )
    all_told = replace(_update(4, 8, 14, *changed), feedback=Feedback(1, 17, 4, 0b0110))
    yield "update of four, much has changed, one is not known", all_told, None
    covering = (
        _entry(2, 59.3502, 18.06982, None, facing=Facing(5)),
        _entry(3, 59.3503, 18.06973, None, facing=Facing(15)),
        _entry(9, 59.3509, 18.06919, None),
    )
    yield "update of three who stand, two face somewhere", _update(3, 5, 2, *covering), None
    gone_on = (
        _entry(2, 59.3502, 18.06982, None),
        _entry(3, 59.3504, 18.06964, None, facing=Facing(None)),
        _entry(9, 59.3509, 18.06919, None, quality=Quality(2, 4, 1, 0)),
    )
    yield "update of the three, one faces as before, one no more", _update(3, 5, 2, *gone_on), None
    fine = (_entry(2, 59.35021, 18.06979, (4, 6)), _entry(3, 59.35031, 18.06969, None))
    yield "update on fine cells", _update(1, 6, 1, *fine), None
    going_on = (
        _entry(2, 59.35023, 18.06981, (5, 6)),
        replace(_entry(3, 59.35033, 18.06967, None, 30), steady=True),
        replace(_entry(4, 59.3511, 18.0701, None, 22), steady=True, far=True),
        replace(_entry(12, 59.3494, 18.0664, None), far=True),
        replace(_entry(30, 59.35121, 18.0723, None, 41), steady=True),
    )
    yield "update of five, some go on as before", replace(_update(3, 4, 3, *going_on), varied=True), None


def _entry(
    number: int,
    latitude_deg: float,
    longitude_deg: float,
    velocity: tuple[int, int] | None,
    age_ticks: int = 0,
    quality: Quality | None = None,
    level: Level | None = None,
    facing: Facing | None = None,
) -> Entry:
    """With the place on the finest lattice."""
    grid = Grid(ORIGIN)
    row, column = grid.row(latitude_deg, 0), grid.column(longitude_deg, 0)
    return Entry(number, row, column, velocity, age_ticks, quality, level, facing)


def _update(resolution: int, reach_bits: int, misses: int, *entries: Entry) -> Update:
    """Of now, with the places on the lattice of this resolution: lattices are nested."""
    nested = (replace(each, row=each.row >> resolution, column=each.column >> resolution) for each in entries)
    return Update(NOW_NS * 10 // S, resolution, reach_bits, misses, tuple(nested))


def layout_document() -> dict[str, Any]:
    """Tables and structure, for a generic reader of fields."""
    return {
        "header": _table(layout.HEADER),
        "kind_bits": layout.KIND_BITS,
        "tables": {
            name: {"by": list(by), "numbers": list(numbers)} for name, (by, numbers) in TABLES.items()
        },
        "kinds": {str(int(kind)): [_part(part) for part in parts] for kind, parts in STRUCTURE.items()},
    }


def _part(part: Part) -> dict[str, Any]:
    return {
        "fields": _table(part.fields),
        "repeat": part.repeat,
        "then_bytes": part.then_bytes,
        "rice": part.rice,
        "while_left": part.while_left,
    }


def _table(fields: Sequence[Field]) -> list[dict[str, Any]]:
    return [{"name": field.name, "bits": field.bits, "when": dict(field.when)} for field in fields]


def frames_document(tag_bytes: TagBytes) -> dict[str, Any]:
    """Sealed frames with what is in them; the first has a full header, the others follow it at once."""
    keys = NetKeys(GROUP_KEY, NET, tag_bytes)
    sealer, opener = Sealer(keys, SENDER, MemoryCounters(epoch=211_000_000)), Opener(keys)
    codec = Codec(ORIGIN)
    references = References(codec.grid)
    frames = []
    for name, content, asked in contents():
        frame = sealer.seal(codec.encode(SENDER, content, 3, 240, asked), NOW_NS)
        opened = opener.open(frame)
        told = codec.decode(SENDER, opened.payload, NOW_NS).content
        frames.append(
            {
                "shows": name,
                "frame": frame.hex(),
                "full": read_header(frame).full is not None,
                "epoch": opened.epoch,
                "counter": opened.counter,
                "payload": opened.payload.hex(),
                "values": values_of(opened.payload),
                "means": [_meaning(item) for item in meant(opened, told, references)],
            }
        )
    return {
        "group_key": GROUP_KEY.hex(),
        "net": NET,
        "tag_bytes": tag_bytes,
        "sender": SENDER,
        "now_ticks": NOW_NS * 10 // S,
        "origin": asdict_of(ORIGIN),
        "frames": frames,
    }


def values_of(payload: bytes) -> list[dict[str, Any]]:
    """The fields of a payload as they stand there, part by part, repeated ones one after the other."""
    reader = BitReader(payload)
    kind = Kind(reader.take(layout.KIND_BITS))
    known: dict[str, int] = {}
    found: list[dict[str, Any]] = []
    for part in STRUCTURE[kind]:
        for index in range(_value(part.repeat, known | {"left": reader.left})):
            if index and not known.get("counted") and reader.left < part.while_left:
                break
            gap = {"gap": reader.take_rice(_value(part.rice, known))} if part.rice and index else {}
            values = _read(reader, part.fields, known)
            found.append(gap | values)
            known = known | values if part.repeat == "1" else known
        if part.then_bytes:
            found.append({"bytes": reader.take_bytes(known[part.then_bytes]).hex()})
    reader.finish()
    return found


def _read(reader: BitReader, fields: Sequence[Field], known: Mapping[str, int]) -> dict[str, int]:
    """The fields that are there; in their conditions, those that are not count as 0."""
    values: dict[str, int] = {}
    for field in fields:
        before = {**known, **values}
        if all(before.get(name, 0) == value for name, value in field.when):
            values[field.name] = reader.take(_value(field.bits, before))
    return values


def _value(expression: int | str, known: Mapping[str, int]) -> int:
    """What `STRUCTURE` and the layout's tables say in words; fields that are not there count as 0."""
    expressions: dict[int | str, Callable[[], int]] = {
        "1": lambda: 1,
        "count + 1": lambda: known.get("count", 0) + 1,
        "frames + 1": lambda: known["frames"] + 1,
        "asked ? among : 0": lambda: known.get("among", 0),
        "unread == 15 ? 0 : unread": lambda: known["unread"] % 15,
        "left >= 8 ? 1 : 0": lambda: int(known["left"] >= 8),
        "2 * gap_code": lambda: 2 * known.get("gap_code", 0),
        "counted ? count + 1 : own ? 1 : 64": lambda: (
            known["count"] + 1 if known.get("counted") else 1 if known["own"] else 64
        ),
        "4 · span + 4": lambda: 4 * known["span"] + 4,
        "reach": lambda: layout.LATTICES[known.get("lattice", known.get("wide", 0))][1],
        layout.NEAR_REACH: lambda: _value("reach", known) + layout.NEAR_BITS,
        layout.FAR_REACH: lambda: _value("reach", known) + layout.FAR_BITS,
    }
    if expression in expressions:
        return expressions[expression]()
    return expression if isinstance(expression, int) else known[expression]


def meant(opened: Opened, content: Content, references: References) -> Sequence[Report | Notice]:
    """What a receiver makes of a frame that has heard all before: reports and notices."""
    frame = opened.sender, opened.epoch, opened.counter
    references.heard(*frame)
    match content:
        case Reports():
            references.told(*frame, content, NOW_NS)
            return content.reports
        case Update():
            return references.resolve(*frame, content, NOW_NS)
        case Acknowledgement() | Request() | Fragment() | Feedback():
            return ()
        case _:
            return (content,)


def _meaning(item: Report | Notice) -> dict[str, Any]:
    """Who, when, where, how fast, and text."""
    names = ("number", "time_ns", "latitude_deg", "longitude_deg", "height_m", "text")
    motion = ("east_m_s", "north_m_s", "floor", "facing_deg")
    return {name: getattr(item, name) for name in (*names, *motion) if hasattr(item, name)}


def asdict_of(origin: Origin) -> dict[str, float]:
    """The origin's numbers."""
    return {str(name): float(value) for name, value in msgspec.structs.asdict(origin).items()}


def documents() -> dict[str, dict[str, Any]]:
    """Every file's content by its name."""
    return {
        "layout.json": layout_document(),
        "frames-8.json": frames_document(8),
        "frames-4.json": frames_document(4),
    }


def text_of(document: Mapping[str, Any]) -> bytes:
    """A document as it stands in its file."""
    return msgspec.json.format(msgspec.json.encode(document), indent=1) + b"\n"


def main() -> None:
    """Write all files."""
    FOLDER.mkdir(exist_ok=True)
    for name, document in documents().items():
        (FOLDER / name).write_bytes(text_of(document))
        sys.stdout.write(f"{FOLDER / name}\n")


if __name__ == "__main__":
    main()
