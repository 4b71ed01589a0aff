"""Ranges between soldiers and between feet, as ultra-wideband radios measure them.

Through walls the first path is weak or lost: ranges come out too long (never too short), are reported with the same
sigma as the others, and fail earlier. A few are plainly wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from proving_ground.motion import FloatArray, Motion
from proving_ground.sensors.mounting import Mounting
from proving_ground.sensors.places import Walls
from sensor_gateway.recordings.run import RangeSeries


@dataclass(frozen=True)
class Peer:
    """Somebody to range with: the name in the message (soldier id, ``soldier/left_foot``) and their radio."""

    name: str
    motion: Motion
    mounting: Mounting = field(default_factory=Mounting)


@dataclass(frozen=True, slots=True)
class RangeQuality:
    """A radio. A wall adds ``wall_bias_m`` (mean, exponential) and takes ``wall_cost_m`` of its reach."""

    source: str
    rate_hz: float
    sigma_m: float = 0.10
    wall_bias_m: float = 0.3
    wall_cost_m: float = 12.0
    reach_m: float = 60.0
    loss_share: float = 0.05
    outlier_share: float = 0.01
    outlier_m: float = 5.0
    offset_m: float = 0.03


RANGE_CLASSES = {
    "soldiers": RangeQuality(
        "a radio like Qorvo's DWM1000, as commonly quoted: 10 cm; reach and excess on the body are guesses",
        1.0,
    ),
    "feet": RangeQuality(
        "the same radio on both boots, pointing at each other",
        10.0,
        sigma_m=0.05,
        reach_m=5.0,
        outlier_share=0.005,
        outlier_m=1.0,
        offset_m=0.02,
    ),
}


@dataclass(frozen=True)
class Ranging:
    """With whom one radio ranges, and what is in between; ``slabs_m``: heights of floors, as good as walls."""

    peers: Sequence[Peer]
    walls: Walls = field(default_factory=Walls)
    slabs_m: tuple[float, ...] = ()

    def obstacles(self, from_m: FloatArray, to_m: FloatArray) -> npt.NDArray[np.int64]:
        """Walls and floors between points (n, 3) and (n, 3), (n,)."""
        count = self.walls.between(from_m, to_m)
        for height in self.slabs_m:
            count = count + ((from_m[:, 2] < height) != (to_m[:, 2] < height))
        return count


def measure_ranges(
    motion: Motion,
    duration_s: float,
    mounting: Mounting,
    quality: RangeQuality,
    ranging: Ranging,
    rng: np.random.Generator,
) -> RangeSeries:
    """Ranges to every peer in turn, each at the radio's rate, until ``duration_s``; in order of time."""
    slot_s = 1.0 / quality.rate_hz / max(1, len(ranging.peers))
    parts = [
        _ranges_to(peer, number * slot_s, motion, duration_s, mounting, quality, ranging, rng)
        for number, peer in enumerate(ranging.peers)
    ]
    time_s = np.concatenate([np.zeros(0), *(part[0] for part in parts)])
    distance_m = np.concatenate([np.zeros(0), *(part[1] for part in parts)])
    names = [peer.name for peer, part in zip(ranging.peers, parts, strict=True) for _ in part[0]]
    order = np.argsort(time_s, kind="stable")
    peers = tuple(names[row] for row in order)
    return RangeSeries(time_s[order], peers, distance_m[order], np.full(len(order), quality.sigma_m))


def _ranges_to(
    peer: Peer,
    first_s: float,
    motion: Motion,
    duration_s: float,
    mounting: Mounting,
    quality: RangeQuality,
    ranging: Ranging,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Times and distances, (k,) each, of those that arrived."""
    time_s = np.arange(first_s, duration_s, 1.0 / quality.rate_hz)
    here_m, _ = mounting.carried(motion, time_s)
    there_m, _ = peer.mounting.carried(peer.motion, time_s)
    true_m = np.linalg.norm(there_m - here_m, axis=1)
    walls = ranging.obstacles(here_m, there_m)
    count = len(time_s)
    excess = np.where(walls > 0, rng.gamma(np.maximum(walls, 1), quality.wall_bias_m, count), 0.0)
    wrong = (rng.random(count) < quality.outlier_share) * rng.exponential(quality.outlier_m, count)
    noise = rng.normal(0.0, quality.sigma_m, count) + rng.normal(0.0, quality.offset_m)
    reached = true_m + walls * quality.wall_cost_m <= quality.reach_m
    kept = reached & (rng.random(count) >= quality.loss_share)
    return time_s[kept], np.maximum(true_m + excess + wrong + noise, 0.0)[kept]
