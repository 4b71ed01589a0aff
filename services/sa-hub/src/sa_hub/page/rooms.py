"""Maps of rooms on the page: one layer out of everybody's maps, by soldier and floor."""

from collections.abc import Iterable

import msgspec

from bootprint.config import Origin
from bootprint.rooms import RoomMap
from bootprint.rooms_geojson import geojson
from sa_hub.page.geojson import Feature, FeatureCollection


def rooms_layer(maps: Iterable[RoomMap], origin: Origin) -> FeatureCollection:
    """All maps' features: what was walked and seen, each with its soldier, floor and sigma."""
    features = [feature for rooms in maps for feature in geojson(rooms, origin)["features"]]
    return FeatureCollection(features=[msgspec.convert(feature, Feature) for feature in features])
