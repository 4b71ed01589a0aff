"""The body-worn unit over a recorded run: its steps as a track, as a chain of errors, and what they cost."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdr_engine.body import BodyNavigator, BodySettings, BodyStepEstimate
from proving_ground.evaluation.alignment import Track
from proving_ground.evaluation.consistency import StepChain
from sensor_gateway.recordings.run import FloatArray, ImuSeries

BATCH = 10
_NS_PER_S = 1e9


@dataclass(frozen=True, slots=True)
class BodyWalk:
    """The steps found in a run, and the processor time that took."""

    steps: list[BodyStepEstimate]
    seconds: float


def walk_body(imu: ImuSeries, settings: BodySettings) -> BodyWalk:
    """A run through the navigator, batch by batch as on the bus."""
    navigator = BodyNavigator(settings)
    time_ns = np.round(imu.time_s * _NS_PER_S).astype(np.int64)
    begin = time.thread_time()
    steps = [
        step
        for start in range(0, len(time_ns), BATCH)
        for step in navigator.process(
            time_ns[start : start + BATCH],
            imu.accel_m_s2[start : start + BATCH],
            imu.gyro_rad_s[start : start + BATCH],
            None if imu.mag_ut is None else imu.mag_ut[start : start + BATCH],
        )
    ]
    return BodyWalk(steps, time.thread_time() - begin)


def body_track(steps: Sequence[BodyStepEstimate], imu: ImuSeries) -> Track:
    """Where the steps lead from (0, 0), x east if azimuths are from north; still between bouts."""
    time_s, place = [float(imu.time_s[0])], [np.zeros(2)]
    for step in steps:
        if step.start_ns / _NS_PER_S > time_s[-1]:
            time_s.append(step.start_ns / _NS_PER_S)
            place.append(place[-1])
        way = np.array([math.sin(step.azimuth_rad), math.cos(step.azimuth_rad)])
        time_s.append(step.time_ns / _NS_PER_S)
        place.append(place[-1] + step.length_m * way)
    if (end_s := float(imu.time_s[-1])) > time_s[-1]:
        time_s.append(end_s)
        place.append(place[-1])
    plane = np.array(place)
    return Track(np.array(time_s), np.column_stack([plane, np.zeros(len(plane))]))


def body_chain(steps: Sequence[BodyStepEstimate]) -> StepChain | None:
    """The steps as the consistency check reads them: straight ahead, then a turn to the next one's azimuth."""
    if not steps:
        return None
    azimuth = np.array([step.azimuth_rad for step in steps])
    turns = -np.append(np.diff(np.unwrap(azimuth)), 0.0)
    length = np.array([step.length_m for step in steps])
    count = len(steps)
    return StepChain(
        time_s=np.array([steps[0].start_ns, *(step.time_ns for step in steps)]) / _NS_PER_S,
        displacement_m=np.column_stack([length, np.zeros(count)]),
        heading_change_rad=turns,
        covariance=np.array([_covariance(step) for step in steps]),
        common_scale=np.array([step.common_scale_sigma for step in steps]),
        common_turn_rad_s=np.array([step.common_turn_sigma_rad_s for step in steps]),
        common_slope=np.zeros(count),
        climb_m=np.zeros(count),
        climb_variance_m2=np.zeros(count),
    )


def _covariance(step: BodyStepEstimate) -> FloatArray:
    """Of (forward, left, turn), (3, 3): all of a step's error, the common part included."""
    duration_s = (step.time_ns - step.start_ns) / _NS_PER_S
    turn = math.hypot(step.azimuth_walk_rad, step.common_turn_sigma_rad_s * duration_s)
    sigmas = (step.length_sigma_m, step.length_m * step.own_turn_sigma_rad, turn)
    return np.diag(np.square(sigmas))
