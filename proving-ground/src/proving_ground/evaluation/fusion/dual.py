"""Each foot of a dual run as fusion has it: what `bootprint evaluate --kind dual` shows beside the fused position.

The steps and poses of both feet go in the order of their times through the feet's part of fusion, without a start
or satellites. A foot that joins the other later is followed back from there by its own steps.
"""

import time
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from bootprint.bus import Envelope
from bootprint.config import convert
from bootprint.messages import FootPose, FootStep
from bootprint.topics import Identity
from fusion.boots import Boots
from fusion.config import FusionConfig
from fusion.smoother import Smoother
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from proving_ground.evaluation.alignment import Track
from proving_ground.evaluation.fusion.joint_ins import METHOD as JOINT
from proving_ground.evaluation.fusion.joint_ins import joint_tracks
from sensor_gateway.recordings.run import FEET, Run
from sensor_gateway.sources.run_messages import run_messages

DEFAULT_COUPLING = "passing"
COUPLINGS: Mapping[str, str] = {"same-position": "same_position", "uncoupled": "none"}
"""Methods of holding two feet together, beside the default, by their names in ``[fusion.boots]``."""
OWN_METHODS = (*COUPLINGS, JOINT)
"""Those of two feet only."""
_IDENTITY = Identity("evaluate", "evaluate", "evaluate")
_ORDER = {"foot_step": 0, "foot_pose": 1}


@dataclass(frozen=True, slots=True)
class FusedFeet:
    """Tracks of both feet in one frame, and what they cost."""

    tracks: Mapping[str, Track]
    samples: int
    seconds: float


def fused_feet(run: Run, method: str | None, *, smoothed: bool = False) -> FusedFeet:
    """Both feet of a run, causal or smoothed; ``method`` is a foot method, one of `COUPLINGS`, or `JOINT`."""
    messages = [] if method == JOINT else foot_messages(run, None if method in COUPLINGS else method)
    begin = time.thread_time()
    if method == JOINT:
        tracks = joint_tracks({place: run.imus[place] for place in FEET})
    else:
        tracks = feet_through(messages, COUPLINGS.get(str(method), DEFAULT_COUPLING), smoothed=smoothed)
    samples = sum(len(run.imus[place].time_s) for place in FEET if place in run.imus)
    return FusedFeet(tracks, samples, time.thread_time() - begin)


def foot_messages(run: Run, method: str | None = None) -> list[Envelope]:
    """What pdr-engine says of a run's feet, in the order of time, a step before its own poses."""
    feet = [place for place in FEET if place in run.imus]
    foot = {} if method is None else {"foot": {"method": method}}
    core = EngineCore(convert({"places": feet, **foot}, PdrConfig, where="--method"), _IDENTITY)
    said = [said for envelope in run_messages(run, _IDENTITY, 0) for said in core.handle(envelope)]
    heard = [envelope for envelope in (*said, *core.close()) if envelope.address.subject in _ORDER]
    return sorted(
        heard, key=lambda one: (one.message.time_ns, _ORDER[one.address.subject], one.address.source)
    )


def feet_through(
    messages: Iterable[Envelope], coupling: str = DEFAULT_COUPLING, *, smoothed: bool = False
) -> dict[str, Track]:
    """The feet's tracks out of fusion, in its boots frame."""
    config = convert({"boots": {"coupling": coupling}}, FusionConfig, where="--method")
    boots = Boots(config, Counter())
    smoother = Smoother(boots)
    for envelope in messages:
        if isinstance(envelope.message, FootStep):
            boots.step(envelope.address.source, envelope.message)
        elif isinstance(envelope.message, FootPose):
            boots.pose(envelope.address.source, envelope.message)
    found = smoother.smoothed() if smoothed else smoother.causal()
    return {place: Track(track.time_s, track.position_m) for place, track in found.items()}


def between(tracks: Mapping[str, Track], rate_hz: float = 5.0) -> Track:
    """The body over the mean of its feet, while all of them are known."""
    begin = max(track.time_s[0] for track in tracks.values())
    end = min(track.time_s[-1] for track in tracks.values())
    time_s = np.arange(begin, end, 1.0 / rate_hz)
    return Track(time_s, np.mean([track.at(time_s) for track in tracks.values()], axis=0))
