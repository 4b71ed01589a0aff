"""Who walks in one filter, and who of them is heard: feet, and who stands in for them."""

from collections.abc import Sequence

import numpy as np

from bootprint.clock import NS_PER_S
from fusion.config import SilenceConfig
from fusion.feet import Foot
from fusion.state import Array


class Company:
    """The feet of one soldier by place, and a stand-in such as a camera, once it is in the filter.

    The stand-in carries the body while no foot speaks; it is the ``reference`` only while no foot is in the filter.
    """

    def __init__(self, feet: dict[str, Foot], silence: SilenceConfig) -> None:
        self.feet = feet
        self.stand_in: Foot | None = None
        self.reference: Foot | None = None  # whose track stands for the walk
        self.carried_ns: int | None = None  # until when others have told what the feet did not
        self._coasting_s = silence.coasting_s

    def dismiss(self) -> None:
        """The stand-in leaves the filter; feet are there."""
        if self.reference is self.stand_in:
            self.reference = next((foot for foot in self.feet.values() if foot.active), None)
        self.stand_in = None

    def everybody(self) -> list[Foot]:
        """The feet, in the filter or not, and the stand-in."""
        return [*self.feet.values(), *([] if self.stand_in is None else [self.stand_in])]

    def alive(self, now_ns: int) -> list[Foot]:
        """The feet that speak, else who stands in for them; when all are silent, who spoke last."""
        heard = self.heard_feet(now_ns)
        if heard:
            return heard
        if self.stand_in is not None and (self.stand_in.heard_ns or 0) > (self.feet_heard_ns or 0):
            return [self.stand_in]
        active = [foot for foot in self.feet.values() if foot.active]
        return [foot for foot in active if foot.carries] or active

    def heard_feet(self, now_ns: int) -> list[Foot]:
        """The feet that carry the body and speak."""
        return [
            foot for foot in self.feet.values() if foot.carries and foot.is_heard(now_ns, self._coasting_s)
        ]

    def standing_in(self, now_ns: int) -> list[Foot]:
        """Who carries the body in place of the feet: nobody while one of these speaks."""
        one = self.stand_in
        if one is None or self.heard_feet(now_ns) or not one.is_heard(now_ns, self._coasting_s):
            return []
        return [one]

    def ahead(self, feet: Sequence[Foot], now_ns: int) -> Array:
        """How far the stand-in went since feet last spoke, their mean, (3,) m: they may be falling silent."""
        moved = [
            _went(self.stand_in, foot, now_ns) for foot in feet if foot.is_heard(now_ns, self._coasting_s)
        ]
        return np.mean(moved, axis=0) if moved else np.zeros(3)

    @property
    def refused(self) -> tuple[str, ...]:
        """Feet that contradicted the other one and have not joined it again."""
        return tuple(sorted(foot.place for foot in self.feet.values() if foot.refused))

    def silent_s(self, now_ns: int) -> float | None:
        """How long nobody in the filter, nor who carried it, has been heard; None before any was."""
        stand_in_ns = None if self.stand_in is None else self.stand_in.heard_ns
        heard = [at for at in (self.feet_heard_ns, self.carried_ns, stand_in_ns) if at is not None]
        return max(0.0, (now_ns - max(heard)) / NS_PER_S) if heard else None

    @property
    def feet_heard_ns(self) -> int | None:
        """When a foot of the filter was last heard; None before any was."""
        heard = [foot.heard_ns for foot in self.feet.values() if foot.active and foot.heard_ns is not None]
        return max(heard) if heard else None

    def others(self, foot: Foot, now_ns: int) -> list[Foot]:
        """The other feet that are in the filter and alive."""
        return [
            other
            for other in self.feet.values()
            if other is not foot and other.carries and other.is_heard(now_ns, self._coasting_s)
        ]

    def company(self, foot: Foot, now_ns: int) -> list[Foot]:
        """Who knows what a foot has missed: the other feet, else who stands in for them."""
        return self.others(foot, now_ns) or self.standing_in(now_ns)


def _went(one: Foot | None, foot: Foot, now_ns: int) -> Array:
    """How far ``one`` went, up to now, since the foot was last somewhere; zero if it does not remember."""
    if one is None or one is foot or not (one.trail and foot.trail):
        return np.zeros(3)
    since_ns = foot.trail.span_ns[1]
    if now_ns <= since_ns or since_ns < one.trail.span_ns[0]:
        return np.zeros(3)
    return np.asarray(one.trail.at(now_ns) - one.trail.at(since_ns))
