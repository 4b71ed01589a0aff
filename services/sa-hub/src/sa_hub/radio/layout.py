"""The frame's layout, version 3: tables of fields that the codec walks and the manual is generated from."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from sa_hub.radio.bits import BitReader, BitWriter

VERSION: Final = 3
EPOCH_BITS: Final = 30
COUNTER_BITS: Final = 18
COUNTER_LOW_BITS: Final = 3
KIND_BITS: Final = 4


class Kind(IntEnum):
    """What a frame's payload is: its first 4 bits. 10 to 15 are free."""

    SELF = 0
    SQUAD = 1
    ALERT = 2
    OBSERVATION = 3
    STATUS = 4
    SQUAD_UPDATE = 5
    ACKNOWLEDGEMENT = 6
    REQUEST = 7
    FRAGMENT = 8
    FEEDBACK = 9


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
    """``known`` and the fields that are there; FrameError when the bits end.

    `Field.present` and `Field.width` written out: half of what merging a heard report costs passes here.
    """
    values = dict(known)
    for field in fields:
        for name, value in field.when:
            if values.get(name) != value:
                break
        else:
            bits = field.bits
            values[field.name] = reader.take(bits if isinstance(bits, int) else values[bits])
    return values


HEADER: Final = (
    Field("version", 2, str(VERSION)),
    Field("sender", 10, "the sending hub's number in the roster"),
    Field("full", 1, "1: epoch and the counter's high bits follow"),
    Field("counter_low", COUNTER_LOW_BITS, "the frame counter's low bits"),
    Field("epoch", EPOCH_BITS, "the sender's epoch on this net, seconds since 2020", (("full", 1),)),
    Field("counter_high", COUNTER_BITS - COUNTER_LOW_BITS, "the counter's high bits", (("full", 1),)),
)

PAYLOAD: Final = (
    Field(
        "kind",
        KIND_BITS,
        "0 own report, 1 squad report, 2 alert, 3 observation, 4 status, 5 squad update, "
        "6 acknowledgement, 7 request, 8 fragment, 9 feedback",
    ),
)

SHORT_HEADER_BYTES: Final = 2
FULL_HEADER_BYTES: Final = 8

_NEAR, _FAR, _HEIGHT = ("far", 0), ("far", 1), ("has_height", 1)

_PLACE: Final = (
    Field("exercise", 1, "1: exercise, not real"),
    Field("time", 16, "of the newest report: 0.1 s ticks since 1970, modulo 65,536"),
    Field("resolution", 3, "cells of 180°/2^26 · 2^resolution: 0.30 m to 38 m of latitude"),
    Field("far", 1, "0: anchor modulo 32,768 cells, nearest to the realm's origin; 1: anchor in full"),
    Field("latitude", 15, "the anchor's row of cells, low bits", (_NEAR,)),
    Field("longitude", 15, "the anchor's column of cells, low bits", (_NEAR,)),
    Field("far_latitude", 26, "the anchor's south edge: 180°/2^26 from −90°", (_FAR,)),
    Field("far_longitude", 27, "the anchor's west edge: 180°/2^26 from −180°", (_FAR,)),
    Field("has_height", 1, "1: heights are known"),
    Field("height", 8, "m above the ellipsoid modulo 256, nearest to the origin's", (_HEIGHT, _NEAR)),
    Field("far_height", 14, "m above the ellipsoid, from −1,024", (_HEIGHT, _FAR)),
)
_MOTION: Final = (
    Field("moving", 1, "0: standing"),
    Field("direction", 4, "of motion, 1/16 turn clockwise from true north", (("moving", 1),)),
    Field("speed", 4, "0.3 m/s · 1.28^code", (("moving", 1),)),
)
_FACING: Final = "of the body: 1/16 turn clockwise from true north"
_DETAIL: Final = (
    Field("detail", 1, "0: condition ok, floor and facing unknown"),
    Field("condition", 2, "0 ok, 1 busy, 2 wounded, 3 out", (("detail", 1),)),
    Field("has_floor", 1, "1: floor is known", (("detail", 1),)),
    Field("floor", 7, "floor, from −32", (("has_floor", 1),)),
    Field("has_facing", 1, "1: facing is known", (("detail", 1),)),
    Field("facing", 4, _FACING, (("has_facing", 1),)),
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
_TOLD, _PLAIN, _NEAR_NUMBER = (("usual", 0),), (("usual", 0), ("plain", 0)), (("own", 0), ("near", 1))
_SPREAD: Final = (("own", 0), ("usual", 0))
LATTICES: Final = (
    *((3, reach) for reach in (3, 4, 5, 6, 7, 9)),
    *((4, reach) for reach in (3, 5, 8)),
    *((2, reach) for reach in (4, 5, 6, 8)),
    *((1, reach) for reach in (5, 6, 8)),
)
"""What places in updates are told on, by code: cells of 180°/2^26 · 2^first, modulo 2^second of them."""
USUAL_LATTICES: Final = ((3, 3), (3, 4))
"""Those of the usual update, by its bit `wide`."""
MISSES: Final = (0, 1, 2, 3, 4, 6, 9, 14)
"""How many frames a receiver may have missed and still resolve an update, by code."""
UPDATE: Final = (
    Field("exercise", 1, "1: exercise, not real"),
    Field("time", 8, "the frame's: 0.1 s ticks since 1970, modulo 256"),
    Field("usual", 1, "1: only for who missed nothing since it last heard of a soldier, plain, g = 0"),
    Field("wide", 1, "the lattice is (3, 3 + wide)", (("usual", 1),)),
    Field("lattice", 4, "of (resolution, reach): " + ", ".join(f"({r}, {b})" for r, b in LATTICES), _TOLD),
    Field("misses", 3, f"code of {', '.join(map(str, MISSES))}: for who missed no more", _TOLD),
    Field("plain", 1, "1: the next three are 0", _TOLD),
    Field("paced", 1, "0: speeds of people on foot; 1: all speeds", _PLAIN),
    Field("detailed", 1, "1: some soldier's quality, level or facing has changed", _PLAIN),
    Field("aged", 1, "1: some soldier's report is older than 2 s", _PLAIN),
    Field(
        "varied",
        1,
        "1: each soldier tells whether it needs more bits, and whether it goes on as before",
        _TOLD,
    ),
    Field("still", 1, "1: all that are not steady stand"),
    Field("own", 1, "1: the sender tells of itself only"),
    Field("near", 1, "1: the first number is near the sender's", (("own", 0),)),
    Field("beside", 4, "the first number less the sender's, plus 8", _NEAR_NUMBER),
    Field("first", 10, "the first number in the roster", (("own", 0), ("near", 0))),
    Field("counted", 1, "0: soldiers follow as long as 7 bits or more are left", (("own", 0),)),
    Field("count", 6, "soldiers, less one", (("counted", 1),)),
    Field("gap_code", 2, "g: the parameter of the gaps' Rice code is k = 2 g, else 0", _SPREAD),
)
_MOVES, _QUALITY, _LEVEL = ("moving", 1), ("quality", 1), ("level", 1)
_VARIED, _CHANGED = (("varied", 1),), (("changed", 1),)
_SAME_REACH, _CLOSE, _FAR_OFF = (("varied", 0),), (*_VARIED, ("far", 0)), (*_VARIED, ("far", 1))
_COLUMN, _ROW = "column of cells, low bits", "row of cells, low bits"
NEAR_BITS, FAR_BITS = -1, 2
"""What an entry's reach is more than its frame's, in a frame in which it varies."""
NEAR_REACH, FAR_REACH = f"reach - {-NEAR_BITS}", f"reach + {FAR_BITS}"
ENTRY: Final = (
    Field("far", 1, "1: more low bits of its place follow", _VARIED),
    Field("steady", 1, "1: velocity as told before", _VARIED),
    Field("east", "reach", _COLUMN, _SAME_REACH),
    Field("north", "reach", _ROW, _SAME_REACH),
    Field("east", NEAR_REACH, _COLUMN, _CLOSE),
    Field("north", NEAR_REACH, _ROW, _CLOSE),
    Field("east", FAR_REACH, _COLUMN, _FAR_OFF),
    Field("north", FAR_REACH, _ROW, _FAR_OFF),
    Field("age", 8, "of the report at the frame's time, as in a squad report", (("aged", 1),)),
    Field("moving", 1, "0: standing", (("still", 0), ("steady", 0))),
    Field("direction", 4, "of motion, 1/16 turn clockwise from true north", (_MOVES,)),
    Field("pace", 2, "0.49, 0.81, 1.32, 2.16 m/s", (_MOVES, ("paced", 0))),
    Field("speed", 4, "0.3 m/s · 1.28^code", (_MOVES, ("paced", 1))),
    Field("changed", 1, "1: the next three follow, else they are 0", (("detailed", 1),)),
    Field("quality", 1, "1: accuracy, mode, hops and condition follow; 0: as told before", _CHANGED),
    Field("accuracy", 3, _ACCURACY, (_QUALITY,)),
    Field("mode", 3, _MODE, (_QUALITY,)),
    Field("hops", 2, "relays passed, this transmission included if it is one", (_QUALITY,)),
    Field("condition", 2, "0 ok, 1 busy, 2 wounded, 3 out", (_QUALITY,)),
    Field("level", 1, "1: floor and height follow; 0: as told before", _CHANGED),
    Field("has_floor", 1, "1: floor is known", (_LEVEL,)),
    Field("floor", 7, "floor, from −32", (("has_floor", 1),)),
    Field("has_height", 1, "1: height is known", (_LEVEL,)),
    Field("height", 8, "m above the ellipsoid, low bits, nearest to what was told before", (_HEIGHT,)),
    Field("turned", 1, "1: facing follows; 0: as told before", _CHANGED),
    Field("has_facing", 1, "1: facing is known", (("turned", 1),)),
    Field("facing", 4, _FACING, (("has_facing", 1),)),
)
GAP: Final = Field("gap", "Rice", "from the second on: numbers left out since the previous soldier's")
FEEDBACK: Final = (
    Field("about", 10, "whose frames were heard"),
    Field("newest", 8, "the newest of them: its counter's low bits"),
    Field("span", 3, "length of what follows, in steps of four"),
    Field("heard", "4 · span + 4", "the counters before the newest, bit 0 the one right before: 1 heard"),
)
FEEDBACK_ALONE: Final = (Field("exercise", 1, "1: exercise, not real"),)
_NOTICE: Final = (
    Field("exercise", 1, "1: exercise, not real"),
    Field("time", 16, "of the event: 0.1 s ticks since 1970, modulo 65,536"),
    Field("number", 10, "whose it is"),
    Field("hops", 2, "relays passed"),
)
_ASKED: Final = (
    Field("asked", 1, "1: to be acknowledged"),
    Field("among", 3, "0: by everybody, else by so many, whose numbers follow", (("asked", 1),)),
)
ASKED: Final = (Field("number", 10, "who is to acknowledge"),)
ALERT: Final = (
    *_NOTICE,
    *_ASKED,
    Field("alert", 3, "0 contact, 1 casualty, 2 help, 3 fire, 4 withdraw, 5 other"),
    Field("text_bytes", 8, "length of the UTF-8 text that follows"),
)
OBSERVATION: Final = (
    *_NOTICE,
    *_ASKED,
    Field("code", 6, "what it is: 0 see the text, else by the table of codes"),
    Field("far_latitude", 26, "cell of 180°/2^26, from −90°"),
    Field("far_longitude", 27, "cell of 180°/2^26, from −180°"),
    Field("accuracy", 3, _ACCURACY),
    Field("text_bytes", 8, "length of the UTF-8 text that follows"),
)
ACKNOWLEDGEMENT: Final = (
    Field("exercise", 1, "1: exercise, not real"),
    Field("frames", 3, "frames acknowledged, less one"),
)
ACKNOWLEDGED: Final = (
    Field("of", 10, "who sent the frame"),
    Field("counted", 8, "its counter's low bits"),
)
REQUEST: Final = (
    Field("exercise", 1, "1: exercise, not real"),
    Field("known", 6, "how many soldiers the asker knows where they are; 63: or more"),
    Field("unread", 4, "so many numbers follow: whose frames it cannot open; 15: nobody's"),
)
UNREAD: Final = (Field("number", 10, "who is to send full headers"),)
FRAGMENT: Final = (
    Field("exercise", 1, "1: exercise, not real"),
    *_ASKED,
    Field("message", 6, "which payload this is a part of, counted by its sender"),
    Field("index", 4, "which part"),
    Field("last", 4, "parts, less one"),
    Field("data_bytes", 8, "length of the part, which follows"),
)
STATUS: Final = (
    *_NOTICE,
    Field("condition", 2, "0 ok, 1 busy, 2 wounded, 3 out"),
    Field("has_battery", 1, "1: battery is known"),
    Field("battery", 7, "percent", (("has_battery", 1),)),
)

SECTIONS: Final[tuple[tuple[str, tuple[Field, ...]], ...]] = (
    ("Header (in clear, authenticated)", HEADER),
    ("Payload (encrypted), first of all", PAYLOAD),
    ("Own report (kind 0)", SELF),
    ("Squad report (kind 1)", SQUAD),
    ("Squad report, once for each soldier", SOLDIER),
    ("Squad update (kind 5)", UPDATE),
    ("Squad update, once for each soldier, by number", (GAP, *ENTRY)),
    ("Feedback (after the last field of kinds 0, 1 and 5, if 8 bits or more are left)", FEEDBACK),
    ("Feedback alone (kind 9), before the same fields", FEEDBACK_ALONE),
    ("Alert (kind 2)", ALERT),
    ("Observation (kind 3)", OBSERVATION),
    ("Status (kind 4)", STATUS),
    ("Acknowledgement (kind 6)", ACKNOWLEDGEMENT),
    ("Acknowledgement, once for each frame", ACKNOWLEDGED),
    ("Request (kind 7)", REQUEST),
    ("Request, once for each number", UNREAD),
    ("Fragment of an observation (kind 8)", FRAGMENT),
    ("Alert, observation and fragment: once for each who is asked, before the text", ASKED),
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
