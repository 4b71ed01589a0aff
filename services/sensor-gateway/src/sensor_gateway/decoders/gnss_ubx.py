"""UBX NAV-PVT to satellite fixes: ``height`` is above the ellipsoid, accuracies are one sigma, in millimetres."""

import calendar
import math
from collections import Counter
from typing import Any

from pyubx2 import UBXReader
from pyubx2 import exceptions as ubx

from bootprint.messages import FixKind, GnssFix
from sensor_gateway.readings import StampedFix

_NS_PER_S = 1_000_000_000
_NAV_PVT = b"\x01\x07"
_DEAD_RECKONING, _2D, _3D, _WITH_DEAD_RECKONING = 1, 2, 3, 4
_CARRIER: dict[int, FixKind] = {1: "rtk_float", 2: "rtk_fixed"}
_ERRORS = (ubx.UBXParseError, ubx.UBXStreamError, ubx.UBXMessageError, ubx.UBXTypeError, ValueError)


class UbxDecoder:
    """Packets of one receiver; all but NAV-PVT are passed over."""

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts

    def packet(self, frame: bytes, received_ns: int) -> list[StampedFix]:
        """Take one checked packet; the fixes (none or one) in it."""
        if frame[2:4] != _NAV_PVT:
            return []
        try:
            return [self._fix(UBXReader.parse(frame), received_ns)]
        except _ERRORS:
            self._counts["messages_invalid"] += 1
            return []

    def _fix(self, pvt: Any, received_ns: int) -> StampedFix:
        if pvt.validDate and pvt.validTime:
            # Before it is fully resolved, the number of leap seconds may be wrong.
            return _from_pvt(pvt, _utc_ns(pvt)), "sensor" if pvt.fullyResolved else "host_date"
        self._counts["fixes_without_time"] += 1
        return _from_pvt(pvt, received_ns), "arrival"


def _utc_ns(pvt: Any) -> int:
    """UTC of the solution; ``nano`` may be negative."""
    seconds = calendar.timegm((pvt.year, pvt.month, pvt.day, pvt.hour, pvt.min, pvt.second))
    return int(seconds * _NS_PER_S + pvt.nano)


def _from_pvt(pvt: Any, time_ns: int) -> GnssFix:
    kind = _kind(pvt)
    if kind == "none":
        return GnssFix(time_ns=time_ns, fix_kind=kind, satellites=pvt.numSV)
    placed = not pvt.invalidLlh
    return GnssFix(
        time_ns=time_ns,
        fix_kind=kind,
        latitude_deg=pvt.lat if placed else None,
        longitude_deg=pvt.lon if placed else None,
        height_m=pvt.height / 1000.0 if placed and kind != "2d" else None,
        horizontal_accuracy_m=pvt.hAcc / 1000.0,
        vertical_accuracy_m=pvt.vAcc / 1000.0,
        satellites=pvt.numSV,
        speed_m_s=pvt.gSpeed / 1000.0,
        speed_accuracy_m_s=pvt.sAcc / 1000.0,
        course_rad=math.radians(pvt.headMot) % math.tau,
    )


def _kind(pvt: Any) -> FixKind:
    if not pvt.gnssFixOk:
        return "none"
    if pvt.fixType in (_DEAD_RECKONING, _2D):
        return "dead_reckoning" if pvt.fixType == _DEAD_RECKONING else "2d"
    if pvt.fixType in (_3D, _WITH_DEAD_RECKONING):
        return _CARRIER.get(pvt.carrSoln, "dgnss" if pvt.diffSoln else "3d")
    return "none"
