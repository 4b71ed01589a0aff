"""Alerts, observations and status to bits and back; texts are cut to what the frame may hold."""

from collections.abc import Mapping, Sequence
from typing import Final

from sa_hub.radio import quantise as q
from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.content import (
    ALERT_KINDS,
    CONDITIONS,
    MAX_TEXT_CHARACTERS,
    AlertNotice,
    Notice,
    ObservationNotice,
    StatusNotice,
    cut_text,
)
from sa_hub.radio.errors import FrameError
from sa_hub.radio.layout import ALERT, OBSERVATION, STATUS, Field, Kind, read_fields, write_fields

_FINEST: Final = 0
_FULL_BATTERY_PCT: Final = 100

Values = Mapping[str, int]
Heard = tuple[bool, Notice]


def encode_notice(notice: Notice, *, exercise: bool, limit_bytes: int) -> tuple[Kind, bytes]:
    """The payload's kind and the payload; a text is cut so that all fits ``limit_bytes``."""
    common = {
        "exercise": int(exercise),
        "time": q.tick_of(notice.time_ns) % (1 << q.TIME_BITS),
        "number": notice.number,
        "hops": notice.hops,
    }
    match notice:
        case AlertNotice():
            values = common | {"alert": ALERT_KINDS.index(notice.kind)}
            return Kind.ALERT, _with_text(ALERT, values, notice.text, limit_bytes)
        case ObservationNotice():
            values = common | _observation_values(notice)
            return Kind.OBSERVATION, _with_text(OBSERVATION, values, notice.text, limit_bytes)
        case StatusNotice():
            writer = BitWriter()
            write_fields(writer, STATUS, common | _status_values(notice))
            return Kind.STATUS, writer.to_bytes()


def decode_alert(reader: BitReader, now_tick: int) -> Heard:
    """Whether it is exercise, and the alert."""
    values = read_fields(reader, ALERT, {})
    if values["alert"] >= len(ALERT_KINDS):
        raise FrameError("range", f"alert {values['alert']}")
    notice = AlertNotice(
        number=values["number"],
        time_ns=_time_ns(values, now_tick),
        kind=ALERT_KINDS[values["alert"]],
        text=_text(reader, values),
        hops=values["hops"],
    )
    return bool(values["exercise"]), notice


def decode_observation(reader: BitReader, now_tick: int) -> Heard:
    """Whether it is exercise, and the observation."""
    values = read_fields(reader, OBSERVATION, {})
    notice = ObservationNotice(
        number=values["number"],
        time_ns=_time_ns(values, now_tick),
        latitude_deg=q.cell_centre_deg(q.latitude_row(values["far_latitude"], _FINEST), _FINEST),
        longitude_deg=q.cell_centre_deg(q.longitude_column(values["far_longitude"], _FINEST), _FINEST),
        accuracy_m=q.ACCURACIES_M[values["accuracy"]],
        text=_text(reader, values),
        hops=values["hops"],
    )
    return bool(values["exercise"]), notice


def decode_status(reader: BitReader, now_tick: int) -> Heard:
    """Whether it is exercise, and the status."""
    values = read_fields(reader, STATUS, {})
    battery = values.get("battery")
    if battery is not None and battery > _FULL_BATTERY_PCT:
        raise FrameError("range", f"battery {battery} %")
    notice = StatusNotice(
        number=values["number"],
        time_ns=_time_ns(values, now_tick),
        condition=CONDITIONS[values["condition"]],
        battery_pct=None if battery is None else float(battery),
        hops=values["hops"],
    )
    return bool(values["exercise"]), notice


def _time_ns(values: Values, now_tick: int) -> int:
    return q.unwrap(values["time"], q.TIME_BITS, now_tick) * q.TICK_NS


def _observation_values(notice: ObservationNotice) -> dict[str, int]:
    return {
        "far_latitude": q.latitude_code(q.latitude_index(notice.latitude_deg, _FINEST), _FINEST),
        "far_longitude": q.longitude_code(q.longitude_index(notice.longitude_deg, _FINEST), _FINEST),
        "accuracy": q.accuracy_code(notice.accuracy_m),
    }


def _status_values(notice: StatusNotice) -> dict[str, int]:
    battery = notice.battery_pct
    return {
        "condition": CONDITIONS.index(notice.condition),
        "has_battery": int(battery is not None),
        "battery": round(battery or 0.0),
    }


def _with_text(fields: Sequence[Field], values: Values, text: str, limit_bytes: int) -> bytes:
    """All fields, then as much of the text as fits."""
    fixed_bits = sum(field.width(values) for field in fields if field.present(values))
    data = cut_text(text, (8 * limit_bytes - fixed_bits) // 8).encode()
    writer = BitWriter()
    write_fields(writer, fields, {**values, "text_bytes": len(data)})
    writer.put_bytes(data)
    return writer.to_bytes()


def _text(reader: BitReader, values: Values) -> str:
    try:
        text = reader.take_bytes(values["text_bytes"]).decode("utf-8")
    except UnicodeDecodeError as error:
        raise FrameError("text", "not UTF-8") from error
    if len(text) > MAX_TEXT_CHARACTERS:
        raise FrameError("text", f"{len(text)} characters")
    return text
