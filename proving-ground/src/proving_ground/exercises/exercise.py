"""What an exercise is: soldiers with what their sensors measured and the truth, computers, radio nets and faults.

Times are seconds from the exercise's zero, places local ENU metres around its origin.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from bootprint.clock import NS_PER_S
from bootprint.config import Member, Origin, Realm
from bootprint.topics import Identity
from proving_ground.exercises.processes.emulated_radio import NetProfile, Parting
from sensor_gateway.recordings.run import Run, Truth

FloatArray = npt.NDArray[np.float64]
REALM = "exercise"
ORIGIN = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=40.0)
COMMAND_POST_ROLE = "command_post"
_RELAYING_ROLES = ("squad_leader", "platoon_leader", "company_leader")
_RELAY_WEIGHT = 3.0  # a relay tells of many, so its share of a net is that of so many soldiers
_NET_SHARE = 0.8  # of a net's rate is given away: a frame that waits for the air is late
_LEAST_BITS_PER_S = 30


@dataclass(frozen=True)
class Soldier:
    """One instrumented soldier: who, what the gateway plays, the truth, and the start that fusion is given."""

    id: str
    number: int
    callsign: str
    run: Run
    truth: Truth
    start: dict[str, float]
    simulated: bool
    unit: str = "alpha"
    role: str = "rifleman"


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
    """A radio net: what its air is like, the computers on it, and spans (from, until) s when it is down.

    ``budget_bits_per_s`` is what each member may spend; None shares the net's rate out (`Exercise.budget`).
    """

    profile: NetProfile
    members: tuple[str, ...]
    outages_s: tuple[tuple[float, float], ...] = ()
    budget_bits_per_s: int | None = None


@dataclass(frozen=True)
class Fault:
    """Something that breaks at ``at_s``: a kind, whose it is, and what more belongs to the kind."""

    at_s: float
    kind: str
    target: str
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def until_s(self) -> float:
        """When it is over; infinite if it lasts to the end."""
        lasts_s = self.details.get("for_s")
        return np.inf if lasts_s is None else self.at_s + float(lasts_s)


@dataclass(frozen=True)
class Settings:
    """What differs from the services' defaults on every computer: values of ``[hub]``, ``[pdr]``, ``[fusion]``."""

    hub: Mapping[str, Any] = field(default_factory=dict)
    pdr: Mapping[str, Any] = field(default_factory=dict)
    fusion: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Exercise:
    """Who takes part, with everything they measure.

    ``storeys_m`` are heights of the floors by level, ``plan`` outlines (k, 2) m on each of them, for maps;
    ``site`` the same and more as GeoJSON.
    """

    soldiers: tuple[Soldier, ...]
    origin: Origin = ORIGIN
    name: str = "exercise"
    begins: datetime = datetime(2026, 6, 1, 8, 0, tzinfo=UTC)
    storeys_m: dict[int, float] = field(default_factory=lambda: {0: 0.0})
    hubs: tuple[Hub, ...] = ()
    nets: tuple[Net, ...] = ()
    faults: tuple[Fault, ...] = ()
    settings: Settings = Settings()
    plan: Mapping[int, Sequence[FloatArray]] = field(default_factory=dict)
    site: Mapping[str, Any] = field(default_factory=dict)

    @property
    def duration_s(self) -> float:
        """Until the last walk has ended."""
        return max(soldier.run.duration_s for soldier in self.soldiers)

    @property
    def begins_ns(self) -> int:
        """The exercise's zero, UTC ns; whole seconds, since radio decisions fall on a grid of event time."""
        return round(self.begins.timestamp()) * NS_PER_S

    @property
    def participants(self) -> tuple[Soldier | Hub, ...]:
        """Everybody with a computer: soldiers, then posts."""
        return (*self.soldiers, *self.hubs)

    @property
    def computers(self) -> list[str]:
        """The ids of all computers."""
        return [one.id for one in self.participants]

    @property
    def command_post(self) -> str:
        """Whose picture matters most: the first command post's, else the first post's, else the first soldier's."""
        posts = [hub.id for hub in self.hubs if hub.role == COMMAND_POST_ROLE]
        return next(iter([*posts, *(hub.id for hub in self.hubs), self.soldiers[0].id]))

    @property
    def realm(self) -> Realm:
        """What all computers agree on."""
        roster = tuple(
            Member(id=one.id, number=one.number, unit=one.unit, callsign=one.callsign, role=one.role)
            for one in self.participants
        )
        return Realm(id=REALM, origin=self.origin, roster=roster)

    def identity(self, computer: str) -> Identity:
        """The part of the key that a computer's topics share."""
        return Identity(REALM, self.realm.member(computer).unit, computer)

    @property
    def floor_height_m(self) -> float | None:
        """From floor to floor, None where there is one floor only (or none): what fusion divides heights by."""
        heights = sorted(self.storeys_m.values())
        return float(np.median(np.diff(heights))) if len(heights) > 1 else None

    def floors(self, height_m: FloatArray) -> npt.NDArray[np.int64]:
        """The level of the nearest floor (n,) at heights (n,)."""
        levels = np.array(list(self.storeys_m), dtype=np.int64)
        heights = np.array(list(self.storeys_m.values()))
        return np.asarray(levels[np.argmin(np.abs(height_m[:, None] - heights), axis=1)], dtype=np.int64)

    # -- radio ------------------------------------------------------------------------------------------------

    def nets_of(self, computer: str) -> list[Net]:
        """The nets that a computer is on."""
        return [net for net in self.nets if computer in net.members]

    def hub_role(self, computer: str) -> str:
        """What a computer's hub is told to be: leaders relay, command posts too."""
        role = self.realm.member(computer).role
        if role == COMMAND_POST_ROLE:
            return COMMAND_POST_ROLE
        return "squad_leader" if role in _RELAYING_ROLES else "soldier"

    def budget(self, net: Net, computer: str) -> int:
        """What a computer may spend on a net, bit/s: its share of the net's rate, a relay's thrice a soldier's.

        Never more than the radio itself allows one sender (a duty cycle).
        """
        return min(self._share_bits_per_s(net, computer), net.profile.medium.sustained_bits_per_s)

    def _share_bits_per_s(self, net: Net, computer: str) -> int:
        if net.budget_bits_per_s is not None:
            return net.budget_bits_per_s
        weights = {
            member: 1.0 if self.hub_role(member) == "soldier" else _RELAY_WEIGHT for member in net.members
        }
        share = weights[computer] / sum(weights.values())
        return max(_LEAST_BITS_PER_S, int(_NET_SHARE * share * net.profile.rate_bits_per_s))

    def silences_s(self, net: Net) -> list[tuple[str, float, float]]:
        """When nobody (``""``) or one member is heard on a net: (member, from, until) of outages and faults."""
        down = [("", begin, end) for begin, end in net.outages_s]
        for fault in self.faults:
            if fault.kind == "radio_gone" and fault.target == net.profile.name:
                down.append(("", fault.at_s, fault.until_s))
            elif fault.kind == "radio_gone" and fault.target in net.members:
                down.append((fault.target, fault.at_s, fault.until_s))
        return sorted(down, key=lambda silence: (silence[1], silence[0]))

    @property
    def clock_jumps_s(self) -> dict[str, set[float]]:
        """By how much faults set the clock of a computer's hub wrong, by computer."""
        jumps = [fault for fault in self.faults if fault.kind == "clock_jump"]
        return {
            each.target: {float(one.details["jump_s"]) for one in jumps if one.target == each.target}
            for each in jumps
        }

    def partings(self, net: Net) -> list[Parting]:
        """When a net is in two parts."""
        return [
            Parting(frozenset(fault.details["apart"]), fault.at_s, fault.until_s)
            for fault in self.faults
            if fault.kind == "net_parted" and fault.target == net.profile.name
        ]
