"""Reports of one or many soldiers to bits and back, against an absolute anchor in the same frame."""

from collections.abc import Mapping, Sequence
from typing import Final

from bootprint.config import Origin
from sa_hub.radio import quantise as q
from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.content import CONDITIONS, Report
from sa_hub.radio.errors import FrameError
from sa_hub.radio.layout import SELF, SOLDIER, SQUAD, read_fields, write_fields
from sa_hub.radio.squad import MAX_SOLDIERS, OFFSET_LIMIT, UP_LIMIT_M, Anchor, Offsets, anchor_of, offsets_of

MAX_NUMBER: Final = 1023
_NEAR_BITS: Final = 15
_NEAR_HEIGHT_BITS: Final = 8

Values = Mapping[str, int]
Decoded = tuple[bool, int, tuple[Report, ...]]


class ReportCodec:
    """Reports to payloads and back, for one realm: near anchors are unwrapped around its origin."""

    def __init__(self, origin: Origin, *, exercise: bool) -> None:
        self._origin = origin
        self._exercise = exercise

    def write_self(self, writer: BitWriter, report: Report, resolution: int) -> None:
        """A soldier's report of itself: no number, no age, no hops."""
        place = self._place_values(anchor_of([report], resolution))
        write_fields(writer, SELF, place | _soldier_values(report))

    def write_squad(
        self, writer: BitWriter, reports: Sequence[Report], resolution: int, tick: int | None = None
    ) -> None:
        """Reports of up to 64 soldiers, sorted by number; ValueError if they span more than a frame can say."""
        ordered = sorted(reports, key=lambda report: report.number)
        anchor = anchor_of(ordered, resolution, tick)
        offsets = [offsets_of(report, anchor) for report in ordered]
        frame = self._place_values(anchor) | _squad_values(offsets)
        write_fields(writer, SQUAD, frame)
        for previous, report, offset in zip([None, *ordered], ordered, offsets, strict=False):
            values = _soldier_values(report) | _relative_values(report, previous, offset, anchor)
            write_fields(writer, SOLDIER, frame | values)

    def decode_self(self, reader: BitReader, sender: int, now_tick: int) -> Decoded:
        """Whether it is exercise, the frame's time, and the sender's report."""
        values = read_fields(reader, SELF, {})
        anchor = self._anchor(values, now_tick)
        offsets = Offsets(0, 0, None if anchor.height is None else 0)
        relative = {"number": sender, "hops": 0}
        return bool(values["exercise"]), anchor.tick, (_report(anchor, offsets, values | relative),)

    def decode_squad(self, reader: BitReader, sender: int, now_tick: int) -> Decoded:
        """Whether it is exercise, the frame's time, and the reports, whoever sent them."""
        frame = read_fields(reader, SQUAD, {})
        anchor = self._anchor(frame, now_tick)
        reports: list[Report] = []
        values: Values = {}
        for _ in range(frame["count"] + 1):
            values = _carried_over(read_fields(reader, SOLDIER, frame), values)
            up = values["up"] if values.get("height_known") else None
            reports.append(_report(anchor, Offsets(values["east"], values["north"], up), values))
        return bool(frame["exercise"]), anchor.tick, tuple(reports)

    def _place_values(self, anchor: Anchor) -> dict[str, int]:
        height = anchor.height or 0
        return {
            "exercise": int(self._exercise),
            "time": anchor.tick % (1 << q.TIME_BITS),
            "resolution": anchor.resolution,
            "far": int(not self._is_near(anchor)),
            "latitude": anchor.row % (1 << _NEAR_BITS),
            "longitude": anchor.column % (1 << _NEAR_BITS),
            "far_latitude": q.latitude_code(anchor.row, anchor.resolution),
            "far_longitude": q.longitude_code(anchor.column, anchor.resolution),
            "has_height": int(anchor.height is not None),
            "height": height % (1 << _NEAR_HEIGHT_BITS),
            "far_height": height - q.HEIGHT_MIN_M,
        }

    def _is_near(self, anchor: Anchor) -> bool:
        row, column, height = self._origin_cell(anchor.resolution)
        east = q.wrap(anchor.column - column, q.LONGITUDE_BITS - anchor.resolution)
        reach = 1 << (_NEAR_BITS - 1)
        level = anchor.height is None or abs(anchor.height - height) < 1 << (_NEAR_HEIGHT_BITS - 1)
        return abs(anchor.row - row) < reach and abs(east) < reach and level

    def _origin_cell(self, resolution: int) -> tuple[int, int, int]:
        origin = self._origin
        return (
            q.latitude_index(origin.latitude_deg, resolution),
            q.longitude_index(origin.longitude_deg, resolution),
            q.height_index(origin.height_m),
        )

    def _anchor(self, values: Values, now_tick: int) -> Anchor:
        resolution = values["resolution"]
        place = self._far_place(values) if values["far"] else self._near_place(values)
        return Anchor(q.unwrap(values["time"], q.TIME_BITS, now_tick), resolution, *place)

    def _far_place(self, values: Values) -> tuple[int, int, int | None]:
        resolution = values["resolution"]
        row = q.latitude_row(values["far_latitude"], resolution)
        column = q.longitude_column(values["far_longitude"], resolution)
        return row, column, values["far_height"] + q.HEIGHT_MIN_M if values["has_height"] else None

    def _near_place(self, values: Values) -> tuple[int, int, int | None]:
        origin_row, origin_column, origin_height = self._origin_cell(values["resolution"])
        row = q.unwrap(values["latitude"], _NEAR_BITS, origin_row)
        column = q.unwrap(values["longitude"], _NEAR_BITS, origin_column)
        height = (
            q.unwrap(values["height"], _NEAR_HEIGHT_BITS, origin_height) if values["has_height"] else None
        )
        return row, column, height


def _soldier_values(report: Report) -> dict[str, int]:
    """Motion, quality and detail: what own and squad reports have in common."""
    velocity = q.velocity_codes(report.east_m_s, report.north_m_s)
    direction, speed = velocity or (0, 0)
    has_floor, has_facing = report.floor is not None, report.facing_deg is not None
    return {
        "moving": int(velocity is not None),
        "direction": direction,
        "speed": speed,
        "accuracy": q.accuracy_code(report.accuracy_m),
        "mode": q.MODES.index(report.mode),
        "detail": int(has_floor or has_facing or report.condition != "ok"),
        "condition": CONDITIONS.index(report.condition),
        "has_floor": int(has_floor),
        "floor": q.floor_code(report.floor or 0),
        "has_facing": int(has_facing),
        "facing": q.direction_code(report.facing_deg or 0.0),
    }


def _squad_values(offsets: Sequence[Offsets]) -> dict[str, int]:
    widest = max(max(offset.east, offset.north) for offset in offsets)
    highest = max(offset.up or 0 for offset in offsets)
    if widest > OFFSET_LIMIT or highest > UP_LIMIT_M or len(offsets) > MAX_SOLDIERS:
        raise ValueError(f"{len(offsets)} reports over {widest} cells and {highest} m do not fit one frame")
    return {
        "count": len(offsets) - 1,
        "offset_bits": widest.bit_length(),
        "height_bits": highest.bit_length(),
    }


def _relative_values(
    report: Report, previous: Report | None, offset: Offsets, anchor: Anchor
) -> dict[str, int]:
    """What a squad report says of a soldier relative to the anchor and to the soldier before."""
    age = q.age_code(anchor.tick - q.tick_of(report.time_ns))
    return {
        "follows": int(previous is not None and report.number == previous.number + 1),
        "number": report.number,
        "east": offset.east,
        "north": offset.north,
        "height_known": int(offset.up is not None),
        "up": offset.up or 0,
        "aged": int(age > 0),
        "age": age,
        "same": int(previous is not None and _quality(report) == _quality(previous)),
        "hops": report.hops,
    }


def _quality(report: Report) -> tuple[int, str, int]:
    return q.accuracy_code(report.accuracy_m), report.mode, report.hops


def _carried_over(values: dict[str, int], previous: Values) -> dict[str, int]:
    """Fill in what a soldier has from the one before; FrameError if there is none."""
    if not previous and (values["follows"] or values["same"]):
        raise FrameError("layout", "the first soldier refers to one before")
    if values["follows"]:
        values["number"] = previous["number"] + 1
    if values["same"]:
        values |= {name: previous[name] for name in ("accuracy", "mode", "hops")}
    if values["number"] > MAX_NUMBER:
        raise FrameError("range", f"soldier number {values['number']}")
    return values


def _report(anchor: Anchor, offsets: Offsets, values: Values) -> Report:
    """One soldier's values in physical units; FrameError if they lie beyond what there is."""
    row = anchor.row + offsets.north
    if not q.is_row(row, anchor.resolution):
        raise FrameError("range", f"latitude row {row} is beyond the pole")
    if values["mode"] >= len(q.MODES):
        raise FrameError("range", f"mode {values['mode']}")
    column = q.wrap(anchor.column + offsets.east, q.LONGITUDE_BITS - anchor.resolution)
    moving = values["moving"]
    east_m_s, north_m_s = q.velocity_of(values["direction"], values["speed"]) if moving else (0.0, 0.0)
    height_m = None
    if anchor.height is not None and offsets.up is not None:
        height_m = float(anchor.height + offsets.up)
    return Report(
        number=values["number"],
        time_ns=(anchor.tick - q.age_ticks(values.get("age", 0))) * q.TICK_NS,
        latitude_deg=q.cell_centre_deg(row, anchor.resolution),
        longitude_deg=q.cell_centre_deg(column, anchor.resolution),
        accuracy_m=q.ACCURACIES_M[values["accuracy"]],
        east_m_s=east_m_s,
        north_m_s=north_m_s,
        height_m=height_m,
        mode=q.MODES[values["mode"]],
        floor=values["floor"] + q.FLOOR_MIN if values.get("has_floor") else None,
        condition=CONDITIONS[values.get("condition", 0)],
        hops=values["hops"],
        cell_m=q.cell_m(anchor.resolution),
        facing_deg=q.direction_deg(values["facing"]) if values.get("has_facing") else None,
    )
