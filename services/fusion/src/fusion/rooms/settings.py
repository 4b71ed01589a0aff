"""What can be set under ``[fusion.rooms]``, with the defaults and the reasons for them."""

from typing import Annotated

import msgspec

from bootprint.config import Config

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
Share = Annotated[float, msgspec.Meta(gt=0.0, lt=1.0)]


class RoomsConfig(Config, frozen=True):
    """``map``: draw and publish a map of one's own walk; ``use``: be held by others' maps.

    Not used unless asked for: where it was measured (docs/rooms.md), good boots gain little by it.
    """

    map: bool = True
    use: bool = False
    cell_m: Annotated[float, msgspec.Meta(ge=0.1, le=10.0)] = 0.5
    storey_m: Positive = 3.0  # numbers floors where `floor_height_m` is not known
    mapped_sigma_m: Positive = 2.0  # who is less sure than this draws no map
    wall_hits: Annotated[int, msgspec.Meta(ge=1)] = 3  # landmarks in a cell make it a wall
    publish_s: Positive = 10.0  # a map that has grown is published at most this often
    # How a window of the own walk is laid over a map.
    window_m: Positive = 15.0
    spacing_m: Positive = 0.5
    turn_sigma_rad: Positive = 0.06  # by which the window's heading may be wrong beside its end
    walked_sigma_m: Positive = 0.5  # people walk the same door or corridor this far apart
    elsewhere: Share = 0.2  # of a walk goes where the mapper did not
    correlation_m: Positive = 3.0  # of the walk tells one thing of where it is
    least_evidence: Positive = 3.0  # ln of how many times likelier the walk is by the map than anywhere
    most_sigma_m: Positive = 5.0  # who is less sure of the way since is not held any more
    # When a map is laid on one's own walk, and how well it keeps its shape.
    register_sigma_m: Positive = 1.5
    register_evidence: Positive = 4.0
    map_turn_sigma_rad: Positive = 0.1  # by which a map is turned on earth, before the walk has told
    place_sigma_m: Positive = 0.4  # of one look: who follows walks beside who went before
    shape_share: Positive = 0.02  # of the distance from where it was laid, by which the map is bent
    offset_walk_m: Positive = 0.1  # a look: repeated looks at a place err alike
