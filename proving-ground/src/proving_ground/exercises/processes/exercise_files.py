"""What an exercise's computers are told: realm.toml, the group key, a computer.toml each; also as structs."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w

from bootprint.clock import NS_PER_S
from bootprint.config import convert
from fusion.config import FusionConfig
from pdr_engine.config import PdrConfig
from proving_ground.exercises.exercise import Exercise, Soldier
from sa_hub.keys import create_group_key
from sa_hub.settings import HubSettings, check_settings

PLAN = "plan.geojson"
_HISTORY = "history.db"
_WHERE = "exercise"


@dataclass
class Ports:
    """Ports of loopback: each net's members by computer, the net's own by name; TCP of the command post's page."""

    members: dict[str, dict[str, int]] = field(default_factory=dict)
    nets: dict[str, int] = field(default_factory=dict)
    page: int | None = None


def write_realm(folder: Path, exercise: Exercise) -> None:
    """``realm.toml`` (origin and roster) and the group key, made once."""
    if not (folder / "keys" / "group.key").exists():
        create_group_key(folder / "keys" / "group.key")
    realm = exercise.realm
    write_toml(
        folder / "realm.toml",
        {
            "id": realm.id,
            "origin": _fields(realm.origin),
            "roster": [_fields(member) for member in realm.roster],
        },
    )


def _fields(struct: Any) -> dict[str, Any]:
    return {name: getattr(struct, name) for name in struct.__struct_fields__}


def write_plan(folder: Path, exercise: Exercise) -> None:
    """``plan.geojson``: the buildings, for the command post's page."""
    (folder / PLAN).write_text(json.dumps(exercise.site), encoding="utf-8")


def write_computer(folder: Path, exercise: Exercise, computer: str, router: str, ports: Ports) -> None:
    """A computer's ``computer.toml`` in its own folder."""
    soldiers = {soldier.id: soldier for soldier in exercise.soldiers}
    write_toml(
        folder / computer / "computer.toml",
        {
            **_common(computer, router),
            **(sections(exercise, soldiers[computer]) if computer in soldiers else {}),
            "hub": hub_section(exercise, computer, ports) | _page(exercise, computer, ports),
        },
    )


def _page(exercise: Exercise, computer: str, ports: Ports) -> dict[str, Any]:
    """``[hub.page]`` of the command post, if its page is to be served, and the history that its timeline needs."""
    if ports.page is None or computer != exercise.command_post:
        return {}
    plan = {"plan": f"../{PLAN}"} if exercise.site else {}
    return {"page": {"port": ports.page, **plan}, "history": {"url": f"sqlite:///state/{_HISTORY}"}}


def forget_history(folder: Path) -> None:
    """Remove the last play's archives, or pages would begin with its places and alerts; counters stay."""
    for path in folder.glob(f"*/state/{_HISTORY}*"):  # SQLite's -wal and -shm, too
        path.unlink()


def write_gateway(
    folder: Path, soldier: Soldier, router: str, start_ns: int, serial: Mapping[str, Any] | None = None
) -> None:
    """The gateway's own ``gateway.toml``: a replay that starts when the walks do, or a serial port."""
    replay = {
        "kind": "replay",
        "path": str(soldier.run.path.resolve()),
        "run": soldier.run.name,
        "start_time_s": start_ns / NS_PER_S,
        "skip_past": True,  # should the gateway be killed
    }
    write_toml(
        folder / soldier.id / "gateway.toml",
        {**_common(soldier.id, router), "gateway": {"sources": [dict(serial or replay)]}},
    )


def write_toml(path: Path, values: dict[str, Any]) -> None:
    """Write a TOML file, its folder included."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(tomli_w.dumps(values), encoding="utf-8")


def _common(computer: str, router: str) -> dict[str, Any]:
    return {"realm": "../realm.toml", "soldier": computer, "router": router, "keys_dir": "../keys"}


def sections(exercise: Exercise, soldier: Soldier) -> dict[str, dict[str, Any]]:
    """``[pdr]`` and ``[fusion]`` of a soldier's computer."""
    feet = [place for place in soldier.run.imus if place.endswith("_foot")]
    fusion: dict[str, Any] = {
        **({"feet": feet} if feet else {}),  # who has none is carried by the body
        "gnss_sources": ["gnss"] if soldier.run.gnss is not None else [],
        "start": soldier.start,
    }
    if exercise.floor_height_m is not None:
        fusion["floor_height_m"] = exercise.floor_height_m
    return {
        "pdr": {"places": list(soldier.run.imus), **exercise.settings.pdr},
        "fusion": fusion | dict(exercise.settings.fusion),
    }


def hub_section(exercise: Exercise, computer: str, ports: Ports | None = None) -> dict[str, Any]:
    """``[hub]`` of a computer: a link on every net that it is on, with addresses where there are any."""
    links = []
    for net in exercise.nets_of(computer):
        name = net.profile.name
        link: dict[str, Any] = {
            "name": name,
            "rate_bits_per_s": exercise.budget(net, computer),
            "header_bytes": net.profile.header_bytes,
        }
        if net.profile.profile is not None:
            link["profile"] = net.profile.profile
        if ports is not None:
            link["bind"] = f"127.0.0.1:{ports.members[name][computer]}"
            link["peers"] = [f"127.0.0.1:{ports.nets[name]}"]
        links.append(link)
    return {"role": exercise.hub_role(computer), "exercise": True, **exercise.settings.hub, "links": links}


def hub_settings(exercise: Exercise, computer: str) -> HubSettings:
    """The same, checked; ConfigError if it does not fit together."""
    where = f"{_WHERE}: [hub]"
    settings = convert(hub_section(exercise, computer), HubSettings, where)
    check_settings(settings, where)
    return settings


def soldier_settings(exercise: Exercise, soldier: Soldier) -> tuple[PdrConfig, FusionConfig]:
    """``[pdr]`` and ``[fusion]``, checked."""
    values = sections(exercise, soldier)
    return (
        convert(values["pdr"], PdrConfig, f"{_WHERE}: [pdr]"),
        convert(values["fusion"], FusionConfig, f"{_WHERE}: [fusion]"),
    )


def check_exercise(exercise: Exercise) -> None:
    """ConfigError now rather than in a process's log if a computer's settings are wrong."""
    for computer in exercise.computers:
        hub_settings(exercise, computer)
    for soldier in exercise.soldiers:
        soldier_settings(exercise, soldier)
