"""What is remembered of each foot beside the filter: its sequence, its last stride, where it was of late."""

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.messages import FootPose, FootStep, MotionClass, Vector3, upper_triangle
from fusion.joining import Joining
from fusion.state import Array, FootBlock
from fusion.trail import Trail

MOVING_M = 0.1  # a shorter step is standing
_MOST_MISSING = 1000
COARSE_STEP = np.diag([0.1, 0.1, 0.1, 0.05]) ** 2  # for a step that states no covariance
_SAME_STANCE_NS = 300_000_000  # a pose so long before a step's start is of the same stance
_POOR, _GOOD = 0.2, 0.5  # mean quality of recent strides
_RECENT = 6  # strides by which a foot is judged
_PAUSE_NS = 400_000_000  # without a word of who speaks ten times a second: the stream may have broken
_SHORT_HOLE = 0.25  # of a time that somebody else was in the dark
_GAP_S = 1.0  # between one step's end and the next one's start: more is time nobody saw
_LONGEST_GAP_S = 60.0  # after this nothing is known anyway

Span = tuple[int, int]  # UTC ns from, until


@dataclass(frozen=True, slots=True)
class Entry:
    """A step that is new: how many were lost just before it (bounded), or whether its sender began anew."""

    lost: int = 0
    anew: bool = False

    @property
    def unseen(self) -> int:
        """Steps that at least were not seen: those lost, or what fell into the restart."""
        return max(self.lost, int(self.anew))


@dataclass(slots=True)
class StepLedger:
    """Which steps of a foot have been taken into account: each once, and those missing are known."""

    last: int | None = None
    missing: set[int] = field(default_factory=set)

    def enter(self, sequence: int, newer: bool) -> Entry | None:
        """Enter a step; None if it is a duplicate.

        A number that goes back on a ``newer`` step (later than the last) means that the sender began anew.
        """
        if self.last is None or sequence == self.last + 1:
            self.last = sequence
            return Entry()
        if sequence > self.last:
            return self._skip_to(sequence)
        if newer:
            self.missing.clear()
            self.last = sequence
            return Entry(anew=True)
        if sequence in self.missing:
            self.missing.remove(sequence)
            return Entry()
        return None

    def has(self, sequence: int) -> bool:
        """Whether a step of this number has been entered."""
        return self.last is not None and sequence <= self.last and sequence not in self.missing

    def _skip_to(self, sequence: int) -> Entry:
        """So many missing at once, and in all, are remembered and counted; more is a number that is wrong."""
        assert self.last is not None
        skipped = range(max(self.last + 1, sequence - _MOST_MISSING), sequence)
        self.missing = set(sorted(self.missing.union(skipped))[-_MOST_MISSING:])
        self.last = sequence
        return Entry(lost=len(skipped))


@dataclass(frozen=True, slots=True)
class Stride:
    """The newest step composed, for speed and course."""

    displacement_m: Vector3
    turn_rad: float
    duration_s: float
    lateral_sigma_m: float
    quality: float = 1.0  # 0 to 1, as the foot INS says

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
    pose: FootPose | None = None  # the newest since its last step
    stride: Stride | None = None
    motion: MotionClass = "unknown"
    refused: bool = False  # it had to leave, and has not joined again
    since_compass_m: float = 0.0  # walked since its magnetometer was looked at
    strayed: bool = False  # its poses are out of the other foot's reach: it stands for nothing until it steps
    stepped: bool = False  # since the feet were last coupled
    recent: deque[Stride] = field(default_factory=lambda: deque(maxlen=_RECENT))
    trail: Trail = field(default_factory=Trail)
    dark: Span | None = None  # the newest time of which its track does not tell, as far as is known

    @property
    def place(self) -> str:
        """The name of the foot, e.g. ``left_foot``."""
        return self.block.place

    @property
    def carries(self) -> bool:
        """Whether the body is over this foot, among others."""
        return self.active and not self.strayed

    @property
    def quality(self) -> float | None:
        """Mean of the recent strides', 0 to 1; None while there are too few to say."""
        few = len(self.recent) < _RECENT
        return None if few else sum(stride.quality for stride in self.recent) / len(self.recent)

    def is_poor_beside(self, other: "Foot") -> bool:
        """Whether this foot's strides are bad where the other's, on the same way, are good."""
        own, others = self.quality, other.quality
        return own is not None and others is not None and own < _POOR and others > _GOOD

    def is_heard(self, now_ns: int, within_s: float) -> bool:
        """Whether a message of this foot is not older than ``within_s``."""
        return self.heard_ns is not None and now_ns - self.heard_ns <= within_s * NS_PER_S

    def is_ahead(self, time_ns: int, by_s: float) -> bool:
        """Whether this foot has been heard more than ``by_s`` after that time."""
        return self.heard_ns is not None and self.heard_ns - time_ns > by_s * NS_PER_S

    def lay_dark(self, step: FootStep, untracked_s: float) -> Span | None:
        """Remember in which time lies what went unobserved up to the end of ``step``; None if nothing did.

        A step whose stream held tells its time, though poses may have paused meanwhile.
        """
        if untracked_s > 0.0:
            since_ns = step.start_time_ns if self.end_ns is None else min(self.end_ns, step.start_time_ns)
            self.dark = since_ns, step.time_ns if step.realigned else step.start_time_ns
            return self.dark
        if self.dark is not None and step.start_time_ns <= self.dark[0]:
            self.dark = (step.time_ns, self.dark[1]) if step.time_ns < self.dark[1] else None
        return None

    def saw(self, span: Span) -> bool:
        """Whether its track tells of that time, but for a hole that is short beside it.

        Poses that go on after a pause may be of a stream that broke: that shows in the next step.
        """
        if self.dark is None:
            return True
        missed_ns = min(self.dark[1], span[1]) - max(self.dark[0], span[0])
        return missed_ns <= 0 or missed_ns < _SHORT_HOLE * (span[1] - span[0])

    def untracked_s(self, step: FootStep, unseen: int) -> float:
        """How long this foot went unobserved up to the end of ``step``; half a second an unseen step at least.

        A realigned step had its stream broken within and does not tell the whole way.
        """
        gap_s = 0.0 if self.end_ns is None else (step.start_time_ns - self.end_ns) / NS_PER_S
        broken_s = max(0.0, (step.time_ns - step.start_time_ns) / NS_PER_S) if step.realigned else 0.0
        if unseen == 0 and gap_s < _GAP_S:
            return min(broken_s, _LONGEST_GAP_S)
        return min(broken_s + max(gap_s, 0.5 * unseen), _LONGEST_GAP_S)

    def uncarried_s(self, untracked_s: float, carried_ns: int | None) -> float:
        """What of a time unobserved no other source has told."""
        if carried_ns is None or self.end_ns is None:
            return untracked_s
        return max(0.0, untracked_s - max(0, carried_ns - self.end_ns) / NS_PER_S)

    def note_step(self, step: FootStep, lateral_sigma_m: float) -> None:
        """This step has been composed."""
        duration_s = max(0, step.time_ns - step.start_time_ns) / NS_PER_S
        quality = 1.0 if step.quality_pct is None else step.quality_pct / 100.0
        moved, turned = step.displacement_m, step.heading_change_rad
        self.stride = Stride(moved, turned, duration_s, lateral_sigma_m, quality)
        if self.stride.length_m > MOVING_M:
            self.recent.append(self.stride)
        self.offset, self.pose = (0.0, 0.0, 0.0), None
        self.motion = step.motion

    def substitute(self, step: FootStep) -> FootStep | None:
        """For a step lost just before this one: what the last pose before it told, if that was in its stance."""
        pose = self.pose
        if pose is None or self.end_ns is None or not pose.in_stance:
            return None
        if not 0 <= step.start_time_ns - pose.time_ns <= _SAME_STANCE_NS:
            return None
        return FootStep(
            time_ns=step.start_time_ns,
            sequence=step.sequence - 1,
            start_time_ns=self.end_ns,
            displacement_m=pose.displacement_m,
            heading_change_rad=pose.heading_change_rad,
            covariance=upper_triangle(COARSE_STEP),
            motion=self.motion,
        )

    def note_pose(self, pose: FootPose) -> bool:
        """Take where the foot is since its last step; False if the pose belongs to another step."""
        if self.heard_ns is not None and pose.time_ns - self.heard_ns > _PAUSE_NS:
            self.dark = self.heard_ns, pose.time_ns
        self.hear(pose.time_ns)
        if self.ledger.last is None or pose.step_sequence != self.ledger.last:
            return False
        self.offset, self.pose = pose.displacement_m, pose
        return True

    def hear(self, time_ns: int) -> None:
        """A message of this foot with this stamp has been handled."""
        self.heard_ns = time_ns if self.heard_ns is None else max(self.heard_ns, time_ns)

    def shift(self, by_ns: int) -> None:
        """The clock has been set: what was remembered by the old one."""
        self.end_ns = None if self.end_ns is None else self.end_ns + by_ns
        self.heard_ns = None if self.heard_ns is None else self.heard_ns + by_ns
        self.dark = None if self.dark is None else (self.dark[0] + by_ns, self.dark[1] + by_ns)
        self.trail.shift(by_ns)
