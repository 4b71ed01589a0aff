"""Positions as Foxglove's map understands them: ``foxglove.LocationFix``, in JSON.

Names and types follow https://docs.foxglove.dev/docs/visualization/message-schemas/location-fix/.
"""

from typing import Any

import msgspec

from bootprint.messages import Position
from bootprint.topics import Address

SCHEMA_NAME = "foxglove.LocationFix"
TOPIC_SUFFIX = "/location_fix"
COVARIANCE_KNOWN = 3
_NS_PER_S = 1_000_000_000
_ENCODER = msgspec.json.Encoder(order="deterministic")


def _object(properties: dict[str, Any], title: str) -> dict[str, Any]:
    return {"title": title, "type": "object", "properties": properties, "required": list(properties)}


def schema() -> bytes:
    """The JSON schema of LocationFix, the fields that a position fills."""
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
    return _ENCODER.encode(_object(fields, SCHEMA_NAME))


def location_fix(address: Address, position: Position) -> bytes:
    """A position as LocationFix JSON; its frame is the soldier's id, its mode and floor are metadata."""
    seconds, nanoseconds = divmod(max(0, position.time_ns), _NS_PER_S)
    ee, en, eu, nn, nu, uu = position.covariance_m2
    metadata = {"mode": position.mode, "floor": "" if position.floor is None else str(position.floor)}
    return _ENCODER.encode(
        {
            "timestamp": {"sec": seconds, "nsec": nanoseconds},
            "frame_id": address.soldier,
            "latitude": position.latitude_deg,
            "longitude": position.longitude_deg,
            "altitude": position.height_m,
            "position_covariance": [ee, en, eu, en, nn, nu, eu, nu, uu],
            "position_covariance_type": COVARIANCE_KNOWN,
            "metadata": [{"key": key, "value": value} for key, value in metadata.items() if value],
        }
    )
