"""Two soldiers clear the same house; the second, who wears less, is given the first one's map of rooms or not.

The first wears what the scenario gives (both boots, tactical units). The second comes after: one boot with a
consumer's unit, or a unit at the belt alone, in the same house by ways of their own. Sensors and pdr-engine are
played once, fusion again and again: without a map, with the first one's, with maps that are wrong.

python -m proving_ground.evaluation.fusion.room_trials [SEED ...]
"""

import json
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import msgspec
import numpy as np

from bootprint import logs
from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.messages import Position
from bootprint.rooms import Place, RoomMap, cells_of, runs_of
from fusion.engine import FusionCore
from fusion.rooms.settings import RoomsConfig
from pdr_engine.foot import warm_up
from proving_ground.evaluation.fusion.lines import Heard, heard_in, said_by
from proving_ground.exercises.scoring.score import compare
from proving_ground.scenario import LIBRARY, Scenario, load_scenario
from proving_ground.scenario.build import exercise_of, instrumented
from proving_ground.scenario.schema.people import Imu, Kit

FIRST, SECOND = "first1", "second2"
_TEAMS = Path(__file__).with_name("house_search.toml")
SEEDS = (1, 3, 5)
_BOOT = Imu(place="left_foot", quality="consumer", mounting_deg=(5.0, -25.0, 15.0))
KITS: Mapping[str, Kit] = {
    "consumer boot": Kit(name="boot", imus=(_BOOT,)),
    "without compass": Kit(name="plain", imus=(msgspec.structs.replace(_BOOT, magnetometer=False),)),
    "belt alone": Kit(name="belt", imus=(Imu(place="body", quality="consumer"),)),
}
_CHI2_95_2D = 5.991
_AT_THE_DOOR_S = 5.0
Row = dict[str, str | float | int]


@dataclass(frozen=True)
class Played:
    """What a fusion made of it: its positions, its map, its counters."""

    positions: list[Position]
    rooms: RoomMap
    counters: Mapping[str, int]


def played(heard: Heard, given: Sequence[RoomMap] = ()) -> Played:
    """A fusion that hears a soldier's steps, and others' maps before all else."""
    config = msgspec.structs.replace(heard.config, rooms=RoomsConfig(use=True))
    core = FusionCore(config, heard.identity, heard.origin)
    for rooms in given:
        core.handle(Envelope(heard.identity.address("rooms", rooms.soldier), rooms))
    said = said_by(core, heard)
    positions = [one.message for one in said if isinstance(one.message, Position)]
    ends_ns, _ = heard.messages[-1]
    return Played(positions, core.survey.map(ends_ns), dict(core.counters))


def house_search() -> Scenario:
    """The house of building-clearing with the two of the trials."""
    house, _, _ = (LIBRARY / "building-clearing.toml").read_text(encoding="utf-8").partition("[[teams]]")
    house = "\n".join(
        line for line in house.splitlines() if 'each = "platoon"' not in line
    )  # nobody to talk to
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "house-search.toml"
        path.write_text(f"{house}\n" + _TEAMS.read_text(encoding="utf-8"), encoding="utf-8")
        return load_scenario(path)


@dataclass
class Trial:
    """One seed's house: the first soldier, and the second with each kit."""

    seed: int

    def _heard(self, soldier_id: str, kit: Kit | None) -> Heard:
        scenario = house_search()
        [soldier] = [one for one in scenario.cast.soldiers if one.id == soldier_id]
        worn = soldier if kit is None else replace(soldier, kit=kit)
        alone = replace(scenario, cast=replace(scenario.cast, soldiers=(worn,)))
        acted = scenario.play(self.seed)
        ready = tuple(instrumented(alone, acted, self.seed))
        return heard_in(exercise_of(scenario, self.seed, ready, acted.duration_s), ready[0])

    @cached_property
    def first(self) -> Played:
        """The first soldier's walk."""
        return played(self._heard(FIRST, None))

    def second(self, kit: str) -> Heard:
        """What the second soldier's fusion hears."""
        return self._heard(SECOND, KITS[kit])


def shifted(rooms: RoomMap, east_m: float, north_m: float) -> RoomMap:
    """A map that lies elsewhere on earth, but for that the same."""
    columns, rows = round(east_m / rooms.cell_m), round(north_m / rooms.cell_m)
    moved = {
        Place(place.floor, place.row + rows, place.column + columns): cell
        for place, cell in cells_of(rooms.runs).items()
    }
    return msgspec.structs.replace(rooms, runs=tuple(runs_of(moved)))


def turned(rooms: RoomMap) -> RoomMap:
    """Another house: the map turned by a right angle about its middle and mirrored, over the same ground."""
    cells = cells_of(rooms.runs)
    middle = np.round(np.mean([(place.row, place.column) for place in cells], axis=0)).astype(int)
    moved = {
        Place(
            place.floor,
            int(middle[0] + place.column - middle[1]),
            int(middle[1] + place.row - middle[0]),
        ): cell
        for place, cell in cells.items()
    }
    return msgspec.structs.replace(rooms, runs=tuple(runs_of(moved)))


def maps(rooms: RoomMap) -> dict[str, tuple[RoomMap, ...]]:
    """The maps that the second soldier is given, by what is said of them."""
    return {
        "no map": (),
        "the first one's": (rooms,),
        "shifted by 5 m": (shifted(rooms, 3.0, 4.0),),
        "of another house": (turned(rooms),),
    }


def row_of(heard: Heard, made: Played) -> Row:
    """Errors against the truth while no satellites are heard, m, with the share inside 95 % and NEES (2).

    ``since_p95_m`` is of what the error has changed since the first seconds inside: satellites at the door are
    wrong for everybody alike, and no map tells that.
    """
    compared = compare(heard.soldier, made.positions, heard.begins_ns)
    assert compared is not None
    inside = _indoors(made.positions, heard.begins_ns, compared.time_s)
    errors = compared.errors_m[inside]
    error_m = np.linalg.norm(errors, axis=1)
    at_door = errors[compared.time_s[inside] <= compared.time_s[inside][0] + _AT_THE_DOOR_S].mean(axis=0)
    since_m = np.linalg.norm(errors - at_door, axis=1)
    index = np.searchsorted(compared.track.time_s, compared.time_s[inside], side="right") - 1
    covariance = compared.track.covariance_m2[np.maximum(index, 0)]
    squared = np.einsum("ki,kij,kj->k", errors, np.linalg.inv(covariance), errors)
    counts = {name: made.counters.get(f"rooms_{name}", 0) for name in ("laid", "corrections", "taken_off")}
    return {
        "p50_m": float(np.percentile(error_m, 50)),
        "p95_m": float(np.percentile(error_m, 95)),
        "since_p95_m": float(np.percentile(since_m, 95)),
        "inside_95_pct": float(100.0 * np.mean(squared <= _CHI2_95_2D)),
        "nees": float(squared.mean()),
        **counts,
    }


def _indoors(positions: Sequence[Position], begins_ns: int, time_s: np.ndarray) -> np.ndarray:
    """Which times (n,) have no satellites."""
    times = np.array([(one.time_ns - begins_ns) / NS_PER_S for one in positions])
    blind = np.array([one.mode not in ("gnss", "unplaced") for one in positions])
    return blind[np.clip(np.searchsorted(times, time_s), 0, len(times) - 1)]


def rows_of(trial: Trial) -> Iterator[Row]:
    """A line for each kit and map."""
    for kit in KITS:
        heard = trial.second(kit)
        for told, given in maps(trial.first.rooms).items():
            yield {"seed": trial.seed, "kit": kit, "map": told, **row_of(heard, played(heard, given))}


def main(seeds: Sequence[int]) -> None:
    """Print a row for every seed, kit and map, as JSON lines."""
    logs.configure("error")
    warm_up()
    for seed in seeds:
        for row in rows_of(Trial(seed)):
            sys.stdout.write(json.dumps(row) + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main([int(seed) for seed in sys.argv[1:]] or SEEDS)
