"""The body-worn unit over a recorded run: its steps as a track, as a chain of errors, and what they cost."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bootprint.config import Origin
from bootprint.messages import GnssFix, ImuBatch, Message, Pressure
from bootprint.topics import Identity
from pdr_engine.body import BodySettings, BodyStepEstimate
from pdr_engine.trunk import Trunk
from proving_ground.evaluation.alignment import Track
from proving_ground.evaluation.consistency import StepChain
from proving_ground.evaluation.floors import Floors
from sensor_gateway.recordings.run import FloatArray, ImuSeries, Run
from sensor_gateway.sources.run_messages import run_messages

BODY = "body"
_IDENTITY = Identity("evaluate", "evaluate", "evaluate")
_NS_PER_S = 1e9


@dataclass(frozen=True, slots=True)
class BodyWalk:
    """The steps found in a run, and the processor time that took."""

    steps: list[BodyStepEstimate]
    seconds: float


def walk_body(run: Run, settings: BodySettings) -> BodyWalk:
    """A run through the body-worn unit's part of the engine, message by message as on the bus.

    It hears what the run has of pressure and satellites, too.
    """
    origin = None if run.origin is None else Origin(*run.origin)
    trunk = Trunk(settings, _IDENTITY.address("imu", BODY), origin)
    alone = replace(run, imus={BODY: run.imus[BODY]}, camera=None, ranges=None)
    messages = [envelope.message for envelope in run_messages(alone, _IDENTITY, start_ns=0)]
    begin = time.thread_time()
    steps = [step for message in messages for step in _heard(trunk, message)]
    return BodyWalk(steps, time.thread_time() - begin)


def _heard(trunk: Trunk, message: Message) -> list[BodyStepEstimate]:
    if isinstance(message, ImuBatch):
        return trunk.estimates(message)
    if isinstance(message, Pressure):
        trunk.hear_pressure(message)
    if isinstance(message, GnssFix):
        trunk.hear_fix(message)
    return []


def body_track(steps: Sequence[BodyStepEstimate], imu: ImuSeries) -> Track:
    """Where the steps lead from (0, 0) in the track's own frame (x east but for a turn); still between bouts.

    Heights are those of the steps, NaN if no step has one.
    """
    time_s, place = [float(imu.time_s[0])], [np.zeros(2)]
    for step in steps:
        if step.start_ns / _NS_PER_S > time_s[-1]:
            time_s.append(step.start_ns / _NS_PER_S)
            place.append(place[-1])
        way = np.array([math.sin(step.track_azimuth_rad), math.cos(step.track_azimuth_rad)])
        time_s.append(step.time_ns / _NS_PER_S)
        place.append(place[-1] + step.length_m * way)
    if (end_s := float(imu.time_s[-1])) > time_s[-1]:
        time_s.append(end_s)
        place.append(place[-1])
    return Track(np.array(time_s), np.column_stack([np.array(place), _heights_m(steps, time_s)]))


def _heights_m(steps: Sequence[BodyStepEstimate], time_s: Sequence[float]) -> FloatArray:
    known = [(step.time_ns / _NS_PER_S, step.height.height_m) for step in steps if step.height is not None]
    if not known:
        return np.full(len(time_s), np.nan)
    at_s, height_m = np.array(known).T
    return np.asarray(np.interp(time_s, at_s, height_m))


def settled_names(steps: Sequence[BodyStepEstimate]) -> dict[int, str]:
    """The class that each step, by its end in ns, was said to have had some steps later."""
    return {one.time_ns: one.name for one in (step.settled for step in steps) if one is not None}


def body_floors(steps: Sequence[BodyStepEstimate]) -> Floors | None:
    """The floors that steps told; None if none did."""
    told = [(step.time_ns / _NS_PER_S, step.height.floor) for step in steps if step.height is not None]
    if not told:
        return None
    time_s, number = np.array(told, dtype=np.float64).T
    return Floors(time_s, number)


def body_chain(steps: Sequence[BodyStepEstimate]) -> StepChain | None:
    """The steps as the consistency check reads them: straight ahead, then a turn to the next one's azimuth."""
    if not steps:
        return None
    azimuth = np.array([step.track_azimuth_rad for step in steps])
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
