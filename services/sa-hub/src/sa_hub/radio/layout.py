"""The frame's layout, version 1: tables of fields that the codec walks and the manual is generated from."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from sa_hub.radio.bits import BitReader, BitWriter

VERSION: Final = 1
EPOCH_BITS: Final = 30
COUNTER_BITS: Final = 18
COUNTER_LOW_BITS: Final = 8


class Kind(IntEnum):
    """What a frame's payload is."""

    SELF = 0
    SQUAD = 1
    ALERT = 2
    OBSERVATION = 3
    STATUS = 4


@dataclass(frozen=True, slots=True)
class Field:
    """One field: its width in bits (or the field that tells it) and the fields it depends on."""

    name: str
    bits: int | str
    meaning: str
    when: tuple[tuple[str, int], ...] = ()

    def present(self, values: Mapping[str, int]) -> bool:
        """Whether the fields before call for this one."""
        return all(values.get(name) == value for name, value in self.when)

    def width(self, values: Mapping[str, int]) -> int:
        """Width in bits, given the fields before."""
        return self.bits if isinstance(self.bits, int) else values[self.bits]


def write_fields(writer: BitWriter, fields: Iterable[Field], values: Mapping[str, int]) -> None:
    """Append those fields that their conditions call for."""
    for field in fields:
        if field.present(values):
            writer.put(values[field.name], field.width(values))


def read_fields(reader: BitReader, fields: Iterable[Field], known: Mapping[str, int]) -> dict[str, int]:
    """``known`` and the fields that are there; FrameError when the bits end."""
    values = dict(known)
    for field in fields:
        if field.present(values):
            values[field.name] = reader.take(field.width(values))
    return values


HEADER: Final = (
    Field("version", 2, "1"),
    Field("kind", 3, "0 own report, 1 squad report, 2 alert, 3 observation, 4 status"),
    Field("sender", 10, "the sending hub's number in the roster"),
    Field("full", 1, "1: epoch and the counter's high bits follow"),
    Field("counter_low", COUNTER_LOW_BITS, "the frame counter's low bits"),
    Field("epoch", EPOCH_BITS, "the sender's epoch on this net, seconds since 2020", (("full", 1),)),
    Field("counter_high", COUNTER_BITS - COUNTER_LOW_BITS, "the counter's high bits", (("full", 1),)),
)

SHORT_HEADER_BYTES: Final = 3
FULL_HEADER_BYTES: Final = 8

_NEAR, _FAR, _HEIGHT = ("far", 0), ("far", 1), ("has_height", 1)

_PLACE: Final = (
    Field("exercise", 1, "1: exercise, not real"),
    Field("time", 16, "of the newest report: 0.1 s ticks since 1970, modulo 65,536"),
    Field("resolution", 3, "cells of 180°/2^26 · 2^resolution: 0.30 m to 38 m of latitude"),
    Field("far", 1, "0: anchor modulo 65,536 cells, nearest to the realm's origin; 1: anchor in full"),
    Field("latitude", 16, "the anchor's row of cells, low bits", (_NEAR,)),
    Field("longitude", 16, "the anchor's column of cells, low bits", (_NEAR,)),
    Field("far_latitude", 26, "the anchor's south edge: 180°/2^26 from −90°", (_FAR,)),
    Field("far_longitude", 27, "the anchor's west edge: 180°/2^26 from −180°", (_FAR,)),
    Field("has_height", 1, "1: heights are known"),
    Field("height", 8, "m above the ellipsoid modulo 256, nearest to the origin's", (_HEIGHT, _NEAR)),
    Field("far_height", 14, "m above the ellipsoid, from −1,024", (_HEIGHT, _FAR)),
)
_MOTION: Final = (
    Field("moving", 1, "0: standing"),
    Field("direction", 5, "of motion, 1/32 turn clockwise from true north", (("moving", 1),)),
    Field("speed", 4, "0.3 m/s · 1.28^code", (("moving", 1),)),
)
_DETAIL: Final = (
    Field("detail", 1, "0: condition ok, floor unknown"),
    Field("condition", 2, "0 ok, 1 busy, 2 wounded, 3 out", (("detail", 1),)),
    Field("has_floor", 1, "1: floor is known", (("detail", 1),)),
    Field("floor", 7, "floor, from −32", (("has_floor", 1),)),
)
_ACCURACY: Final = "one sigma, not above 0.5, 1, 2, 4, 8, 16, 50 m; 7: worse or unknown"
_MODE: Final = "0 unplaced, 1 gnss, 2 boots, 3 body, 4 camera, 5 coasting, 6 lost"

SELF: Final = (
    *_PLACE,
    *_MOTION,
    Field("accuracy", 3, _ACCURACY),
    Field("mode", 3, _MODE),
    *_DETAIL,
)
SQUAD: Final = (
    *_PLACE,
    Field("count", 6, "soldiers, less one"),
    Field("offset_bits", 4, "width of the offsets east and north"),
    Field("height_bits", 3, "width of the height offsets", (_HEIGHT,)),
)
SOLDIER: Final = (
    Field("follows", 1, "1: number is the previous soldier's plus one"),
    Field("number", 10, "number in the roster", (("follows", 0),)),
    Field("east", "offset_bits", "cells east of the anchor"),
    Field("north", "offset_bits", "cells north of the anchor"),
    Field("height_known", 1, "1: this one's height is known", (_HEIGHT,)),
    Field("up", "height_bits", "m above the anchor's height", (("height_known", 1),)),
    Field("aged", 1, "0: reported at the frame's time"),
    Field(
        "age",
        8,
        "before it, rounded up: code c < 32: c ticks; else (32 + c mod 32) · 2^(c div 32 − 1)",
        (("aged", 1),),
    ),
    *_MOTION,
    Field("same", 1, "1: accuracy, mode and hops as the previous soldier's"),
    Field("accuracy", 3, _ACCURACY, (("same", 0),)),
    Field("mode", 3, _MODE, (("same", 0),)),
    Field("hops", 2, "relays passed, this transmission included if it is one", (("same", 0),)),
    *_DETAIL,
)
_NOTICE: Final = (
    Field("exercise", 1, "1: exercise, not real"),
    Field("time", 16, "of the event: 0.1 s ticks since 1970, modulo 65,536"),
    Field("number", 10, "whose it is"),
    Field("hops", 2, "relays passed"),
)
ALERT: Final = (
    *_NOTICE,
    Field("alert", 3, "0 contact, 1 casualty, 2 help, 3 fire, 4 withdraw, 5 other"),
    Field("text_bytes", 8, "length of the UTF-8 text that follows"),
)
OBSERVATION: Final = (
    *_NOTICE,
    Field("far_latitude", 26, "cell of 180°/2^26, from −90°"),
    Field("far_longitude", 27, "cell of 180°/2^26, from −180°"),
    Field("accuracy", 3, _ACCURACY),
    Field("text_bytes", 8, "length of the UTF-8 text that follows"),
)
STATUS: Final = (
    *_NOTICE,
    Field("condition", 2, "0 ok, 1 busy, 2 wounded, 3 out"),
    Field("has_battery", 1, "1: battery is known"),
    Field("battery", 7, "percent", (("has_battery", 1),)),
)

SECTIONS: Final[tuple[tuple[str, tuple[Field, ...]], ...]] = (
    ("Header (in clear, authenticated)", HEADER),
    ("Own report (kind 0)", SELF),
    ("Squad report (kind 1)", SQUAD),
    ("Squad report, once for each soldier", SOLDIER),
    ("Alert (kind 2)", ALERT),
    ("Observation (kind 3)", OBSERVATION),
    ("Status (kind 4)", STATUS),
)


def layout_markdown() -> str:
    """All tables as Markdown, as they stand in docs/radio.md."""
    return "\n\n".join(f"### {title}\n\n{_table(fields)}" for title, fields in SECTIONS)


def _table(fields: Iterable[Field]) -> str:
    rows = ["| field | bits | only when | meaning |", "| --- | --- | --- | --- |"]
    for field in fields:
        when = ", ".join(f"{name} = {value}" for name, value in field.when)
        rows.append(f"| `{field.name}` | {field.bits} | {when} | {field.meaning} |")
    return "\n".join(rows)
