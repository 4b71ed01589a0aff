"""A pretend UBX receiver for tests."""

import datetime

from pyubx2 import GET, UBXMessage


def pvt_at(utc_ns: int, **changes: float) -> bytes:
    """A NAV-PVT with a 3D fix and sure time at a full second of UTC."""
    moment = datetime.datetime.fromtimestamp(utc_ns // 1_000_000_000, datetime.UTC)
    date = {"year": moment.year, "month": moment.month, "day": moment.day}
    time = {"hour": moment.hour, "min": moment.minute, "second": moment.second}
    state = {"validDate": 1, "validTime": 1, "fullyResolved": 1, "fixType": 3, "gnssFixOk": 1, "numSV": 12}
    place = {"lon": 18.0, "lat": 59.0, "height": 40_000, "hAcc": 1500, "vAcc": 2500}
    return bytes(
        UBXMessage("NAV", "NAV-PVT", GET, **{**date, **time, **state, **place, **changes}).serialize()
    )
