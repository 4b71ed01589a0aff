"""`move`: a person follows an itinerary, as continuous motion of both feet and the torso."""

from dataclasses import dataclass

import numpy as np

from proving_ground.people.foot import Footfalls, FootMotion, StrideRecord
from proving_ground.people.foot_strides import foot_motion
from proving_ground.people.legs import Activity, FloatArray, Itinerary
from proving_ground.people.person import Person
from proving_ground.people.planner import LEFT, RIGHT, Planner
from proving_ground.people.torso import TorsoMotion, curve_of, fresh_sway
from sensor_gateway.recordings.run import Truth


@dataclass(frozen=True)
class PersonMotion:
    """What a person's feet (their still points, see `foot`) and torso (at belt height) do until ``duration_s``."""

    person: Person
    duration_s: float
    left_foot: FootMotion
    right_foot: FootMotion
    torso: TorsoMotion
    activities: tuple[Activity, ...]

    @property
    def footfalls(self) -> dict[str, Footfalls]:
        """The stances of left_foot and right_foot."""
        return {"left_foot": self.left_foot.footfalls(), "right_foot": self.right_foot.footfalls()}

    def truth(self, period_s: float = 0.1) -> Truth:
        """The person's track: the mean of the feet, on the ground."""
        time_s = np.arange(0.0, self.duration_s, period_s)
        middle = 0.5 * (self.left_foot.at(time_s)[0] + self.right_foot.at(time_s)[0])
        middle[:, 2] = self.torso.ground_m(time_s)
        return Truth(time_s, middle)


def move(person: Person, itinerary: Itinerary, seed: int) -> PersonMotion:
    """The motion of a person on this itinerary; the same for the same seed. ConfigError if legs do not join."""
    rng = np.random.default_rng(seed)
    plan = Planner(person, itinerary, rng)
    feet = {
        side: foot_motion(foot.strides or [_standing(foot.place_m, foot.yaw_rad)], person, side, rng)
        for side, foot in plan.feet.items()
    }
    return PersonMotion(
        person=person,
        duration_s=plan.time_s,
        left_foot=feet[LEFT],
        right_foot=feet[RIGHT],
        torso=TorsoMotion(curve_of(plan.knots), fresh_sway(person.sway_m, rng)),
        activities=tuple(plan.activities),
    )


def _standing(place_m: FloatArray, yaw_rad: float) -> StrideRecord:
    """What a foot that is never lifted does."""
    return StrideRecord(-2.0, -1.0, place_m, place_m, yaw_rad, yaw_rad, 0.0, 0.0, None)
