"""Ground truth in a recording: positions under a realm of their own, so that no service of the exercise hears them.

A replayed recording must not feed the truth to the hubs, which take any ``position`` of their realm; and viewers
that know positions (`bootprint info`, Foxglove's map) show the truth beside the estimate without further ado.
"""

from collections.abc import Iterator

import numpy as np

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.geodesy import LocalFrame
from bootprint.recording import Recorder
from bootprint.topics import Identity
from proving_ground.exercises.exercise import Exercise, Soldier
from proving_ground.positions import position_at

TRUTH_REALM = "truth"
SOURCE = "truth"


def record_truth(recorder: Recorder, exercise: Exercise, start_ns: int) -> None:
    """Write every simulated soldier's true places; a recorded walk's truth has no place on this map."""
    for soldier in exercise.soldiers:
        if soldier.simulated:
            for envelope in truth_positions(exercise, soldier, start_ns):
                recorder.write(envelope)


def truth_positions(exercise: Exercise, soldier: Soldier, start_ns: int) -> Iterator[Envelope]:
    """The truth as positions without error, at the truth's own times; heights that are unknown are the origin's."""
    frame = LocalFrame(exercise.origin)
    address = Identity(TRUTH_REALM, soldier.unit, soldier.id).address("position", SOURCE)
    for sequence, (time_s, place) in enumerate(
        zip(soldier.truth.time_s, np.nan_to_num(soldier.truth.position_m), strict=True)
    ):
        enu_m = place.tolist()
        message = position_at(
            start_ns + round(time_s * NS_PER_S),
            enu_m,
            frame.to_geodetic(*enu_m),
            (0.0, 0.0, 0.0),
            mode="gnss",
            sequence=sequence,
            sources=(SOURCE,),
        )
        yield Envelope(address, message)
