"""The files an exercise's processes read: realm.toml, the group key, and a computer.toml for each computer."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from bootprint.clock import NS_PER_S
from proving_ground.exercises.exercise import COMMAND_POST, LEADER, REALM, STOREY_M, UNIT, Exercise, Soldier
from sa_hub.keys import create_group_key

_LINK_BITS_PER_S = 1200  # what each hub may spend on a net
_UDP_HEADER_BYTES = 28
_ROLES = {LEADER: "squad_leader", COMMAND_POST: "command_post"}


@dataclass(frozen=True)
class Ports:
    """UDP ports of loopback: each net's members by computer, and the net's own by name."""

    members: dict[str, dict[str, int]]
    nets: dict[str, int]


def write_realm(folder: Path, exercise: Exercise) -> None:
    """``realm.toml`` (origin and roster) and the group key, made once."""
    if not (folder / "keys" / "group.key").exists():
        create_group_key(folder / "keys" / "group.key")
    origin = exercise.origin
    roster: list[dict[str, Any]] = [
        {"id": soldier.id, "number": soldier.number, "unit": UNIT, "callsign": soldier.callsign}
        for soldier in exercise.soldiers
    ]
    roster.append({"id": LEADER, "number": 10, "unit": UNIT, "callsign": "Alpha", "role": "squad_leader"})
    roster.append(
        {"id": COMMAND_POST, "number": 100, "unit": "hq", "callsign": "Zero", "role": "command_post"}
    )
    write_toml(
        folder / "realm.toml",
        {
            "id": REALM,
            "origin": {
                "latitude_deg": origin.latitude_deg,
                "longitude_deg": origin.longitude_deg,
                "height_m": origin.height_m,
            },
            "roster": roster,
        },
    )


def write_computer(folder: Path, exercise: Exercise, computer: str, router: str, ports: Ports) -> None:
    """A computer's ``computer.toml`` in its own folder."""
    soldiers = {soldier.id: soldier for soldier in exercise.soldiers}
    write_toml(
        folder / computer / "computer.toml",
        {
            **_common(computer, router),
            **_sections(soldiers.get(computer)),
            "hub": _hub(computer, ports),
        },
    )


def write_gateway(folder: Path, soldier: Soldier, router: str, start_ns: int) -> None:
    """The gateway's own ``gateway.toml``: known only when the start of the walks is."""
    source = {
        "kind": "replay",
        "path": str(soldier.run.path.resolve()),
        "run": soldier.run.name,
        "start_time_s": start_ns / NS_PER_S,
    }
    write_toml(
        folder / soldier.id / "gateway.toml",
        {**_common(soldier.id, router), "gateway": {"sources": [source]}},
    )


def write_toml(path: Path, values: dict[str, Any]) -> None:
    """Write a TOML file, its folder included."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(tomli_w.dumps(values), encoding="utf-8")


def _common(computer: str, router: str) -> dict[str, Any]:
    return {"realm": "../realm.toml", "soldier": computer, "router": router, "keys_dir": "../keys"}


def _sections(soldier: Soldier | None) -> dict[str, Any]:
    if soldier is None:
        return {}
    return {
        "pdr": {"places": list(soldier.run.imus)},
        "fusion": {
            "feet": list(soldier.run.imus),
            "gnss_sources": ["gnss"] if soldier.run.gnss is not None else [],
            "floor_height_m": STOREY_M,
            "start": soldier.start,
        },
    }


def _hub(computer: str, ports: Ports) -> dict[str, Any]:
    """The hub's section: a link on every net that this computer is on."""
    return {
        "role": _ROLES.get(computer, "soldier"),
        "exercise": True,
        "threshold_m": 3.0,
        "heartbeat_s": 10.0,
        "stale_s": 20.0,
        "lost_s": 60.0,
        "links": [
            {
                "name": net,
                "bind": f"127.0.0.1:{members[computer]}",
                "peers": [f"127.0.0.1:{ports.nets[net]}"],
                "rate_bits_per_s": _LINK_BITS_PER_S,
                "header_bytes": _UDP_HEADER_BYTES,
            }
            for net, members in ports.members.items()
            if computer in members
        ],
    }
