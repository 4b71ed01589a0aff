"""What is remembered of each foot beside the filter: its sequence, its last stride, where it was of late."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.messages import FootPose, FootStep, MotionClass, Vector3
from fusion.joining import Joining
from fusion.state import Array, FootBlock

_MOST_MISSING = 1000
_SAMPLES = 8
_GAP_S = 1.0  # between one step's end and the next one's start: more is time nobody saw
_LONGEST_GAP_S = 60.0  # after this nothing is known anyway


@dataclass(slots=True)
class StepLedger:
    """Which steps of a foot have been taken into account: each once, and those missing are known."""

    last: int | None = None
    missing: set[int] = field(default_factory=set)

    def enter(self, sequence: int, newer: bool) -> int | None:
        """Enter a step; how many were lost just before it, or None if it is a duplicate.

        A number that goes back on a ``newer`` step (later than the last) means that the sender began anew.
        """
        if self.last is None or sequence == self.last + 1:
            self.last = sequence
            return 0
        if sequence > self.last:
            lost = sequence - self.last - 1
            self.missing.update(range(max(self.last + 1, sequence - _MOST_MISSING), sequence))
            self.last = sequence
            return lost
        if sequence in self.missing:
            self.missing.remove(sequence)
            return 0
        return self._begin_anew(sequence) if newer else None

    def _begin_anew(self, sequence: int) -> int:
        self.missing.clear()
        self.last = sequence
        return 1  # at least what fell into the restart


@dataclass(frozen=True, slots=True)
class Stride:
    """The newest step composed, for speed and course."""

    displacement_m: Vector3
    turn_rad: float
    duration_s: float
    lateral_sigma_m: float

    @property
    def length_m(self) -> float:
        """Horizontal length."""
        return math.hypot(self.displacement_m[0], self.displacement_m[1])

    @property
    def speed_m_s(self) -> float:
        """Horizontal speed over the stride."""
        return self.length_m / self.duration_s if self.duration_s > 0.0 else 0.0


@dataclass(slots=True)
class Foot:
    """One boot."""

    block: FootBlock
    active: bool = False
    ledger: StepLedger = field(default_factory=StepLedger)
    own: Array = field(default_factory=lambda: np.zeros(4))  # pose in its own frame while not active
    joining: Joining | None = None
    end_ns: int | None = None
    heard_ns: int | None = None
    offset: Vector3 = (0.0, 0.0, 0.0)
    stride: Stride | None = None
    motion: MotionClass = "unknown"
    stepped: bool = False  # since the feet were last coupled
    samples: deque[tuple[int, Array]] = field(default_factory=lambda: deque(maxlen=_SAMPLES))

    @property
    def place(self) -> str:
        """The name of the foot, e.g. ``left_foot``."""
        return self.block.place

    def is_heard(self, now_ns: int, within_s: float) -> bool:
        """Whether a message of this foot is not older than ``within_s``."""
        return self.heard_ns is not None and now_ns - self.heard_ns <= within_s * NS_PER_S

    def untracked_s(self, step: FootStep, lost: int) -> float:
        """How long this foot went unobserved up to the end of ``step``; half a second a lost step at least.

        A realigned step had its stream broken within and does not tell the whole way.
        """
        gap_s = 0.0 if self.end_ns is None else (step.start_time_ns - self.end_ns) / NS_PER_S
        broken_s = max(0.0, (step.time_ns - step.start_time_ns) / NS_PER_S) if step.realigned else 0.0
        if lost == 0 and gap_s < _GAP_S:
            return min(broken_s, _LONGEST_GAP_S)
        return min(broken_s + max(gap_s, 0.5 * lost), _LONGEST_GAP_S)

    def note_step(self, step: FootStep, lateral_sigma_m: float) -> None:
        """This step has been composed."""
        duration_s = max(0, step.time_ns - step.start_time_ns) / NS_PER_S
        self.stride = Stride(step.displacement_m, step.heading_change_rad, duration_s, lateral_sigma_m)
        self.offset = (0.0, 0.0, 0.0)
        self.motion = step.motion

    def note_pose(self, pose: FootPose) -> bool:
        """Take where the foot is since its last step; False if the pose belongs to another step."""
        self.hear(pose.time_ns)
        if self.ledger.last is None or pose.step_sequence != self.ledger.last:
            return False
        self.offset = pose.displacement_m
        return True

    def hear(self, time_ns: int) -> None:
        """A message of this foot with this stamp has been handled."""
        self.heard_ns = time_ns if self.heard_ns is None else max(self.heard_ns, time_ns)

    def at(self, time_ns: int) -> Array:
        """Where the foot was, between the samples around that time (the nearest one beyond them), (3,) m."""
        before = self.samples[0]
        for sample in self.samples:
            if sample[0] > time_ns:
                return _between(before, sample, time_ns)
            before = sample
        return before[1]

    def relocate(self, to: Callable[[Array], Array]) -> None:
        """The filter has moved this foot; where it was of late moves with it."""
        moved = [(time_ns, to(point)) for time_ns, point in self.samples]
        self.samples.clear()
        self.samples.extend(moved)


def _between(before: tuple[int, Array], after: tuple[int, Array], time_ns: int) -> Array:
    if time_ns <= before[0]:
        return before[1]
    share = (time_ns - before[0]) / (after[0] - before[0])
    return before[1] + share * (after[1] - before[1])
