"""A Cursor on Target event, and its XML: version 2.0 as TAK clients and servers speak it.

Read strictly, for anybody may send anything: no entities, bounded size, finite numbers in their ranges, a stale
time that is not before the start. Details are read one level deep, where the fields of `sa_hub.tak` stand.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Final, TypeVar
from xml.etree import ElementTree

from bootprint.clock import NS_PER_S

T = TypeVar("T", int, float)
MAX_EVENT_BYTES: Final = 64 * 1024
UNKNOWN: Final = 9_999_999.0
"""What CoT writes for a height or an error that is not known."""
_DECLARATION: Final = b"<?xml version='1.0' encoding='UTF-8' standalone='yes'?>"
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_NS_PER_MS: Final = 1_000_000
_LAST_NS: Final = 2**63 - 1
_HIGHEST_M: Final = 1e6
_UID: Final = re.compile(r"[^\x00-\x1f\x7f]{1,200}\Z")
_TYPE: Final = re.compile(r"[A-Za-z0-9_.-]{1,64}\Z")
_DETAILS: Final = 64


class CotError(ValueError):
    """Bytes that are no Cursor on Target event, and why."""


@dataclass(frozen=True, slots=True)
class CotEvent:
    """One event. Times are UTC ns (milliseconds on the wire), ``hae_m`` is above the ellipsoid; None is unknown.

    ``details`` maps the names of the detail's elements to their attributes, in their order on the wire.
    """

    uid: str
    type: str
    how: str
    time_ns: int
    start_ns: int
    stale_ns: int
    latitude_deg: float
    longitude_deg: float
    hae_m: float | None = None
    ce_m: float | None = None
    le_m: float | None = None
    details: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    remarks: str = ""
    opex: str = ""

    def detail(self, name: str, attribute: str) -> str | None:
        """An attribute of a detail's element, None if it is missing or empty."""
        return self.details.get(name, {}).get(attribute) or None


def to_xml(event: CotEvent) -> bytes:
    """The event as an XML document."""
    root = ElementTree.Element(
        "event",
        version="2.0",
        uid=event.uid,
        type=event.type,
        time=_stamp(event.time_ns),
        start=_stamp(event.start_ns),
        stale=_stamp(event.stale_ns),
        how=event.how,
    )
    if event.opex:
        root.set("opex", event.opex)
    ElementTree.SubElement(
        root,
        "point",
        lat=f"{event.latitude_deg:.7f}",
        lon=f"{event.longitude_deg:.7f}",
        hae=f"{UNKNOWN:.1f}" if event.hae_m is None else f"{event.hae_m:.3f}",
        ce=_error(event.ce_m),
        le=_error(event.le_m),
    )
    detail = ElementTree.SubElement(root, "detail")
    for name, attributes in event.details.items():
        ElementTree.SubElement(detail, name, dict(attributes))
    if event.remarks:
        ElementTree.SubElement(detail, "remarks").text = event.remarks
    return _DECLARATION + ElementTree.tostring(root)


def _error(error_m: float | None) -> str:
    return f"{UNKNOWN if error_m is None else error_m:.1f}"


def _stamp(time_ns: int) -> str:
    time = _EPOCH + timedelta(milliseconds=time_ns // _NS_PER_MS)
    return f"{time:%Y-%m-%dT%H:%M:%S}.{time.microsecond // 1000:03d}Z"


def from_xml(data: bytes) -> CotEvent:
    """Read one event; CotError for anything else."""
    if len(data) > MAX_EVENT_BYTES:
        raise CotError(f"{len(data)} bytes, more than {MAX_EVENT_BYTES}")
    if b"<!" in data:
        raise CotError("a document type or entity in it")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise CotError(f"no XML: {error}") from error
    return _event(root)


def _event(root: ElementTree.Element) -> CotEvent:
    point = root.find("point")
    if root.tag != "event" or point is None:
        raise CotError(f"a {root.tag!r} without a point instead of an event")
    detail = root.find("detail")
    details, remarks = ({}, "") if detail is None else read_details(detail)
    return checked(
        CotEvent(
            uid=root.get("uid", ""),
            type=root.get("type", ""),
            how=root.get("how", ""),
            time_ns=_time(root, "time"),
            start_ns=_time(root, "start"),
            stale_ns=_time(root, "stale"),
            latitude_deg=_number(point, "lat"),
            longitude_deg=_number(point, "lon"),
            hae_m=known(_number(point, "hae")),
            ce_m=known(_number(point, "ce")),
            le_m=known(_number(point, "le")),
            details=details,
            remarks=remarks,
            opex=root.get("opex", ""),
        )
    )


def read_details(detail: ElementTree.Element) -> tuple[dict[str, dict[str, str]], str]:
    """The attributes of a detail's elements by name (the first of each counts), and the text of its remarks."""
    details: dict[str, dict[str, str]] = {}
    for child in list(detail)[:_DETAILS]:
        if child.tag != "remarks":
            details.setdefault(child.tag, dict(child.attrib))
    return details, (detail.findtext("remarks") or "").strip()


def checked(event: CotEvent) -> CotEvent:
    """The event, if everything in it is possible; CotError says what is not."""
    possible: tuple[tuple[str, bool], ...] = (
        ("uid", bool(_UID.match(event.uid))),
        ("type", bool(_TYPE.match(event.type))),
        ("how", not event.how or bool(_TYPE.match(event.how))),
        ("lat", abs(event.latitude_deg) <= 90.0),
        ("lon", abs(event.longitude_deg) <= 180.0),
        ("hae", event.hae_m is None or abs(event.hae_m) <= _HIGHEST_M),
        ("ce", event.ce_m is None or event.ce_m >= 0.0),
        ("le", event.le_m is None or event.le_m >= 0.0),
        ("time", 0 <= event.time_ns <= _LAST_NS),
        ("stale", 0 <= event.start_ns <= event.stale_ns <= _LAST_NS),
    )
    for name, is_possible in possible:
        if not is_possible:
            raise CotError(f"impossible {name}")
    return event


def _time(root: ElementTree.Element, name: str) -> int:
    return _read(root, name, lambda text: time_of(datetime.fromisoformat(text)))


def time_of(time: datetime) -> int:
    """UTC ns of a time; without a zone it is UTC."""
    since = (time if time.tzinfo else time.replace(tzinfo=UTC)) - _EPOCH
    return (since.days * 86_400 + since.seconds) * NS_PER_S + since.microseconds * 1000


def _number(point: ElementTree.Element, name: str) -> float:
    return _read(point, name, float)


def _read(element: ElementTree.Element, name: str, convert: Callable[[str], T]) -> T:
    text = element.get(name)
    try:
        value = convert(text or "")
    except (ValueError, OverflowError) as error:
        raise CotError(f"{name} {text!r} cannot be read") from error
    if not math.isfinite(value):
        raise CotError(f"{name} {text!r} is not finite")
    return value


def known(value: float) -> float | None:
    """A height or error as CoT writes it; None if it says that it is unknown."""
    return None if value >= UNKNOWN else value
