"""What an exercise is: soldiers with their walks and truth, simulated or recorded; hubs, nets and faults."""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from bootprint.config import Origin
from bootprint.errors import RecordingError
from proving_ground.exercises.emulated_radio import NetProfile
from proving_ground.sensors.run_writer import write_run_folder
from proving_ground.simulation.walker import Gait, GnssQuality, simulate_walk
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import Run, Truth

REALM = "demo"
UNIT = "alpha"
LEADER = "a0"
COMMAND_POST = "cp"
SQUAD_SIZE = 4
STOREY_M = 3.0
ORIGIN = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=40.0)
_CALLSIGNS = ("Adler", "Birke", "Cedar", "Delta")
_SPACING_M = 8.0
# Doorway headings of recorded walks are unknown: say east, and let the score fit the yaw.
_RECORDED_START = {"azimuth_deg": 90.0, "azimuth_sigma_deg": 5.0}


@dataclass(frozen=True)
class Soldier:
    """One instrumented soldier: who, which recording the gateway replays, the truth, and the given start."""

    id: str
    number: int
    callsign: str
    run: Run
    truth: Truth
    start: dict[str, float]
    simulated: bool
    unit: str = UNIT
    role: str = "rifleman"

    @property
    def sources(self) -> list[str]:
        """Names of the inertial units and, if there is one, the receiver."""
        return [*self.run.imus, *(["gnss"] if self.run.gnss is not None else [])]


@dataclass(frozen=True)
class Hub:
    """A computer without a soldier: a leader's or a command post's."""

    id: str
    number: int
    callsign: str
    unit: str
    role: str


@dataclass(frozen=True)
class Net:
    """A radio net: what its air is like, the computers on it, and spans (from, until) s when it is down."""

    profile: NetProfile
    members: tuple[str, ...]
    outages_s: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Fault:
    """Something that breaks at ``at_s``: a kind, whose it is, and what more belongs to the kind."""

    at_s: float
    kind: str
    target: str
    details: dict[str, str | float] = field(default_factory=dict)


_DEMO_HUBS = (
    Hub(LEADER, 10, "Alpha", UNIT, "squad_leader"),
    Hub(COMMAND_POST, 100, "Zero", "hq", "command_post"),
)


@dataclass(frozen=True)
class Exercise:
    """Who takes part, with everything they measure; ``storeys_m`` are heights of the floors by level."""

    soldiers: tuple[Soldier, ...]
    origin: Origin = ORIGIN
    name: str = "demo"
    begins: datetime = datetime(2026, 6, 1, 8, 0, tzinfo=UTC)
    storeys_m: dict[int, float] = field(default_factory=lambda: {0: 0.0, 1: STOREY_M})
    hubs: tuple[Hub, ...] = _DEMO_HUBS
    nets: tuple[Net, ...] = ()
    faults: tuple[Fault, ...] = ()

    @property
    def duration_s(self) -> float:
        """Until the last walk has ended."""
        return max(soldier.run.duration_s for soldier in self.soldiers)


def _routes() -> list[list[tuple[float, float, float]]]:
    """Four ways into and through a two-storey building whose south door is at (0, 0)."""
    up = STOREY_M
    return [
        [(0, -12, 0), (0, 0, 0), (0, 6, 0), (18, 6, 0), (18, 16, 0), (4, 16, 0), (4, 7, 0), (14, 7, 0)],
        [(-2, -14, 0), (-2, 6, 0), (-20, 6, 0), (-20, 18, 0), (-8, 18, 0), (-8, 8, 0), (-16, 8, 0)],
        [(2, -16, 0), (2, 8, 0), (2, 13, up), (-12, 13, up), (-12, 20, up), (10, 20, up), (10, 12, up)],
        [(4, -18, 0), (4, 8, 0), (4, 13, up), (20, 13, up), (20, 5, up), (8, 5, up), (8, 11, up)],
    ]


def simulated_exercise(folder: Path, seed: int = 1) -> Exercise:
    """Four simulated walks through a building, GNSS until the door; written as run folders below ``folder``."""
    soldiers = []
    for index, route in enumerate(_routes()):
        gait = Gait(step_length_m=0.66 + 0.03 * index, step_period_s=0.53 + 0.02 * index, stand_before_s=4.0)
        to_the_door_s = gait.stand_before_s + 16.0
        run = simulate_walk(
            f"walk-{index + 1}",
            route,
            ORIGIN,
            seed=seed * 1000 + index,
            gait=gait,
            gnss=GnssQuality(sigma_m=1.5, until_s=to_the_door_s),
        )
        write_run_folder(run, folder / run.name)
        east_m, north_m, up_m = route[0]
        start = {
            "east_m": east_m,
            "north_m": north_m,
            "up_m": up_m,
            "sigma_m": 0.5,
            "azimuth_deg": 0.0,
            "azimuth_sigma_deg": 2.0,
        }
        soldiers.append(_soldier(index, load_runs([folder / run.name])[0], run.truth["body"], start, True))
    return Exercise(tuple(soldiers))


def recorded_exercise(data: Path) -> Exercise:
    """Four soldiers who walk four recorded foot walks with truth: those of a folder, or of its ``foot-gcp``."""
    folder = data / "foot-gcp" if (data / "foot-gcp").is_dir() else data
    runs = [run for run in load_runs([folder]) if run.truth and run.kind in ("foot", "dual")]
    if len(runs) < SQUAD_SIZE:
        raise RecordingError(f"{folder}: has {len(runs)} foot walks with truth, the demo wants {SQUAD_SIZE}")
    return Exercise(
        tuple(
            _soldier(
                index,
                run,
                next(iter(run.truth.values())),
                {
                    "east_m": _SPACING_M * index,
                    "north_m": 0.0,
                    "up_m": 0.0,
                    "sigma_m": 0.5,
                    **_RECORDED_START,
                },
                simulated=False,
            )
            for index, run in enumerate(runs[:SQUAD_SIZE])
        )
    )


def _soldier(index: int, run: Run, truth: Truth, start: dict[str, float], simulated: bool) -> Soldier:
    return Soldier(f"a{index + 1}", index + 1, _CALLSIGNS[index], run, truth, start, simulated)
