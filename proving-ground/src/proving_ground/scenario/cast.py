"""Who takes part: soldiers and posts with ids and radio numbers, the tree of units, and who is on which net."""

from collections.abc import Iterable
from dataclasses import dataclass

from bootprint.topics import check_part
from proving_ground.scenario.faulty import ScenarioFault
from proving_ground.scenario.schema.people import Kit, Team, Unit
from proving_ground.scenario.schema.scenario import ScenarioFile
from proving_ground.scenario.schema.world import Net
from proving_ground.scenario.site_builder import known

LEADERS = {"squad": "squad_leader", "platoon": "platoon_leader", "company": "company_leader"}
_LARGEST_NUMBER = 1023


@dataclass(frozen=True)
class Participant:
    """A computer in the exercise: its radio number, its unit and its part in it."""

    id: str
    number: int
    callsign: str
    unit: str
    role: str


@dataclass(frozen=True)
class Soldier(Participant):
    """Who wears it; ``team`` is the index in the file, ``copy`` counts the units that have this team from 1."""

    kit: Kit
    team: int
    copy: int


@dataclass(frozen=True)
class StaffedPost(Participant):
    """A computer without a soldier."""


@dataclass(frozen=True)
class Cast:
    """Everybody, and the members of every net by its name."""

    soldiers: tuple[Soldier, ...]
    posts: tuple[StaffedPost, ...]
    units: tuple[Unit, ...]
    nets: tuple[tuple[str, Net, tuple[str, ...]], ...]


def build_cast(file: ScenarioFile) -> Cast:
    """Ids, numbers, callsigns and nets; ScenarioFault where something is unknown, double or too much."""
    units = _units(file)
    kits = {kit.name: kit for kit in file.kits}
    if len(kits) < len(file.kits):
        raise ScenarioFault("kits", "two kits have the same name")
    soldiers: list[Soldier] = []
    for index, team in enumerate(file.teams):
        kit = kits[known(team.kit, kits, f"teams[{index}].kit", "kit")] if team.kit else file.kits[0]
        for copy, unit in enumerate(team.units, start=1):
            known(unit, units, f"teams[{index}].units", "unit")
            if len(soldiers) + team.soldiers > _LARGEST_NUMBER:
                raise ScenarioFault(f"teams[{index}]", f"more than a realm's {_LARGEST_NUMBER} soldiers")
            soldiers.extend(_enlist(team, (index, copy), units[unit], kit, soldiers))
    posts = _posts(file, units, len(soldiers))
    _check_ids(soldiers, posts)
    return Cast(tuple(soldiers), tuple(posts), tuple(units.values()), tuple(_nets(file, soldiers, posts)))


def _enlist(team: Team, which: tuple[int, int], unit: Unit, kit: Kit, before: list[Soldier]) -> list[Soldier]:
    """The soldiers of one unit's team: numbered on from all before, ids from those of the unit before."""
    index, copy = which
    prefix = team.prefix.replace("{k}", str(copy)) or f"{unit.id}-"
    first = 1 + sum(soldier.unit == unit.id for soldier in before)
    return [
        Soldier(
            id=f"{prefix}{first + rank}",
            number=len(before) + rank + 1,
            callsign=_callsign(team, rank, unit, first + rank, copy),
            unit=unit.id,
            role=team.roles[rank] if rank < len(team.roles) else "rifleman",
            kit=kit,
            team=index,
            copy=copy,
        )
        for rank in range(team.soldiers)
    ]


def _units(file: ScenarioFile) -> dict[str, Unit]:
    units: dict[str, Unit] = {}
    for index, unit in enumerate(file.units):
        if unit.id in units:
            raise ScenarioFault(f"units[{index}].id", f"there are two units {unit.id!r}")
        _check_part(unit.id, f"units[{index}].id")
        units[unit.id] = unit
    for index, unit in enumerate(file.units):
        if unit.parent is not None:
            known(unit.parent, units, f"units[{index}].parent", "unit")
            if list(LEADERS).index(units[unit.parent].kind) <= list(LEADERS).index(unit.kind):
                raise ScenarioFault(
                    f"units[{index}].parent", f"a {unit.kind} cannot belong to a {units[unit.parent].kind}"
                )
    return units


def _callsign(team: Team, rank: int, unit: Unit, number: int, copy: int) -> str:
    if rank < len(team.callsigns):
        return team.callsigns[rank].replace("{k}", str(copy))
    return f"{unit.callsign or unit.id.capitalize()} {number}"


def _posts(file: ScenarioFile, units: dict[str, Unit], taken: int) -> list[StaffedPost]:
    posts = []
    for index, post in enumerate(file.posts):
        known(post.unit, units, f"posts[{index}].unit", "unit")
        _check_part(post.id, f"posts[{index}].id")
        callsign = post.callsign or post.id.upper()
        posts.append(StaffedPost(post.id, taken + index + 1, callsign, post.unit, post.role))
    return posts


def _check_part(name: str, key: str) -> None:
    try:
        check_part("id", name)
    except ValueError as error:
        raise ScenarioFault(key, str(error)) from error


def _check_ids(soldiers: list[Soldier], posts: list[StaffedPost]) -> None:
    seen: set[str] = set()
    for soldier in soldiers:
        _check_part(soldier.id, f"teams[{soldier.team}].prefix")
        if soldier.id in seen:
            raise ScenarioFault(
                f"teams[{soldier.team}]", f"two soldiers would be {soldier.id!r}: set a prefix"
            )
        seen.add(soldier.id)
    for index, post in enumerate(posts):
        if post.id in seen:
            raise ScenarioFault(f"posts[{index}].id", f"the id {post.id!r} is taken")
        seen.add(post.id)
    if len(seen) > _LARGEST_NUMBER:
        raise ScenarioFault(
            "teams", f"{len(seen)} soldiers and posts are more than a realm's {_LARGEST_NUMBER}"
        )


def _nets(
    file: ScenarioFile, soldiers: list[Soldier], posts: list[StaffedPost]
) -> Iterable[tuple[str, Net, tuple[str, ...]]]:
    names: set[str] = set()
    for index, net in enumerate(file.nets):
        key = f"nets[{index}]"
        if net.each is None:
            found = {net.name: _named_members(file, net, soldiers, posts, key)}
        else:
            units = [unit for unit in file.units if unit.kind == net.each]
            found = {unit.id: _unit_members(file, unit, soldiers, posts) for unit in units}
        for name, members in found.items():
            if name in names:
                raise ScenarioFault(key, f"there are two nets {name!r}")
            if len(members) < 2:
                raise ScenarioFault(key, f"the net {name!r} has {len(members)} members: it needs two to talk")
            names.add(name)
            yield name, net, members


def _named_members(
    file: ScenarioFile, net: Net, soldiers: list[Soldier], posts: list[StaffedPost], key: str
) -> tuple[str, ...]:
    everybody: list[Participant] = [*soldiers, *posts]
    by_unit: dict[str, list[str]] = {unit.id: [] for unit in file.units}
    for one in everybody:
        by_unit[one.unit].append(one.id)
    ids = [one.id for one in everybody]
    members: list[str] = []
    for index, name in enumerate(net.members):
        known(name, {*ids, *by_unit}, f"{key}.members[{index}]", "unit, soldier or post")
        members.extend(by_unit.get(name, [name]))
    return tuple(dict.fromkeys(members))


def _unit_members(
    file: ScenarioFile, unit: Unit, soldiers: list[Soldier], posts: list[StaffedPost]
) -> tuple[str, ...]:
    """A squad: all of it. Above: the unit's own people and posts, and the leaders of the units below."""
    everybody: list[Participant] = [*soldiers, *posts]
    own = [one.id for one in everybody if one.unit == unit.id]
    if unit.kind == "squad":
        return tuple(own)
    below = [other for other in file.units if other.parent == unit.id]
    leaders = [leader for other in below for leader in leaders_of(other, soldiers, posts)]
    return tuple(dict.fromkeys([*own, *leaders]))


def leaders_of(unit: Unit, soldiers: Iterable[Soldier], posts: Iterable[StaffedPost]) -> list[str]:
    """Those who speak for a unit one level up: its leader and its posts."""
    leaders = [s.id for s in soldiers if s.unit == unit.id and s.role == LEADERS[unit.kind]]
    return leaders + [post.id for post in posts if post.unit == unit.id]
