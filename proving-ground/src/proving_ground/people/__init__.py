"""A person and what they do, as continuous motion of both feet and the torso.

`move` a `Person` along an `Itinerary` of `Leg`s: a `PersonMotion`, whose parts tell place and attitude at any time.
The shapes of the strides are those of recorded ones (`proving_ground.agreement.fit_shapes`).
"""

from proving_ground.motion import Motion
from proving_ground.people.foot import INSTEP_M, Footfalls
from proving_ground.people.legs import Activity, GaitName, Itinerary, Leg
from proving_ground.people.motion import PersonMotion, move
from proving_ground.people.person import Person
from proving_ground.people.planner import leg_duration_s

__all__ = [
    "INSTEP_M",
    "Activity",
    "Footfalls",
    "GaitName",
    "Itinerary",
    "Leg",
    "Motion",
    "Person",
    "PersonMotion",
    "leg_duration_s",
    "move",
]
