"""Who carries the position at a moment: its mode, and the sources that it names."""

from collections.abc import Sequence

from bootprint.messages import Mode
from fusion.body_track import BodyTrack
from fusion.boots import Boots
from fusion.config import SilenceConfig
from fusion.feet import Foot
from fusion.output import horizontal_sigma_m
from fusion.satellites import Satellites
from fusion.state import Array


class Carriers:
    """Boots, a camera or the body's steps, with satellites or without."""

    def __init__(self, silence: SilenceConfig, satellites: Satellites, body: BodyTrack) -> None:
        self._silence, self._satellites, self._body = silence, satellites, body

    def sources(self, boots: Boots, now_ns: int, alive: Sequence[Foot]) -> tuple[str, ...]:
        """Names of the sources; ``alive``: those in the filter that the body is over."""
        feet = ["body"] if self._body.drives(boots, now_ns) else sorted(foot.place for foot in alive)
        return (*feet, *self._satellites.fresh(now_ns))

    def mode(self, boots: Boots, now_ns: int, dead_s: float, covariance: Array) -> Mode:
        """Of a placed position; ``dead_s``: how long nobody has told of the walk."""
        silence = self._silence
        unaided_s = min(dead_s, self._satellites.silent_s(now_ns))
        if unaided_s > silence.lost_s or horizontal_sigma_m(covariance) > silence.lost_sigma_m:
            return "lost"
        if self._satellites.fresh(now_ns):
            return "gnss"
        if self._body.drives(boots, now_ns):
            return "body"
        if dead_s > silence.coasting_s:
            return "coasting"
        return "camera" if boots.standing_in(now_ns) else "boots"
