"""Alerts, observations and status to bits and back; texts are cut to what the frame may hold."""

from collections.abc import Mapping, Sequence
from typing import Final

from bootprint.messages import ObservationCode
from sa_hub.radio import quantise as q
from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.content import (
    ALERT_KINDS,
    CONDITIONS,
    MAX_TEXT_CHARACTERS,
    OBSERVATION_CODES,
    AlertNotice,
    Notice,
    ObservationNotice,
    StatusNotice,
    cut_text,
)
from sa_hub.radio.control import Asked
from sa_hub.radio.control_codec import asked_values, read_asked, write_asked
from sa_hub.radio.errors import FrameError
from sa_hub.radio.layout import (
    ALERT,
    ASKED,
    KIND_BITS,
    OBSERVATION,
    STATUS,
    Field,
    Kind,
    read_fields,
    write_fields,
)

_FINEST: Final = 0
_FULL_BATTERY_PCT: Final = 100

Values = Mapping[str, int]
Heard = tuple[bool, Notice, Asked | None]


def encode_notice(notice: Notice, *, exercise: bool, limit_bytes: int, asked: Asked | None) -> bytes:
    """The payload; a text is cut so that all fits ``limit_bytes``. Status is never acknowledged."""
    common = {
        "exercise": int(exercise),
        "time": q.tick_of(notice.time_ns) % (1 << q.TIME_BITS),
        "number": notice.number,
        "hops": notice.hops,
    }
    match notice:
        case AlertNotice():
            values = common | {"alert": ALERT_KINDS.index(notice.kind)}
            return _with_text(Kind.ALERT, values, asked, notice.text, limit_bytes)
        case ObservationNotice():
            values = common | _observation_values(notice)
            return _with_text(Kind.OBSERVATION, values, asked, notice.text, limit_bytes)
        case StatusNotice():
            writer = _writer_of(Kind.STATUS)
            write_fields(writer, STATUS, common | _status_values(notice))
            return writer.to_bytes()


def decode_alert(reader: BitReader, now_tick: int) -> Heard:
    """Whether it is exercise, the alert, and who is to acknowledge it."""
    values = read_fields(reader, ALERT, {})
    asked = read_asked(reader, values)
    if values["alert"] >= len(ALERT_KINDS):
        raise FrameError("range", f"alert {values['alert']}")
    notice = AlertNotice(
        number=values["number"],
        time_ns=_time_ns(values, now_tick),
        kind=ALERT_KINDS[values["alert"]],
        text=_text(reader, values),
        hops=values["hops"],
    )
    return bool(values["exercise"]), notice, asked


def decode_observation(reader: BitReader, now_tick: int) -> Heard:
    """Whether it is exercise, the observation, and who is to acknowledge it."""
    values = read_fields(reader, OBSERVATION, {})
    asked = read_asked(reader, values)
    notice = ObservationNotice(
        number=values["number"],
        time_ns=_time_ns(values, now_tick),
        latitude_deg=q.cell_centre_deg(q.latitude_row(values["far_latitude"], _FINEST), _FINEST),
        longitude_deg=q.cell_centre_deg(q.longitude_column(values["far_longitude"], _FINEST), _FINEST),
        accuracy_m=q.ACCURACIES_M[values["accuracy"]],
        text=_text(reader, values),
        hops=values["hops"],
        code=_observation_code(values["code"]),
    )
    return bool(values["exercise"]), notice, asked


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
    return bool(values["exercise"]), notice, None


def _time_ns(values: Values, now_tick: int) -> int:
    return q.unwrap(values["time"], q.TIME_BITS, now_tick) * q.TICK_NS


def _observation_values(notice: ObservationNotice) -> dict[str, int]:
    return {
        "far_latitude": q.latitude_code(q.latitude_index(notice.latitude_deg, _FINEST), _FINEST),
        "far_longitude": q.longitude_code(q.longitude_index(notice.longitude_deg, _FINEST), _FINEST),
        "accuracy": q.accuracy_code(notice.accuracy_m),
        "code": 0 if notice.code is None else 1 + OBSERVATION_CODES.index(notice.code),
    }


def _observation_code(code: int) -> ObservationCode | None:
    """What a code means; one that was added after this was written stands for nothing here."""
    return OBSERVATION_CODES[code - 1] if 1 <= code <= len(OBSERVATION_CODES) else None


def _status_values(notice: StatusNotice) -> dict[str, int]:
    battery = notice.battery_pct
    return {
        "condition": CONDITIONS.index(notice.condition),
        "has_battery": int(battery is not None),
        "battery": round(battery or 0.0),
    }


def _writer_of(kind: Kind) -> BitWriter:
    writer = BitWriter()
    writer.put(kind, KIND_BITS)
    return writer


def _with_text(kind: Kind, values: Values, asked: Asked | None, text: str, limit_bytes: int) -> bytes:
    """Kind and all fields, who is asked, then as much of the text as fits."""
    fields = ALERT if kind is Kind.ALERT else OBSERVATION
    values = {**values, **asked_values(asked)}
    data = cut_text(text, (8 * limit_bytes - _bits_before_text(fields, values)) // 8).encode()
    writer = _writer_of(kind)
    write_fields(writer, fields, {**values, "text_bytes": len(data)})
    write_asked(writer, asked)
    writer.put_bytes(data)
    return writer.to_bytes()


def _bits_before_text(fields: Sequence[Field], values: Values) -> int:
    fixed = sum(field.width(values) for field in fields if field.present(values))
    return KIND_BITS + fixed + values["among"] * sum(field.width(values) for field in ASKED)


def _text(reader: BitReader, values: Values) -> str:
    try:
        text = reader.take_bytes(values["text_bytes"]).decode("utf-8")
    except UnicodeDecodeError as error:
        raise FrameError("text", "not UTF-8") from error
    if len(text) > MAX_TEXT_CHARACTERS:
        raise FrameError("text", f"{len(text)} characters")
    return text
