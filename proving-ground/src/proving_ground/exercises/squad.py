"""The squad of four that needs no scenario: simulated walks through a small building, or recorded foot walks."""

from dataclasses import replace
from pathlib import Path

from bootprint.errors import RecordingError
from proving_ground.exercises.exercise import ORIGIN, Exercise, Hub, Net, Settings, Soldier
from proving_ground.exercises.processes.emulated_radio import NetProfile
from proving_ground.simulation.walker import Gait, GnssQuality, simulate_walk
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import Run, Truth

UNIT = "alpha"
LEADER = "a0"
COMMAND_POST = "cp"
NAME = "four-walks"
SQUAD_SIZE = 4
STOREY_M = 3.0
POSTS = (
    Hub(LEADER, 10, "Alpha", UNIT, "squad_leader"),
    Hub(COMMAND_POST, 100, "Zero", "hq", "command_post"),
)
HUB_SETTINGS = {"threshold_m": 3.0, "heartbeat_s": 10.0, "stale_s": 20.0, "lost_s": 60.0}
_CALLSIGNS = ("Adler", "Birke", "Cedar", "Delta")
_LINK_BITS_PER_S = 1200  # what each hub may spend on a net
_SPACING_M = 8.0
# Doorway headings of recorded walks are unknown: say east, and let the score fit the yaw.
_RECORDED_START = {"azimuth_deg": 90.0, "azimuth_sigma_deg": 5.0}


def squad_of(soldiers: tuple[Soldier, ...], name: str, seed: int = 1) -> Exercise:
    """These soldiers with a leader's computer, a command post's, and the two nets between them."""
    squad = NetProfile("squad", rate_bits_per_s=9600.0, latency_s=0.05, header_bytes=28, seed=2 * seed)
    company = NetProfile(
        "company", rate_bits_per_s=4800.0, latency_s=0.15, header_bytes=28, seed=2 * seed + 1
    )
    ids = tuple(soldier.id for soldier in soldiers)
    return Exercise(
        soldiers,
        ORIGIN,
        name=name,
        storeys_m={0: 0.0, 1: STOREY_M},
        hubs=POSTS,
        nets=(
            Net(squad, (*ids, LEADER), budget_bits_per_s=_LINK_BITS_PER_S),
            Net(company, (LEADER, COMMAND_POST), budget_bits_per_s=_LINK_BITS_PER_S),
        ),
        settings=Settings(hub=HUB_SETTINGS),
    )


def _routes() -> list[list[tuple[float, float, float]]]:
    """Four ways into and through a two-storey building whose south door is at (0, 0)."""
    up = STOREY_M
    return [
        [(0, -12, 0), (0, 0, 0), (0, 6, 0), (18, 6, 0), (18, 16, 0), (4, 16, 0), (4, 7, 0), (14, 7, 0)],
        [(-2, -14, 0), (-2, 6, 0), (-20, 6, 0), (-20, 18, 0), (-8, 18, 0), (-8, 8, 0), (-16, 8, 0)],
        [(2, -16, 0), (2, 8, 0), (2, 13, up), (-12, 13, up), (-12, 20, up), (10, 20, up), (10, 12, up)],
        [(4, -18, 0), (4, 8, 0), (4, 13, up), (20, 13, up), (20, 5, up), (8, 5, up), (8, 11, up)],
    ]


def simulated_squad(seed: int = 1) -> Exercise:
    """Four simulated walks through a building, GNSS until the door."""
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
        east_m, north_m, up_m = route[0]
        start = {
            "east_m": east_m,
            "north_m": north_m,
            "up_m": up_m,
            "sigma_m": 0.5,
            "azimuth_deg": 0.0,
            "azimuth_sigma_deg": 2.0,
        }
        soldiers.append(_soldier(index, replace(run, path=Path()), run.truth["body"], start, True))
    return squad_of(tuple(soldiers), NAME, seed)


def recorded_squad(data: Path) -> Exercise:
    """Four soldiers who walk four recorded foot walks with truth: those of a folder, or of its ``foot-gcp``."""
    folder = data / "foot-gcp" if (data / "foot-gcp").is_dir() else data
    runs = [run for run in load_runs([folder]) if run.truth and run.kind in ("foot", "dual")]
    if len(runs) < SQUAD_SIZE:
        raise RecordingError(f"{folder}: has {len(runs)} foot walks with truth, the demo wants {SQUAD_SIZE}")
    soldiers = tuple(
        _soldier(index, run, next(iter(run.truth.values())), _doorway(index), simulated=False)
        for index, run in enumerate(runs[:SQUAD_SIZE])
    )
    return squad_of(soldiers, "recorded-walks")


def _doorway(index: int) -> dict[str, float]:
    return {
        "east_m": _SPACING_M * index,
        "north_m": 0.0,
        "up_m": 0.0,
        "sigma_m": 0.5,
        **_RECORDED_START,
    }


def _soldier(index: int, run: Run, truth: Truth, start: dict[str, float], simulated: bool) -> Soldier:
    return Soldier(f"a{index + 1}", index + 1, _CALLSIGNS[index], run, truth, start, simulated)
