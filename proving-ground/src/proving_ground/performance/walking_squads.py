"""So many soldiers for a measurement: squads of eight, each walking round a yard of its own, all alike.

Only the number differs from one measurement to the next, so what differs in the figures is due to the number. A
squad has a leader's computer and a net; leaders and the command post have one above. One soldier has the same.
"""

from dataclasses import replace
from itertools import cycle, islice
from pathlib import Path
from typing import Final

from proving_ground.exercises.exercise import ORIGIN, Exercise, Hub, Net, Settings, Soldier
from proving_ground.exercises.processes.emulated_radio import NetProfile
from proving_ground.exercises.squad import COMMAND_POST, HUB_SETTINGS
from proving_ground.simulation.walker import simulate_walk

SQUAD: Final = 8
_YARD_M: Final = ((0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0))
_BETWEEN_M: Final = 20.0
"""From one soldier's yard to the next: nobody is near, so nobody is warned of anybody."""
_SPEED_M_S: Final = 1.2
_HEADER_BYTES: Final = 28


def walking_squads(soldiers: int, seconds: float) -> Exercise:
    """So many soldiers who walk for at least so long."""
    people = tuple(_soldier(index, seconds) for index in range(soldiers))
    units = sorted({soldier.unit for soldier in people})
    leaders = tuple(
        Hub(f"{unit}-leader", 500 + index, unit.title(), unit, "squad_leader")
        for index, unit in enumerate(units)
    )
    return Exercise(
        people,
        ORIGIN,
        name=f"{soldiers} walking",
        hubs=(*leaders, Hub(COMMAND_POST, 1000, "Zero", "hq", "command_post")),
        nets=(*(_squad_net(leader, people) for leader in leaders), _upper_net(leaders)),
        settings=Settings(hub=HUB_SETTINGS),
    )


def _soldier(index: int, seconds: float) -> Soldier:
    east_m, north_m = _BETWEEN_M * (index % SQUAD), _BETWEEN_M * (index // SQUAD)
    corners = islice(cycle(_YARD_M), 2 + int(seconds * _SPEED_M_S / 10.0))  # sides are ten metres on average
    way = [(east_m + east, north_m + north, 0.0) for east, north in corners]
    run = replace(simulate_walk(f"yard-{index + 1}", way, ORIGIN, seed=index + 1), path=Path())
    start = {
        "east_m": east_m,
        "north_m": north_m,
        "sigma_m": 0.5,
        "azimuth_deg": 90.0,
        "azimuth_sigma_deg": 2.0,
    }
    unit = f"squad{index // SQUAD + 1}"
    return Soldier(
        f"s{index + 1}", index + 1, f"S{index + 1}", run, run.truth["body"], start, True, unit=unit
    )


def _squad_net(leader: Hub, people: tuple[Soldier, ...]) -> Net:
    members = (*(soldier.id for soldier in people if soldier.unit == leader.unit), leader.id)
    return Net(NetProfile(leader.unit, 9600.0, header_bytes=_HEADER_BYTES, seed=leader.number), members)


def _upper_net(leaders: tuple[Hub, ...]) -> Net:
    profile = NetProfile("company", 9600.0, latency_s=0.15, header_bytes=_HEADER_BYTES)
    return Net(profile, (*(leader.id for leader in leaders), COMMAND_POST))
