"""Squad updates to bits and back: places modulo a lattice, only what has changed, numbers as gaps.

What an update means needs what was told before: `references` turns it into reports.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Final

from sa_hub.radio import quantise as q
from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.content import Entry, Facing, Level, Quality, Update
from sa_hub.radio.errors import FrameError
from sa_hub.radio.layout import (
    ENTRY,
    FAR_BITS,
    FAR_REACH,
    LATTICES,
    MISSES,
    NEAR_BITS,
    NEAR_REACH,
    UPDATE,
    USUAL_LATTICES,
    read_fields,
    write_fields,
)
from sa_hub.radio.report_codec import MAX_NUMBER

MAX_ENTRIES: Final = 64
_BESIDE: Final = 8
TIME_MODULUS: Final = 1 << 8
HEIGHT_MODULUS: Final = 1 << 8
_GAP_CODES: Final = 4

_LEAST_ENTRY: Final = 7
_USUAL: Final = tuple(LATTICES.index(lattice) for lattice in USUAL_LATTICES)

_DEFAULTS: Final = dict.fromkeys(
    ("misses", "paced", "detailed", "aged", "varied", "gap_code", "far", "steady"), 0
)

Values = Mapping[str, int]


def write_update(writer: BitWriter, update: Update, sender: int, *, exercise: bool) -> None:
    """Append an update, whose entries are sorted by number; the feedback does not belong to it.

    How many there are shows by the payload's end, unless something follows or the padding looks like one more.
    """
    numbers = [entry.number for entry in update.entries]
    frame = _frame_values(update, numbers, sender) | {"exercise": int(exercise)}
    entries = _entries(update, numbers, frame)
    uncounted = BitWriter()
    uncounted.put_all(writer)
    write_fields(uncounted, UPDATE, frame | {"counted": 0})
    uncounted.put_all(entries)
    counted = not frame["own"] and (update.feedback is not None or uncounted.padding >= _LEAST_ENTRY)
    write_fields(writer, UPDATE, frame | {"counted": int(counted)})
    writer.put_all(entries)


def _entries(update: Update, numbers: Sequence[int], frame: Values) -> BitWriter:
    writer = BitWriter()
    for previous, entry in zip([None, *numbers], update.entries, strict=False):
        if previous is not None:
            writer.put_rice(entry.number - previous - 1, 2 * frame["gap_code"])
        values = _entry_values(entry, update.reach_of(entry), paced=bool(frame["paced"]))
        write_fields(writer, ENTRY, {**frame, **values})
    return writer


def read_update(reader: BitReader, sender: int) -> tuple[bool, Update]:
    """Whether it is exercise, and the update; FrameError if it says something impossible."""
    frame = _DEFAULTS | read_fields(reader, UPDATE, {})
    lattice = _USUAL[frame["wide"]] if frame["usual"] else frame["lattice"]
    resolution, reach = LATTICES[lattice]
    frame |= _reaches(reach)
    update = Update(
        tick=frame["time"],
        resolution=resolution,
        reach_bits=reach,
        misses=MISSES[frame["misses"]],
        entries=tuple(_read_entries(reader, frame, sender)),
        varied=bool(frame["varied"]),
    )
    return bool(frame["exercise"]), update


def _read_entries(reader: BitReader, frame: Values, sender: int) -> Iterator[Entry]:
    number = sender if frame["own"] else _first_number(frame, sender)
    count = 0 if frame["own"] else frame.get("count", MAX_ENTRIES)
    for index in range(count + 1):
        if index and "count" not in frame and reader.left < _LEAST_ENTRY:
            return
        number += reader.take_rice(2 * frame["gap_code"]) + 1 if index else 0
        if not 0 <= number <= MAX_NUMBER or index == MAX_ENTRIES:
            raise FrameError("range", f"soldier number {number}, the {index + 1}th")
        yield _entry(number, read_fields(reader, ENTRY, frame))


def best_gap_code(numbers: Sequence[int]) -> int:
    """The code of the Rice parameter that makes the gaps between these sorted numbers shortest."""
    gaps = [after - before - 1 for before, after in pairwise(numbers)]
    return min(range(_GAP_CODES), key=lambda code: sum((gap >> 2 * code) + 1 + 2 * code for gap in gaps))


def _reaches(reach: int) -> dict[str, int]:
    """The widths that the layout knows by these names."""
    return {"reach": reach, NEAR_REACH: reach + NEAR_BITS, FAR_REACH: reach + FAR_BITS}


def _frame_values(update: Update, numbers: Sequence[int], sender: int) -> dict[str, int]:
    beside = numbers[0] - sender + _BESIDE
    paced = any(entry.velocity and entry.velocity[1] not in q.PACES for entry in update.entries)
    detailed = any(_changed(entry) for entry in update.entries)
    aged = any(entry.age_ticks for entry in update.entries)
    plain = not (paced or detailed or aged)
    gap_code = best_gap_code(numbers)
    lattice = LATTICES.index((update.resolution, update.reach_bits))
    return {
        "time": update.tick % TIME_MODULUS,
        "usual": int(
            plain and not update.varied and update.misses == 0 and lattice in _USUAL and gap_code == 0
        ),
        "wide": int(lattice == _USUAL[1]),
        "lattice": lattice,
        **_reaches(update.reach_bits),
        "misses": MISSES.index(update.misses),
        "plain": int(plain),
        "paced": int(paced),
        "detailed": int(detailed),
        "aged": int(aged),
        "varied": int(update.varied),
        "still": int(not any(entry.velocity for entry in update.entries)),
        "own": int(numbers == [sender]),
        "near": int(0 <= beside < 2 * _BESIDE),
        "beside": beside % (2 * _BESIDE),
        "first": numbers[0],
        "count": len(numbers) - 1,
        "gap_code": gap_code,
    }


def _entry_values(entry: Entry, reach_bits: int, *, paced: bool) -> dict[str, int]:
    direction, speed = entry.velocity or (0, 0)
    quality, level = entry.quality or Quality(0, 0, 0, 0), entry.level or Level(None, None)
    facing = None if entry.facing is None else entry.facing.direction
    return {
        "far": int(entry.far),
        "steady": int(entry.steady),
        "east": entry.column % (1 << reach_bits),
        "north": entry.row % (1 << reach_bits),
        "age": q.age_code(entry.age_ticks),
        "moving": int(entry.velocity is not None),
        "direction": direction,
        "pace": 0 if paced or entry.velocity is None else q.PACES.index(speed),
        "speed": speed,
        "changed": int(_changed(entry)),
        "quality": int(entry.quality is not None),
        "accuracy": quality.accuracy,
        "mode": quality.mode,
        "hops": quality.hops,
        "condition": quality.condition,
        "level": int(entry.level is not None),
        "has_floor": int(level.floor is not None),
        "floor": q.floor_code(level.floor or 0),
        "has_height": int(level.height_m is not None),
        "height": (level.height_m or 0) % HEIGHT_MODULUS,
        "turned": int(entry.facing is not None),
        "has_facing": int(facing is not None),
        "facing": facing or 0,
    }


def _changed(entry: Entry) -> bool:
    return entry.quality is not None or entry.level is not None or entry.facing is not None


def _first_number(frame: Values, sender: int) -> int:
    return sender + frame["beside"] - _BESIDE if frame["near"] else frame["first"]


def _entry(number: int, values: Values) -> Entry:
    velocity = None
    if values.get("moving"):
        velocity = values["direction"], values["speed"] if values["paced"] else q.PACES[values["pace"]]
    return Entry(
        number=number,
        row=values["north"],
        column=values["east"],
        velocity=velocity,
        age_ticks=q.age_ticks(values.get("age", 0)),
        quality=_quality(values) if values.get("quality") else None,
        level=_level(values) if values.get("level") else None,
        facing=Facing(values["facing"] if values["has_facing"] else None) if values.get("turned") else None,
        far=bool(values.get("far")),
        steady=bool(values.get("steady")),
    )


def _quality(values: Values) -> Quality:
    if values["mode"] >= len(q.MODES):
        raise FrameError("range", f"mode {values['mode']}")
    return Quality(values["accuracy"], values["mode"], values["hops"], values["condition"])


def _level(values: Values) -> Level:
    floor = values["floor"] + q.FLOOR_MIN if values["has_floor"] else None
    height_m = values["height"] if values["has_height"] else None
    return Level(floor, height_m)
