"""What can be set under ``[pdr]`` of computer.toml. An empty section is a good one; a foot in detail::

[pdr]
places = ["right_foot", "body"]

[pdr.foot]
method = "shoe"

[pdr.body]
forward = "x"
step_length = "weinberg"
"""

from typing import Annotated, Literal

import msgspec

from bootprint.config import Config
from pdr_engine.body.settings import BodySettings
from pdr_engine.foot.settings import FootSettings

Place = Literal["left_foot", "right_foot", "body"]


class PdrConfig(Config, frozen=True):
    """The ``[pdr]`` section: where inertial units are worn, and how their navigators are set."""

    places: Annotated[tuple[Place, ...], msgspec.Meta(min_length=1, max_length=3)] = (
        "left_foot",
        "right_foot",
    )
    foot: FootSettings = FootSettings()
    body: BodySettings = BodySettings()
    pose_interval_s: Annotated[float, msgspec.Meta(ge=0.01, le=10.0)] = (
        0.1  # event time between two FootPoses
    )
    silent_after_s: Annotated[float, msgspec.Meta(gt=0.0, le=3600.0)] = 2.0  # until a unit is reported silent

    @property
    def feet(self) -> tuple[str, ...]:
        """The places that are feet."""
        return tuple(place for place in self.places if place != "body")
