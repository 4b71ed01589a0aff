"""CSV: tracks, alerts, observations and statuses in order of time, a row each, for spreadsheets and data frames."""

import csv
from io import TextIOWrapper
from typing import Any, BinaryIO, Final

import msgspec

from bootprint.bus import Envelope
from sa_hub.exports.source import Source, utc

COLUMNS: Final = (
    "time_utc",
    "time_ns",
    "subject",
    "soldier",
    "callsign",
    "latitude_deg",
    "longitude_deg",
    "height_m",
    "accuracy_m",
    "east_velocity_m_s",
    "north_velocity_m_s",
    "mode",
    "floor",
    "state",
    "via",
    "hops",
    "received_ns",
    "kind",
    "code",
    "text",
    "condition",
    "battery_pct",
)
_SUBJECTS: Final = ("track", "alert", "observation", "status")
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r")


def write_csv(source: Source, out: BinaryIO) -> None:
    """Write the table; what a message does not have stays empty."""
    text = TextIOWrapper(out, encoding="utf-8", newline="")
    writer = csv.DictWriter(text, COLUMNS, extrasaction="ignore", lineterminator="\r\n")
    writer.writeheader()
    for envelope in source.messages(*_SUBJECTS):
        writer.writerow(_row(envelope))
    text.detach()


def _row(envelope: Envelope) -> dict[str, Any]:
    message = envelope.message
    values = {"time_utc": utc(message.time_ns), "subject": envelope.address.subject}
    return {**{key: _cell(value) for key, value in msgspec.structs.asdict(message).items()}, **values}


def _cell(value: object) -> object:
    """People write texts: one that a spreadsheet would take for a formula is made plain."""
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value
