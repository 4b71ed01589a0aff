"""Body steps: what the navigator hands over, for the rest of the house."""

from dataclasses import dataclass

from bootprint.messages import Direction, MotionClass
from pdr_engine.body.altitude.heights import Height
from pdr_engine.body.movement.feet import Settled
from pdr_engine.body.pieces import Stride
from pdr_engine.body.steps.gait import Gait
from pdr_engine.body.track.reliability import Reliability


@dataclass(frozen=True, slots=True)
class BodyStepEstimate:
    """One step: from ``start_ns`` to ``time_ns``, ``length_m`` along ``azimuth_rad``.

    Azimuths are clockwise from *magnetic* north, or from where the unit pointed at the start if there is no
    magnetometer (then ``azimuth_sigma_rad`` says that nothing is known). ``gyro_azimuth_rad`` has seen the compass
    once, at the start; ``satellite_azimuth_rad`` is that of the newest stretch between good fixes.

    ``track_azimuth_rad`` is the same in the track's own frame, which is not turned when the compass tells north
    better while one walks: a track of steps added up by it keeps its shape, and may be turned as a whole.

    ``length_sigma_m`` and ``azimuth_sigma_rad`` hold all of a step's error; all steps of a walk share
    ``common_scale_sigma`` of the length and, per second, ``common_turn_sigma_rad_s``; a step's own direction is
    ``own_turn_sigma_rad`` from the trunk's, and the azimuth walks by ``azimuth_walk_rad`` from step to step.

    Where steps before turned out to have gone elsewhere, or the way back is laid on the way out, length and azimuth
    hold the correction: steps added up lead where the person is. ``settled``: how one of them went, as seen now.

    ``taught_scale`` and ``taught_turn_rad`` (clockwise) are what satellites have taught of the person's length of
    such steps and of how the unit sits; they are in length and azimuth.
    """

    start_ns: int
    time_ns: int
    length_m: float
    length_sigma_m: float
    azimuth_rad: float
    track_azimuth_rad: float
    azimuth_sigma_rad: float
    motion: MotionClass
    direction: Direction
    class_probability: float
    settled: Settled | None
    compass_azimuth_rad: float | None
    gyro_azimuth_rad: float
    satellite_azimuth_rad: float | None
    common_scale_sigma: float
    common_turn_sigma_rad_s: float
    own_turn_sigma_rad: float
    azimuth_walk_rad: float
    height: Height | None
    reliability: Reliability
    disturbed: bool
    gait: Gait
    turn_rate_rad_s: float
    taught_scale: float
    taught_turn_rad: float
    stride: Stride
