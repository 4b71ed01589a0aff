"""What Foxglove's map understands: positions and tracks as ``foxglove.LocationFix``, observations as
``foxglove.GeoJSON``, both in JSON.

Names and types follow https://docs.foxglove.dev/docs/visualization/message-schemas/ (location-fix, geo-json).
"""

from collections.abc import Mapping
from typing import Any

import msgspec

from bootprint.messages import Message, Observation, Position, Track
from bootprint.topics import Address

LOCATION_FIX = "/location_fix"
GEOJSON = "/geojson"
SCHEMA_NAMES = {LOCATION_FIX: "foxglove.LocationFix", GEOJSON: "foxglove.GeoJSON"}
"""What follows a key in the topic of a copy, and the schema of such copies."""
COPIED: tuple[type[Message], ...] = (Position, Track, Observation)
COVARIANCE_DIAGONAL = 2
COVARIANCE_KNOWN = 3
_UNKNOWN_HEIGHT_M2 = 1e6
_WORST_M = 1e7  # a square stays a number
_NS_PER_S = 1_000_000_000
_ENCODER = msgspec.json.Encoder(order="deterministic")


def _object(properties: dict[str, Any], title: str) -> dict[str, Any]:
    return {"title": title, "type": "object", "properties": properties, "required": list(properties)}


def suffix_of(topic: str) -> str | None:
    """Which kind of copy a topic holds; None if it is no copy."""
    return next((suffix for suffix in SCHEMA_NAMES if topic.endswith(suffix)), None)


def schema(suffix: str) -> bytes:
    """The JSON schema of a kind of copy."""
    return _location_fix_schema() if suffix == LOCATION_FIX else _geojson_schema()


def _geojson_schema() -> bytes:
    return _ENCODER.encode(_object({"geojson": {"type": "string"}}, SCHEMA_NAMES[GEOJSON]))


def _location_fix_schema() -> bytes:
    """The fields that a position fills."""
    number, integer, text = {"type": "number"}, {"type": "integer", "minimum": 0}, {"type": "string"}
    kinds = ("UNKNOWN", "APPROXIMATED", "DIAGONAL_KNOWN", "KNOWN")
    fields = {
        "timestamp": _object({"sec": integer, "nsec": {**integer, "maximum": _NS_PER_S - 1}}, "time"),
        "frame_id": text,
        "latitude": {**number, "description": "degrees, WGS84"},
        "longitude": {**number, "description": "degrees, WGS84"},
        "altitude": {**number, "description": "metres above the ellipsoid"},
        "position_covariance": {
            "type": "array",
            "items": number,
            "minItems": 9,
            "maxItems": 9,
            "description": "m², east north up, row by row",
        },
        "position_covariance_type": {
            "title": "foxglove.PositionCovarianceType",
            "oneOf": [{"title": kind, "const": value} for value, kind in enumerate(kinds)],
        },
        "metadata": {
            "type": "array",
            "items": _object({"key": text, "value": text}, "foxglove.KeyValuePair"),
        },
    }
    return _ENCODER.encode(_object(fields, SCHEMA_NAMES[LOCATION_FIX]))


def copy_of(address: Address, message: Message) -> tuple[str, bytes] | None:
    """The kind of copy (a suffix) and its JSON; None for messages without a place on the map."""
    match message:
        case Position():
            return LOCATION_FIX, _position_fix(address, message)
        case Track():
            return LOCATION_FIX, _track_fix(message)
        case Observation():
            return GEOJSON, _observed(message)
    return None


def _position_fix(address: Address, position: Position) -> bytes:
    """Its frame is the soldier's id, its mode and floor are metadata."""
    ee, en, eu, nn, nu, uu = position.covariance_m2
    metadata = {"mode": position.mode, "floor": "" if position.floor is None else str(position.floor)}
    covariance = [ee, en, eu, en, nn, nu, eu, nu, uu]
    return _fix(address.soldier, position, position.height_m, covariance, COVARIANCE_KNOWN, metadata)


def _track_fix(track: Track) -> bytes:
    """Its frame is the soldier's id; a height that is not known is zero with a sigma of a kilometre."""
    m2 = min(track.accuracy_m, _WORST_M) ** 2
    covariance = [
        m2,
        0.0,
        0.0,
        0.0,
        m2,
        0.0,
        0.0,
        0.0,
        m2 if track.height_m is not None else _UNKNOWN_HEIGHT_M2,
    ]
    metadata = {
        "callsign": track.callsign or "",
        "state": track.state,
        "mode": track.mode,
        "floor": "" if track.floor is None else str(track.floor),
        "via": track.via,
    }
    return _fix(track.soldier, track, track.height_m or 0.0, covariance, COVARIANCE_DIAGONAL, metadata)


def _fix(
    frame: str,
    place: Position | Track,
    height_m: float,
    covariance: list[float],
    covariance_type: int,
    metadata: Mapping[str, str],
) -> bytes:
    seconds, nanoseconds = divmod(max(0, place.time_ns), _NS_PER_S)
    return _ENCODER.encode(
        {
            "timestamp": {"sec": seconds, "nsec": nanoseconds},
            "frame_id": frame,
            "latitude": place.latitude_deg,
            "longitude": place.longitude_deg,
            "altitude": height_m,
            "position_covariance": covariance,
            "position_covariance_type": covariance_type,
            "metadata": [{"key": key, "value": value} for key, value in metadata.items() if value],
        }
    )


def _observed(observation: Observation) -> bytes:
    """A point with what was seen and by whom."""
    name = " ".join(filter(None, (observation.code, observation.text)))
    feature = {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [observation.longitude_deg, observation.latitude_deg]},
        "properties": {"name": name, "soldier": observation.soldier, "accuracy_m": observation.accuracy_m},
    }
    return _ENCODER.encode({"geojson": _ENCODER.encode(feature).decode()})
