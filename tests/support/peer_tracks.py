"""Tracks of others of the squad, as the own hub tells them."""

import msgspec

from bootprint.geodesy import LocalFrame
from bootprint.messages import Track
from support.foot_walks import ORIGIN, T0

_FRAME = LocalFrame(ORIGIN)


def track(peer: str, place: tuple[float, float], at_ns: int = T0, **other: object) -> Track:
    """A fresh one, half a metre sure, at ``place`` (east, north) m."""
    latitude, longitude, height = _FRAME.to_geodetic(*place, 0.0)
    made = Track(
        time_ns=at_ns,
        soldier=peer,
        number=int(peer[1:]),
        state="fresh",
        latitude_deg=latitude,
        longitude_deg=longitude,
        height_m=height,
        accuracy_m=0.5,
        via="squad",
    )
    return msgspec.structs.replace(made, **other)
