"""Slow spoofers against fusion: a Monte Carlo, ``python -m proving_ground.evaluation.fusion.spoofing``.

A soldier walks crooked ways in the open. Steps are drawn at the level of messages, with errors of exactly the
kind and size that they state; satellites are the simulator's receiver (`proving_ground.sensors.gnss`), and a
spoofer pulls it away from the true place. Walks without a spoofer count false alarms. Seeds are every second whole
number from ``--first``: choices were made on even ones, figures are told of odd ones.
"""

import argparse
import itertools
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.spatial.transform import Rotation

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Origin
from bootprint.messages import FootStep, GnssFix, Position, upper_triangle
from bootprint.topics import Identity
from fusion.config import FusionConfig, StartConfig
from fusion.engine import FusionCore
from proving_ground.motion import FloatArray
from proving_ground.sensors.gnss import GNSS_CLASSES, measure_gnss
from proving_ground.sensors.gnss_conditions import GnssConditions, Zone
from proving_ground.sensors.mounting import Mounting
from proving_ground.sensors.places import Area

ORIGIN = Origin(latitude_deg=59.6, longitude_deg=17.9, height_m=15.0)
WHO = Identity("exercise", "alpha", "a1")
T0 = 1_700_000_000 * NS_PER_S
SPEED_M_S, _STRIDE_S = 1.3, 1.1
_STEP_SIGMA = np.array([0.02, 0.015, 0.02, 0.002])  # a step's own: forward, left, up m, heading rad
_SCALE_SIGMA, _SLOPE_SIGMA, _TURN_SIGMA_RAD_S = 0.0125, 0.0075, 3e-4
_COMPASS_LASTS_RAD, _COMPASS_OF_PLACE_RAD = 0.1, 0.1
FEET = (("left_foot", 0.8, 0.12, 0.0), ("right_foot", -1.1, -0.12, 0.5))  # mounting rad, beside m, phase
_EVERYWHERE = Area.disc((0.0, 0.0), 1e5, corners=8)
_CLEAR_S = 1.0
_GRID_M, _BEND_M = 0.25, 4.0  # points of a walk; over which a corner is turned


@dataclass(frozen=True)
class Walk:
    """A crooked way at constant speed, a point every `_GRID_M`; its own `Motion` (of who always looks north)."""

    points_m: FloatArray

    @classmethod
    def drawn(cls, duration_s: float, rng: np.random.Generator) -> "Walk":
        """Legs of 25 to 90 m, turning by up to 120° between."""
        count = int(duration_s * SPEED_M_S / 25.0) + 2
        lengths = rng.uniform(25.0, 90.0, count)
        headings = np.cumsum(rng.uniform(-2.1, 2.1, count))
        legs = np.repeat(headings, (lengths / _GRID_M).astype(np.int64))
        yaw = uniform_filter1d(legs, round(_BEND_M / _GRID_M), mode="nearest")
        steps = _GRID_M * np.column_stack([np.cos(yaw), np.sin(yaw)])
        return cls(np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]))

    def place(self, time_s: FloatArray) -> FloatArray:
        """Where the body is (n, 2) m."""
        gone = np.clip(time_s, 0.0, None) * SPEED_M_S / _GRID_M
        grid = np.arange(len(self.points_m))
        return np.column_stack([np.interp(gone, grid, axis) for axis in self.points_m.T])

    def yaw(self, time_s: float) -> float:
        """Direction walked in, rad."""
        (east, north), (east_on, north_on) = self.place(np.array([time_s, time_s + _GRID_M / SPEED_M_S]))
        return math.atan2(north_on - north, east_on - east)

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """`proving_ground.motion.Motion`."""
        return np.column_stack([self.place(time_s), np.zeros(len(time_s))]), Rotation.identity(len(time_s))


@dataclass(frozen=True, slots=True)
class Trial:
    """What to play: a spoofer that begins to pull with ``drag_m_s`` at ``from_s`` (never, if infinite)."""

    seed: int
    duration_s: float = 420.0
    drag_m_s: float = 0.5
    from_s: float = 240.0
    receiver: str = "honest"
    compass: bool = True


@dataclass(frozen=True, slots=True)
class Outcome:
    """``alarms_s``: when the receiver came to be distrusted. Horizontal errors (n,) m at ``time_s``."""

    trial: Trial
    alarms_s: tuple[float, ...]
    time_s: FloatArray
    error_m: FloatArray
    inside: FloatArray

    @property
    def detected_after_s(self) -> float:
        """From the spoofer's beginning to the first alarm after it; infinite if there was none."""
        return min(
            (at - self.trial.from_s for at in self.alarms_s if at >= self.trial.from_s), default=math.inf
        )

    @property
    def false_alarms(self) -> int:
        """Alarms before there was a spoofer."""
        return sum(at < self.trial.from_s for at in self.alarms_s)

    @property
    def worst_after_m(self) -> float:
        """Largest error from the spoofer's beginning on."""
        after = self.error_m[self.time_s >= self.trial.from_s]
        return float(after.max()) if after.size else math.nan


def play(trial: Trial) -> Outcome:
    """One walk; the same for the same trial."""
    rng = np.random.default_rng([trial.seed, 7])
    walk = Walk.drawn(trial.duration_s, rng)
    envelopes = [*steps_told(walk, trial, rng), *fixes_told(walk, trial, rng)]
    envelopes.sort(key=lambda envelope: (envelope.message.time_ns, envelope.address.key))
    heading_deg = math.degrees(0.5 * math.pi - walk.yaw(0.0))
    start = StartConfig(east_m=0.0, north_m=0.0, azimuth_deg=heading_deg, azimuth_sigma_deg=3.0)
    core = FusionCore(FusionConfig(start=start, rate_hz=1.0), WHO, ORIGIN, patient=True)
    out = [message for envelope in envelopes for message in core.handle(envelope)]
    return _outcome(trial, walk, _positions([*out, *core.close()]))


def _positions(envelopes: Sequence[Envelope]) -> list[Position]:
    return [envelope.message for envelope in envelopes if isinstance(envelope.message, Position)]


def _outcome(trial: Trial, walk: Walk, positions: Sequence[Position]) -> Outcome:
    time_s = np.array([(position.time_ns - T0) / NS_PER_S for position in positions])
    place = np.array([(position.east_m, position.north_m) for position in positions])
    miss = place - walk.place(time_s)
    spread = np.array([((c[0], c[1]), (c[1], c[3])) for c in (p.covariance_m2 for p in positions)])
    squared = np.einsum("ki,kij,kj->k", miss, np.linalg.inv(spread), miss)
    spoofed = ["spoofed" in position.rejections.values() for position in positions]
    begun = [now and not before for before, now in itertools.pairwise([False, *spoofed])]
    return Outcome(trial, tuple(time_s[begun]), time_s, np.hypot(*miss.T), squared < 5.991)


def steps_told(walk: Walk, trial: Trial, rng: np.random.Generator) -> Iterator[Envelope]:
    """What both feet's engines say of the walk, as wrong as they say."""
    for place, mounting, beside, phase in FEET:
        scale, slope = rng.normal(0.0, _SCALE_SIGMA), rng.normal(0.0, _SLOPE_SIGMA)
        turning, deviation = rng.normal(0.0, _TURN_SIGMA_RAD_S), rng.normal(0.0, _COMPASS_LASTS_RAD)
        times = np.arange(phase * _STRIDE_S, trial.duration_s, _STRIDE_S)
        stances = [stance(walk, time_s, mounting, beside) for time_s in times]
        address = WHO.address("foot_step", place)
        for number, ((from_s, to_s), (start, end)) in enumerate(
            zip(itertools.pairwise(times), itertools.pairwise(stances), strict=True)
        ):
            noise = rng.normal(0.0, _STEP_SIGMA)
            way = _turned(end[:2] - start[:2], -start[2]) / (1.0 + scale)
            turn = math.remainder(end[2] - start[2], math.tau) - turning * (to_s - from_s) + noise[3]
            up = noise[2] - slope * np.hypot(*way)
            step = _message(number, from_s, to_s, way + noise[:2], up, turn)
            if trial.compass:
                step = _with_compass(step, end[2] + deviation + rng.normal(0.0, _COMPASS_OF_PLACE_RAD))
            yield Envelope(address, step)


def _message(number: int, from_s: float, to_s: float, way: FloatArray, up: float, turn: float) -> FootStep:
    length, across = float(np.hypot(*way)), float(np.hypot(*way))
    covariance = np.diag(_STEP_SIGMA**2)
    displacement = np.array([way[0], way[1], up])
    covariance[:3, :3] += _SCALE_SIGMA**2 * np.outer(displacement, displacement)
    covariance[2, 2] += (_SLOPE_SIGMA * across) ** 2
    covariance[3, 3] += (_TURN_SIGMA_RAD_S * (to_s - from_s)) ** 2
    return FootStep(
        time_ns=T0 + round(to_s * NS_PER_S),
        sequence=number,
        start_time_ns=T0 + round(from_s * NS_PER_S),
        displacement_m=(float(way[0]), float(way[1]), float(up)),
        heading_change_rad=turn,
        covariance=upper_triangle(covariance),
        motion="walking",
        length_m=length,
        common_scale_sigma=_SCALE_SIGMA,
        common_slope_sigma=_SLOPE_SIGMA,
        common_turn_sigma_rad_s=_TURN_SIGMA_RAD_S,
    )


def _with_compass(step: FootStep, yaw: float) -> FootStep:
    return msgspec.structs.replace(
        step,
        magnetic_azimuth_rad=(0.5 * math.pi - yaw) % math.tau,
        magnetic_azimuth_sigma_rad=math.hypot(_COMPASS_LASTS_RAD, _COMPASS_OF_PLACE_RAD),
    )


def stance(walk: Walk, time_s: float, mounting: float, beside: float) -> FloatArray:
    """East, north of a foot's stance in the middle of which the body passes, and yaw of its step frame."""
    east, north = walk.place(np.array([time_s]))[0]
    yaw = walk.yaw(time_s)
    return np.array([east - beside * math.sin(yaw), north + beside * math.cos(yaw), yaw + mounting])


def _turned(vector: FloatArray, yaw: float) -> FloatArray:
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return np.array([cosine * vector[0] - sine * vector[1], sine * vector[0] + cosine * vector[1]])


def fixes_told(walk: Walk, trial: Trial, rng: np.random.Generator) -> Iterator[Envelope]:
    """What the receiver says on the walk."""
    zones: tuple[Zone, ...] = ()
    if math.isfinite(trial.from_s):
        direction = float(rng.uniform(0.0, math.tau))
        zones = (Zone("spoofed", _EVERYWHERE, trial.drag_m_s, trial.from_s, direction_rad=direction),)
    conditions = GnssConditions(zones=zones, seed=trial.seed)
    quality = GNSS_CLASSES[trial.receiver]
    series = measure_gnss(walk, trial.duration_s, Mounting(), quality, conditions, ORIGIN, rng)
    address = WHO.address("gnss", "gnss")
    known = np.flatnonzero(np.isfinite(series.lat_deg))
    for number, row in enumerate(known):
        yield Envelope(
            address,
            GnssFix(
                time_ns=T0 + round(float(series.time_s[row]) * NS_PER_S),
                sequence=number,
                fix_kind="3d",
                latitude_deg=float(series.lat_deg[row]),
                longitude_deg=float(series.lon_deg[row]),
                height_m=float(series.alt_m[row]),
                horizontal_accuracy_m=float(series.h_acc_m[row]),
                vertical_accuracy_m=float(series.v_acc_m[row]),
                satellites=int(series.satellites[row]),
                speed_m_s=float(series.speed_m_s[row]),
                course_rad=_course_rad(float(series.course_deg[row])),
            ),
        )


def _course_rad(course_deg: float) -> float | None:
    return None if math.isnan(course_deg) else math.radians(course_deg) % math.tau


def figures(outcomes: Sequence[Outcome]) -> dict[str, float]:
    """Detections, false alarms by hours of honest walking, errors."""
    spoofed = [one for one in outcomes if math.isfinite(one.trial.from_s)]
    quiet_h = sum(min(one.trial.from_s, one.trial.duration_s) for one in outcomes) / 3600.0
    late = np.array([one.detected_after_s for one in spoofed] or [math.nan])
    worst = np.array([one.worst_after_m for one in spoofed] or [math.nan])
    settled = np.concatenate([one.error_m[one.time_s > _CLEAR_S] for one in outcomes])
    inside = np.concatenate([one.inside[one.time_s > _CLEAR_S] for one in outcomes])
    return {
        "runs": float(len(spoofed)),
        "detected_in_30_s_pct": float(100.0 * np.mean(late <= 30.0)),
        "detection_median_s": float(np.median(late)),
        "detection_p95_s": float(np.percentile(late, 95)),
        "worst_error_median_m": float(np.median(worst)),
        "worst_error_p95_m": float(np.percentile(worst, 95)),
        "worst_error_max_m": float(worst.max()),
        "within_10_m_pct": float(100.0 * np.mean(worst <= 10.0)),
        "quiet_hours": quiet_h,
        "false_alarms": float(sum(one.false_alarms for one in outcomes)),
        "error_p95_m": float(np.percentile(settled, 95)),
        "inside_95_pct": float(100.0 * np.mean(inside)),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Play the seeds asked for and print the figures."""
    parser = argparse.ArgumentParser(description="slow spoofers against fusion")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--drag", type=float, default=0.5, help="m/s; 0: no spoofer")
    parser.add_argument("--duration", type=float, default=420.0, help="s")
    parser.add_argument("--receiver", choices=sorted(GNSS_CLASSES), default="honest")
    parser.add_argument(
        "--no-compass", dest="compass", action="store_false", help="boots without magnetometers"
    )
    chosen = parser.parse_args(arguments)
    from_s = min(240.0, 0.5 * chosen.duration) if chosen.drag > 0.0 else math.inf
    seeds = range(chosen.first, chosen.first + 2 * chosen.runs, 2)
    trials = [
        Trial(seed, chosen.duration, chosen.drag, from_s, chosen.receiver, chosen.compass) for seed in seeds
    ]
    for name, value in figures([play(trial) for trial in trials]).items():
        sys.stdout.write(f"{name:24} {value:10.2f}\n")


if __name__ == "__main__":
    main()
