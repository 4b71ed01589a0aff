"""The picture as GeoJSON (RFC 7946): soldiers where they are believed to be now, observations, trails."""

import math
from collections.abc import Iterable, Sequence
from typing import Any, Literal

import msgspec

from bootprint.display import Ages, shown
from bootprint.geodesy import azimuth_of
from bootprint.messages import Track
from sa_hub.page.views import ObservationView, UtcSeconds, seconds

_DIGITS = 8
_STILL_M_S = 0.3


class Feature(msgspec.Struct, kw_only=True, frozen=True):
    """A thing with its place."""

    type: Literal["Feature"] = "Feature"
    geometry: dict[str, Any]
    properties: dict[str, Any]


class FeatureCollection(msgspec.Struct, kw_only=True, frozen=True):
    """What a map opens."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    features: list[Feature]


class Trails(FeatureCollection, kw_only=True, frozen=True):
    """Lines of what was asked for, but for what came at ``until_s`` or later: ask for that anew."""

    until_s: UtcSeconds


def soldiers(tracks: Iterable[Track], now_ns: int, ages: Ages) -> FeatureCollection:
    """Everybody where they are believed to be at ``now_ns``, with the circle that holds them with 95 %."""
    return FeatureCollection(features=[_soldier(track, now_ns, ages) for track in tracks])


def observations(views: Iterable[ObservationView]) -> FeatureCollection:
    """What has been seen."""
    features = [
        Feature(
            geometry=_point(view.longitude_deg, view.latitude_deg),
            properties={name: getattr(view, name) for name in ("id", "soldier", "code", "text", "accuracy_m")}
            | {"time_s": view.time_s},
        )
        for view in views
    ]
    return FeatureCollection(features=features)


def trails(tracks: Iterable[Track], until_ns: int) -> Trails:
    """A line for each soldier through their reports before ``until_ns``, with their times and floors."""
    found: dict[str, list[Track]] = {}
    for track in tracks:
        found.setdefault(track.soldier, []).append(track)
    lines = [_trail(soldier, theirs) for soldier, theirs in found.items()]
    return Trails(features=lines, until_s=seconds(until_ns))


def _soldier(track: Track, now_ns: int, ages: Ages) -> Feature:
    where = shown(track, now_ns, ages)
    east_m_s, north_m_s = track.east_velocity_m_s, track.north_velocity_m_s
    speed_m_s = math.hypot(east_m_s, north_m_s)
    return Feature(
        geometry=_point(where.longitude_deg, where.latitude_deg),
        properties={
            "soldier": track.soldier,
            "callsign": track.callsign or track.soldier,
            "state": where.state,
            "age": where.words,
            "age_s": round(where.age_s, 3),
            "radius_95_m": round(where.radius_95_m, 2),
            "speed_m_s": round(speed_m_s, 2),
            "course_deg": round(math.degrees(azimuth_of(east_m_s, north_m_s)), 1)
            if speed_m_s > _STILL_M_S
            else None,
            "facing_deg": None
            if track.facing_rad is None
            else round(math.degrees(track.facing_rad) % 360.0, 1),
            "floor": track.floor,
            "mode": track.mode,
            "height_m": track.height_m,
            "via": track.via,
        },
    )


def _trail(soldier: str, tracks: Sequence[Track]) -> Feature:
    points = [_point(track.longitude_deg, track.latitude_deg)["coordinates"] for track in tracks]
    geometry = (
        {"type": "LineString", "coordinates": points}
        if len(points) > 1
        else {"type": "Point", "coordinates": points[0]}
    )
    properties = {
        "soldier": soldier,
        "times_s": [seconds(track.time_ns) for track in tracks],
        "floors": [track.floor for track in tracks],
    }
    return Feature(geometry=geometry, properties=properties)


def _point(longitude_deg: float, latitude_deg: float) -> dict[str, Any]:
    return {"type": "Point", "coordinates": [round(longitude_deg, _DIGITS), round(latitude_deg, _DIGITS)]}
