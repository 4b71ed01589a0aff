"""A camera over a recorded run: stereo pairs through odometry (or motions as recorded), put end to end to a track.

Where nothing was to be seen the track goes on as it went, for a second, and then stands: a camera alone knows no
better.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from bootprint.errors import ConfigError, RecordingError
from bootprint.messages import CameraMotion
from bootprint.topics import Identity
from fusion.camera_chain import CameraChain, CameraStep
from fusion.models import camera as model
from proving_ground.evaluation.alignment import FloatArray, Track
from proving_ground.evaluation.consistency import StepChain
from sensor_gateway.recordings.run import Run
from sensor_gateway.sources.run_messages import run_messages

METHODS = ("key-frames",)
PLACE = "camera"
_GOES_ON_S = 1.0
_UNSEEN_M_S, _UNSEEN_RAD = 3.0, 1.0  # what may have happened in a second that nobody saw
_NS_PER_S = 1e9


@dataclass
class Walked:
    """What odometry told of a run: a position a pair (n, 3), motions, finished steps, verdicts by kind, cost."""

    time_s: list[float] = field(default_factory=list)
    position_m: list[FloatArray] = field(default_factory=list)
    steps: list[CameraStep] = field(default_factory=list)
    verdicts: dict[str, int] = field(default_factory=dict)
    motions: list[CameraMotion] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def track(self) -> Track:
        """The track, z up, in the run's frame but for yaw and offset."""
        return Track(np.array(self.time_s), np.array(self.position_m))

    @property
    def chain(self) -> StepChain | None:
        """The steps as the consistency check reads them."""
        if not self.steps:
            return None
        plane = np.ix_([0, 1, 3], [0, 1, 3])
        return StepChain(
            time_s=np.array([self.steps[0].start_ns, *(step.time_ns for step in self.steps)]) / _NS_PER_S,
            displacement_m=np.array([step.displacement_m[:2] for step in self.steps]),
            heading_change_rad=np.array([step.turn_rad for step in self.steps]),
            covariance=np.array([step.covariance[plane] for step in self.steps]),
            climb_m=np.array([step.displacement_m[2] for step in self.steps]),
            climb_variance_m2=np.array([step.covariance[2, 2] for step in self.steps]),
        )


class _Walker:
    """Puts motions end to end, and bridges what nobody saw."""

    def __init__(self, attitude: FloatArray, start_ns: int) -> None:
        self.walked = Walked()
        self._chain = CameraChain(attitude)
        self._place = np.zeros(3)  # where the newest finished step ended
        self._end_ns = start_ns
        self._velocity = np.zeros(3)
        self.note(start_ns)

    def take(self, motion: CameraMotion) -> None:
        """The odometry has told a motion."""
        self.walked.motions.append(motion)
        yaw = model.heading(self._chain.attitude)
        finished = self._chain.take(motion)
        if finished is not None:
            self._add(finished, yaw)
        if motion.start_time_ns > self._end_ns:
            self._bridge(motion.start_time_ns)
        self.note(motion.time_ns)

    def note(self, time_ns: int) -> None:
        """Where it is believed to be now."""
        place, pending = self._place, self._chain.pending()
        if pending is not None:
            moved = _ahead(model.heading(self._chain.attitude)) @ np.array(pending.displacement_m)
            place = self._place + moved
            self._velocity = moved / max((pending.time_ns - pending.start_ns) / _NS_PER_S, 1e-3)
        unseen_s = (time_ns - (self._end_ns if pending is None else pending.time_ns)) / _NS_PER_S
        self.walked.time_s.append(time_ns / _NS_PER_S)
        self.walked.position_m.append(place + self._velocity * min(max(unseen_s, 0.0), _GOES_ON_S))

    def end(self) -> Walked:
        """Nothing more will come."""
        yaw = model.heading(self._chain.attitude)
        last = self._chain.finish()
        if last is not None:
            self._add(last, yaw)
        return self.walked

    def _add(self, step: CameraStep, yaw: float) -> None:
        self.walked.steps.append(step)
        self._place = self._place + _ahead(yaw) @ np.array(step.displacement_m)
        self._end_ns = step.time_ns

    def _bridge(self, until_ns: int) -> None:
        """A step that nobody saw: as it went, give or take anything."""
        seconds = (until_ns - self._end_ns) / _NS_PER_S
        moved = _ahead(model.heading(self._chain.attitude)).T @ self._velocity * min(seconds, _GOES_ON_S)
        doubt = np.diag([(_UNSEEN_M_S * seconds) ** 2] * 3 + [_UNSEEN_RAD**2 * seconds])
        displacement = (float(moved[0]), float(moved[1]), float(moved[2]))
        yaw = model.heading(self._chain.attitude)
        self._add(CameraStep(self._end_ns, until_ns, displacement, 0.0, doubt), yaw)


def _ahead(yaw: float) -> FloatArray:
    """The matrix (3, 3) of a turn about up."""
    return np.asarray(model.turn_matrix((0.0, 0.0, yaw)))


def walk_camera(run: Run) -> Walked:
    """The whole run; ConfigError if it has no camera."""
    if run.stereo is not None:
        return _walk_images(run)
    if run.camera is None:
        raise ConfigError(f"{run.name}: no camera in this run")
    walker: _Walker | None = None
    begin = time.thread_time()
    for motion in _recorded(run):
        if walker is None:
            walker = _Walker(np.eye(3), motion.start_time_ns)
        walker.take(motion)
    if walker is None:
        raise RecordingError(f"{run.path}: no camera motion that can be used")
    walked = walker.end()
    walked.seconds = time.thread_time() - begin
    return walked


def _recorded(run: Run) -> Iterator[CameraMotion]:
    alone = Run(run.name, "camera", run.path, {}, camera=run.camera)
    for envelope in run_messages(alone, Identity("evaluate", "evaluate", "evaluate"), 0):
        if isinstance(envelope.message, CameraMotion):
            yield envelope.message


def _walk_images(run: Run) -> Walked:
    from sensor_gateway.recordings.camera_folder import pairs
    from sensor_gateway.stereo import Verdict
    from sensor_gateway.stereo.recorded import odometry_of

    assert run.stereo is not None
    stereo = run.stereo
    odometry = odometry_of(stereo, run.path)
    walker = _Walker(stereo.attitude, round(stereo.time_s[0] * _NS_PER_S))
    for pair in pairs(stereo):
        time_ns = round(pair.time_s * _NS_PER_S)
        begin = time.thread_time()
        told = odometry.feed(time_ns, pair.left, pair.right)
        walker.walked.seconds += time.thread_time() - begin
        if isinstance(told, Verdict):
            walker.walked.verdicts[told.condition] = walker.walked.verdicts.get(told.condition, 0) + 1
            if pair.time_s > stereo.time_s[0]:
                walker.note(time_ns)
        else:
            walker.take(told)
    return walker.end()
