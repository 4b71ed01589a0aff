"""Simulated walks as the foot INS would report them: FootStep and FootPose messages of both feet, with truth.

A body goes along a path at constant speed; each foot stands beside it, once a stride, the feet half a stride
apart. A foot's step frame is turned against the walking direction by its mounting, and its reported steps carry
noise of exactly the covariance they state, plus a heading drift that they do not.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.messages import FootPose, FootStep, Message, upper_triangle
from bootprint.topics import Identity
from fusion.config import StartConfig

NS = 1_000_000_000
T0 = 1_700_000_000 * NS
WHO = Identity("bp", "alpha", "a1")
ORIGIN = Origin(latitude_deg=58.4, longitude_deg=15.6, height_m=80.0)
EAST = StartConfig(east_m=0.0, north_m=0.0, sigma_m=0.2, azimuth_deg=90.0, azimuth_sigma_deg=1.0)
"""Where the walks begin, and which way they go."""
STRIDE_S = 1.2
SPEED_M_S = 1.4
FloatArray = npt.NDArray[np.float64]
Path = Callable[[float], tuple[float, float, float]]  # metres walked -> east, north, yaw


def straight(yaw: float) -> Path:
    """Straight on, from the origin."""
    return lambda s: (s * math.cos(yaw), s * math.sin(yaw), yaw)


def rectangle(width_m: float, depth_m: float) -> Path:
    """Round and round a rectangle, counter-clockwise from the origin, first to the east."""
    corners = [(0.0, 0.0), (width_m, 0.0), (width_m, depth_m), (0.0, depth_m)]
    sides = [width_m, depth_m, width_m, depth_m]

    def at(s: float) -> tuple[float, float, float]:
        s %= sum(sides)
        for index, side in enumerate(sides):
            yaw = index * math.pi / 2
            if s < side:
                break
            s -= side
        return corners[index][0] + s * math.cos(yaw), corners[index][1] + s * math.sin(yaw), yaw

    return at


@dataclass(frozen=True)
class SimulatedFoot:
    """How one foot reports."""

    place: str
    mounting_rad: float = 0.0
    sideways_m: float = 0.0
    phase_s: float = 0.0
    drift_rad_s: float = 0.0
    sigmas: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


LEFT = SimulatedFoot("left_foot", mounting_rad=1.0, sideways_m=0.12)
RIGHT = SimulatedFoot("right_foot", mounting_rad=-2.0, sideways_m=-0.12, phase_s=0.6)


@dataclass
class SimulatedWalk:
    """A walk of ``walk_s`` seconds along a path, then standing for ``stand_s``."""

    path: Path
    walk_s: float
    stand_s: float = 2.0
    stated: tuple[float, float, float, float] = (0.01, 0.01, 0.01, 0.002)
    poses: bool = True
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(1))

    def stance(self, foot: SimulatedFoot, time_s: float) -> FloatArray:
        """True pose (east, north, up, yaw of the step frame) of the foot's stance that ends at ``time_s``."""
        at_s = max(0.0, min(time_s, self.walk_s) - STRIDE_S / 4)
        east, north, yaw = self.path(SPEED_M_S * at_s)
        side = foot.sideways_m
        return np.array(
            [east - side * math.sin(yaw), north + side * math.cos(yaw), 0.0, yaw + foot.mounting_rad]
        )

    def foot_at(self, foot: SimulatedFoot, time_s: float) -> FloatArray:
        """True place (east, north) of a foot: it swings in the first part of a stride, then stands."""
        times = np.array(self.times(foot))
        index = int(np.clip(np.searchsorted(times, time_s, side="right") - 1, 0, len(times) - 2))
        start, end = (self.stance(foot, times[index + ahead])[:2] for ahead in (0, 1))
        result: FloatArray = start + _swing(time_s - times[index]) * (end - start)
        return result

    def body(self, *feet: SimulatedFoot, time_s: float) -> FloatArray:
        """True place (east, north) of the body: over the mean of its feet."""
        return np.mean([self.foot_at(foot, time_s) for foot in feet], axis=0)

    def times(self, foot: SimulatedFoot) -> list[float]:
        """When the foot's stances end: once a stride, then every half second."""
        walking = list(np.arange(foot.phase_s, self.walk_s, STRIDE_S))
        return [*walking, *np.arange(walking[-1] + STRIDE_S, self.walk_s + self.stand_s, 0.5)]

    def messages(self, foot: SimulatedFoot) -> list[Envelope]:
        """Everything the foot INS says of this foot, in order of time."""
        out: list[Envelope] = []
        poses = itertools.count()
        times = self.times(foot)
        for sequence, (before_s, time_s) in enumerate(itertools.pairwise(times)):
            start, end = self.stance(foot, before_s), self.stance(foot, time_s)
            out.append(self._step(foot, sequence, before_s, time_s, start, end))
            if self.poses and sequence + 2 < len(times):
                out.extend(self._poses(foot, sequence, poses, time_s, times[sequence + 2]))
        return out

    def _step(
        self,
        foot: SimulatedFoot,
        sequence: int,
        before_s: float,
        time_s: float,
        start: FloatArray,
        end: FloatArray,
    ) -> Envelope:
        noise = self.rng.normal(size=4) * foot.sigmas
        forward, left = _turned(end[:2] - start[:2], -start[3])
        turn = end[3] - start[3] + noise[3] + foot.drift_rad_s * (time_s - before_s)
        moving = math.hypot(forward, left) > 0.05
        message = FootStep(
            time_ns=T0 + round(time_s * NS),
            sequence=sequence,
            start_time_ns=T0 + round(before_s * NS),
            displacement_m=(forward + noise[0], left + noise[1], float(noise[2])),
            heading_change_rad=math.remainder(turn, 2 * math.pi),
            covariance=upper_triangle(np.diag(np.square(self.stated))),
            motion="walking" if moving else "standing",
        )
        return envelope("foot_step", foot.place, message)

    def _poses(
        self, foot: SimulatedFoot, sequence: int, poses: Iterator[int], start_s: float, end_s: float
    ) -> list[Envelope]:
        start, end = self.stance(foot, start_s), self.stance(foot, end_s)
        out = []
        for tick in range(math.ceil(start_s * 10 + 1e-6), math.ceil(end_s * 10 - 1e-6)):
            smooth = _swing(tick / 10 - start_s)
            forward, left = _turned(smooth * (end[:2] - start[:2]), -start[3])
            message = FootPose(
                time_ns=T0 + round(tick / 10 * NS),
                sequence=next(poses),
                step_sequence=sequence,
                displacement_m=(forward, left, 0.0),
                heading_change_rad=smooth * (end[3] - start[3]),
                speed_m_s=1.0,
                in_stance=smooth >= 1.0,
            )
            out.append(envelope("foot_pose", foot.place, message))
        return out


def envelope(subject: str, source: str, message: Message) -> Envelope:
    """A message of the simulated soldier."""
    return Envelope(WHO.address(subject, source), message)


def in_time_order(*streams: list[Envelope]) -> list[Envelope]:
    """All streams as they would arrive over a perfect bus."""
    return sorted((e for stream in streams for e in stream), key=lambda e: (e.message.time_ns, e.address.key))


def _swing(since_s: float) -> float:
    share = min(1.0, max(0.0, since_s / (0.6 * STRIDE_S)))
    return share * share * (3 - 2 * share)


def _turned(vector: FloatArray, yaw: float) -> tuple[float, float]:
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return float(cosine * vector[0] - sine * vector[1]), float(sine * vector[0] + cosine * vector[1])
