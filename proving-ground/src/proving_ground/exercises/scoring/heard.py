"""What one computer's bus has told during an exercise, kept as the score needs it; the same in both modes."""

import math
from array import array
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.display import Held, held_of, sigma_m
from bootprint.geodesy import LocalFrame
from bootprint.messages import FootStep, Health, LinkReport, Position, Track

FloatArray = npt.NDArray[np.float64]
WATCHED = ("foot_step", "position", "track", "link", "health")
_COLUMNS = 8
_MEMORY_EVERY_NS = 10 * NS_PER_S
STARTING_NS = 10 * NS_PER_S
_UNKNOWN = Held(math.nan, math.nan)


@dataclass(frozen=True)
class Told:
    """A computer's reports of one soldier in the order of their arrival, times s from the exercise's zero.

    ``arrived_s``, ``stamp_s``, ``accuracy_m`` (one sigma) and ``floor`` (NaN if unknown) are (n,); ``place_m`` and
    ``velocity_m_s`` (n, 2) are east and north. ``held_m`` and ``held_s`` (n,) are the tracks' own (NaN if unknown).
    """

    arrived_s: FloatArray
    stamp_s: FloatArray
    place_m: FloatArray
    velocity_m_s: FloatArray
    accuracy_m: FloatArray
    floor: FloatArray
    held_m: FloatArray
    held_s: FloatArray

    def sigma_m(self, index: int, age_s: float) -> float:
        """One sigma of the place believed so long after a report, as a display shows it."""
        held = Held(float(self.held_m[index]), float(self.held_s[index]))
        return sigma_m(float(self.accuracy_m[index]), age_s, None if math.isnan(held.sigma_m) else held)


class ReportLog:
    """The reports of one soldier: eighty bytes each, for a company has millions."""

    def __init__(self) -> None:
        self._times_ns = array("q")
        self._values = array("d")

    def add(self, arrived_ns: int, track: Track, frame: LocalFrame) -> None:
        """A newer report has come."""
        height_m = frame.origin.height_m if track.height_m is None else track.height_m
        east_m, north_m, _ = frame.to_enu(track.latitude_deg, track.longitude_deg, height_m)
        velocity = track.east_velocity_m_s, track.north_velocity_m_s
        floor = math.nan if track.floor is None else float(track.floor)
        self._times_ns.extend((arrived_ns, track.time_ns))
        held = held_of(track) or _UNKNOWN
        self._values.extend(
            (east_m, north_m, *velocity, track.accuracy_m, floor, held.sigma_m, held.silence_s)
        )

    def __len__(self) -> int:
        return len(self._times_ns) // 2

    def told(self, start_ns: int) -> Told:
        """All of them as arrays."""
        times = (np.array(self._times_ns, dtype=np.int64).reshape(-1, 2) - start_ns) / NS_PER_S
        values = np.array(self._values, dtype=np.float64).reshape(-1, _COLUMNS)
        return Told(times[:, 0], times[:, 1], values[:, 0:2], values[:, 2:4], *values[:, 4:].T)


@dataclass
class Heard:
    """What one computer's bus has told so far. ``newest`` are the newest tracks, ``reports`` those of others.

    ``sent`` holds (time ns, bytes on the air so far) of every link; ``latencies`` the event time (ns) of each of
    the soldier's own positions and the host s from then to its publication as a track; ``memory_mb`` (time ns,
    health's number, MB).
    """

    positions: list[Position] = field(default_factory=list)
    steps: dict[str, list[FootStep]] = field(default_factory=lambda: defaultdict(list))
    newest: dict[str, Track] = field(default_factory=dict)
    reports: dict[str, ReportLog] = field(default_factory=lambda: defaultdict(ReportLog))
    links: dict[str, LinkReport] = field(default_factory=dict)
    sent: dict[str, list[tuple[int, int]]] = field(default_factory=lambda: defaultdict(list))
    health: dict[str, Health] = field(default_factory=dict)
    latencies: list[tuple[int, float]] = field(default_factory=list)
    memory_mb: dict[str, list[tuple[int, int, float]]] = field(default_factory=lambda: defaultdict(list))

    def take(self, envelope: Envelope, arrived_ns: int, frame: LocalFrame) -> bool:
        """Keep what a message says; whether it is a new report of the computer's own soldier."""
        match envelope.message:
            case Position() as position:
                self.positions.append(position)
            case FootStep() as step:
                self.steps[envelope.address.source].append(step)
            case Track() as track:
                return self._take_track(track, envelope.address.soldier, arrived_ns, frame)
            case LinkReport() as report:
                self.links[report.link] = report
                self.sent[report.link].append((report.time_ns, report.bytes_sent))
            case Health() as health:
                self.health[health.service] = health
                self._take_memory(health)
        return False

    def _take_memory(self, health: Health) -> None:
        samples, size_mb = self.memory_mb[health.service], health.gauges.get("memory_mb")
        young = samples and health.time_ns - samples[-1][0] < _MEMORY_EVERY_NS
        if size_mb is not None and not (young and health.sequence > samples[-1][1]):
            samples.append((health.time_ns, health.sequence, size_mb))

    def _take_track(self, track: Track, computer: str, arrived_ns: int, frame: LocalFrame) -> bool:
        previous = self.newest.get(track.soldier)
        self.newest[track.soldier] = track
        if previous is not None and track.time_ns <= previous.time_ns:
            return False  # the same report published again, with a new state
        if track.soldier != computer:
            self.reports[track.soldier].add(arrived_ns, track, frame)
        return track.soldier == computer

    def alive(self) -> set[str]:
        """Names of the services that have told of their health and not of their end."""
        return {name for name, health in self.health.items() if health.state != "stopped"}


def latencies_ms(heard: Sequence[Heard], start_ns: int) -> dict[str, float | None]:
    """99th percentiles of host time from a position's event time to the soldier's own track, over all soldiers.

    The first seconds stand by themselves: in them services find each other and take in what waited for them.
    """
    settled_ns = start_ns + STARTING_NS
    told = [latency for computer in heard for latency in computer.latencies]
    return {
        "latency_p99_ms": _p99_ms(latency_s for at_ns, latency_s in told if at_ns >= settled_ns),
        "latency_start_p99_ms": _p99_ms(latency_s for at_ns, latency_s in told if at_ns < settled_ns),
    }


def _p99_ms(latencies_s: Iterable[float]) -> float | None:
    values = list(latencies_s)
    return float(1000.0 * np.percentile(values, 99)) if values else None
