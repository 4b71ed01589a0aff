"""What a camera's odometry would tell of a simulated walk: motions from key frames, of a camera that sits askew."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from bootprint.bus import Envelope
from bootprint.messages import CameraMotion, upper_triangle
from support.foot_walks import NS, SPEED_M_S, T0, SimulatedWalk, envelope

PERIOD_S, KEY_EVERY = 0.1, 5


@dataclass
class WalkingCamera:
    """Tilted by ``mounting`` against its wearer, not seeing anything in ``blind_s`` (from, to)."""

    mounting: Rotation = field(default_factory=Rotation.identity)
    scale: float = 1.0
    sigma_m: float = 0.002
    sigma_rad: float = 0.0005
    blind_s: tuple[float, float] = (-1.0, -1.0)
    place: str = "camera"

    def messages(self, walk: SimulatedWalk, from_s: float = 0.0) -> list[Envelope]:
        """Ten motions a second, each from the newest key frame."""
        rng = np.random.default_rng(4)
        return [
            envelope("camera_motion", self.place, self._motion(walk, number, first, last, rng))
            for number, (first, last) in enumerate(self._spans(walk, from_s))
        ]

    def _spans(self, walk: SimulatedWalk, from_s: float) -> Iterable[tuple[float, float]]:
        key: float | None = None
        for index in range(round(from_s / PERIOD_S), round((walk.walk_s + walk.stand_s) / PERIOD_S)):
            time_s = index * PERIOD_S
            if self.blind_s[0] <= time_s < self.blind_s[1]:
                key = None
            elif key is None:
                key = time_s
            else:
                yield key, time_s
                key = time_s if time_s - key > (KEY_EVERY - 0.5) * PERIOD_S else key

    def _motion(
        self, walk: SimulatedWalk, number: int, first: float, last: float, rng: np.random.Generator
    ) -> CameraMotion:
        (start, attitude), (end, later) = (self.pose(walk, time_s) for time_s in (first, last))
        sigmas = np.array([self.sigma_m] * 3 + [self.sigma_rad] * 3)
        noise = rng.normal(size=6) * sigmas
        shift = self.scale * attitude.inv().apply(end - start) + noise[:3]
        turn = (attitude.inv() * later).as_rotvec() + noise[3:]
        return CameraMotion(
            time_ns=T0 + round(last * NS),
            sequence=number,
            start_time_ns=T0 + round(first * NS),
            translation_m=(float(shift[0]), float(shift[1]), float(shift[2])),
            rotation_rad=(float(turn[0]), float(turn[1]), float(turn[2])),
            covariance=upper_triangle(np.diag(sigmas**2)),
        )

    def pose(self, walk: SimulatedWalk, time_s: float) -> tuple[np.ndarray, Rotation]:
        """Where the camera is and how it is turned."""
        east, north, yaw = walk.path(SPEED_M_S * min(time_s, walk.walk_s))
        return np.array([east, north, 1.6]), Rotation.from_euler("Z", yaw) * self.mounting
