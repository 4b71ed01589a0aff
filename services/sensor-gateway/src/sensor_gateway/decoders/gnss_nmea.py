"""NMEA sentences to satellite fixes: all sentences of one epoch make one fix.

HDOP is not metres: without GST the accuracy is unknown. A fix is told as soon as its epoch is complete: the
decoder learns which sentence comes last, so that it need not wait for the next epoch.
"""

import datetime
import math
from collections import Counter
from typing import Any

from pynmeagps import NMEAReader
from pynmeagps import exceptions as nmea

from bootprint.messages import FixKind, GnssFix
from sensor_gateway.readings import StampedFix

_NS_PER_S = 1_000_000_000
_DAY_NS = 86_400 * _NS_PER_S
_M_S_PER_KNOT = 1852.0 / 3600.0
_OF_EPOCH = ("GGA", "RMC", "GST")
# GGA's quality; 7 (typed in) and 8 (simulator) are no measurements.
_KINDS: dict[int, FixKind] = {
    1: "3d",
    2: "dgnss",
    3: "3d",
    4: "rtk_fixed",
    5: "rtk_float",
    6: "dead_reckoning",
}
_ERRORS = (nmea.NMEAParseError, nmea.NMEAStreamError, nmea.NMEAMessageError, nmea.NMEATypeError, ValueError)


class NmeaDecoder:
    """Sentences of one receiver; UTC comes from the receiver, the date from the arrival only if it tells none."""

    def __init__(self, counts: Counter[str], geoid_undulation_m: float | None) -> None:
        self._counts = counts
        self._geoid_undulation_m = geoid_undulation_m
        self._epoch: dict[str, Any] = {}
        self._dimensions: Any = None
        self._time: datetime.time | None = None
        self._told: datetime.time | None = None
        self._newest = ""
        self._last_of_epoch = ""
        self._known_utc_ns: int | None = None
        self._date_told = False

    def sentence(self, frame: bytes, received_ns: int) -> list[StampedFix]:
        """Take one checked sentence; the fixes (none or one) that it completes."""
        try:
            message = NMEAReader.parse(frame)
            if message is None:  # a checked sentence that the library makes nothing of, and says no more
                raise nmea.NMEAParseError
            if message.msgID in _OF_EPOCH:
                return self._take(message.msgID, message, received_ns)
            self._note(message)
        except _ERRORS:
            self._counts["messages_invalid"] += 1
        return []

    def _note(self, message: Any) -> None:
        """GSA and ZDA belong to no epoch by their own words: they are remembered."""
        if message.msgID == "GSA":
            self._dimensions = message
        elif message.msgID == "ZDA" and _value(message, "time") is not None and _value(message, "year"):
            date = datetime.date(message.year, message.month, message.day)
            self._known_utc_ns, self._date_told = _of_date_ns(date) + _of_day_ns(message.time), True

    def _take(self, kind: str, message: Any, received_ns: int) -> list[StampedFix]:
        time = _value(message, "time")
        if time is None:
            return self._without_time(kind, message, received_ns)
        fixes: list[StampedFix] = []
        if time != self._time:
            fixes = self.finish(received_ns)
            self._last_of_epoch, self._time = self._newest, time
        self._newest = kind
        if time != self._told:
            self._epoch[kind] = message
            if kind == self._last_of_epoch:
                fixes += self.finish(received_ns)
        return fixes

    def _without_time(self, kind: str, message: Any, received_ns: int) -> list[StampedFix]:
        """A receiver without time has no fix; that it is alive is told once an epoch, by its GGA."""
        if kind != "GGA":
            return []
        self._counts["fixes_without_time"] += 1
        none = GnssFix(time_ns=received_ns, fix_kind="none", satellites=_value(message, "numSV"))
        return [*self.finish(received_ns), (none, "arrival")]

    def finish(self, received_ns: int) -> list[StampedFix]:
        """The fix of the epoch so far, if it has not been told yet."""
        epoch, self._epoch = self._epoch, {}
        if self._time is None or not epoch.keys() & {"GGA", "RMC"}:
            return []
        self._told = self._time
        self._known_utc_ns = self._utc_ns(self._time, epoch, received_ns)
        try:
            fix = _fix(self._known_utc_ns, epoch, self._dimensions, self._geoid_undulation_m)
            return [(fix, "sensor" if self._date_told else "host_date")]
        except ValueError:
            self._counts["messages_invalid"] += 1
            return []

    def _utc_ns(self, time: datetime.time, epoch: dict[str, Any], received_ns: int) -> int:
        """The epoch's UTC: its own date, else the day that puts it nearest to the last known time."""
        date: datetime.date | None = _value(epoch.get("RMC"), "date")
        if date is not None:
            self._date_told = True
            return _of_date_ns(date) + _of_day_ns(time)
        near_ns = received_ns if self._known_utc_ns is None else self._known_utc_ns
        return near_ns + (_of_day_ns(time) - near_ns + _DAY_NS // 2) % _DAY_NS - _DAY_NS // 2


def _of_day_ns(time: datetime.time) -> int:
    return (time.hour * 3600 + time.minute * 60 + time.second) * _NS_PER_S + time.microsecond * 1000


def _of_date_ns(date: datetime.date) -> int:
    return (date.toordinal() - datetime.date(1970, 1, 1).toordinal()) * _DAY_NS


def _value(message: Any, name: str) -> Any:
    """A field's value; None where the sentence leaves it empty or has no such field."""
    value = getattr(message, name, "")
    return None if value == "" else value


def _fix(time_ns: int, epoch: dict[str, Any], dimensions: Any, geoid_undulation_m: float | None) -> GnssFix:
    gga, rmc, gst = epoch.get("GGA"), epoch.get("RMC"), epoch.get("GST")
    satellites = _value(gga, "numSV")
    kind = _kind(gga, rmc, _value(dimensions, "navMode"))
    if kind == "none":
        return GnssFix(time_ns=time_ns, fix_kind=kind, satellites=satellites)
    place = gga or rmc
    course_deg, knots = _value(rmc, "cog"), _value(rmc, "spd")
    hdop = _value(gga, "HDOP")
    return GnssFix(
        time_ns=time_ns,
        fix_kind=kind,
        latitude_deg=_value(place, "lat"),
        longitude_deg=_value(place, "lon"),
        height_m=None if kind == "2d" else _height(gga, geoid_undulation_m),
        horizontal_accuracy_m=_horizontal(gst),
        vertical_accuracy_m=_value(gst, "stdAlt"),
        satellites=satellites,
        hdop=_value(dimensions, "HDOP") if hdop is None else hdop,
        speed_m_s=None if knots is None else knots * _M_S_PER_KNOT,
        course_rad=None if course_deg is None else math.radians(course_deg) % math.tau,
    )


def _kind(gga: Any, rmc: Any, dimensions: int | None) -> FixKind:
    """GGA tells how the fix was made, GSA whether it has a height; RMC alone only that there is one."""
    if gga is None:
        return "2d" if _value(rmc, "status") == "A" else "none"
    kind = _KINDS.get(_value(gga, "quality") or 0, "none")
    return "2d" if kind in ("3d", "dgnss") and dimensions == 2 else kind


def _height(gga: Any, geoid_undulation_m: float | None) -> float | None:
    """Ellipsoidal height: above mean sea level plus the receiver's own geoid, else the stated one."""
    altitude, separation = _value(gga, "alt"), _value(gga, "sep")
    undulation = geoid_undulation_m if separation is None else separation
    return None if altitude is None or undulation is None else altitude + undulation


def _horizontal(gst: Any) -> float | None:
    """The horizontal accuracy as receivers state it (UBX hAcc): the root of both axes' summed variances."""
    north, east = _value(gst, "stdLat"), _value(gst, "stdLong")
    return None if north is None or east is None else math.hypot(north, east)
