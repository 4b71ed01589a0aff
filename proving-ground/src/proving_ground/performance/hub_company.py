"""A company on the move, with real hubs: what its command post hears, to be heard again by a hub that is measured.

Squads of twelve walk about; each soldier's hub speaks on its squad's net, each leader's hub relays to the company's
net, where the command post listens. Every frame is one that a hub has sealed.
"""

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Member, Origin, Realm
from bootprint.geodesy import LocalFrame
from bootprint.messages import Position
from bootprint.topics import Address, Identity
from proving_ground.positions import position_at
from sa_hub.assembly import build_hub
from sa_hub.hub import HubCore
from sa_hub.radio.counters import MemoryCounters
from sa_hub.settings import HubSettings, LinkProfile, Role

SQUAD: Final = 12
POST: Final = "post"
COMPANY_NET: Final = "company"
ABOVE_NET: Final = "battalion"
START_NS: Final = 1_790_000_000 * NS_PER_S
_GROUP_KEY: Final = hashlib.sha256(b"benchmark").digest()
_ORIGIN: Final = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=40.0)
_PACE_M_S: Final = 1.3
_LEG_S: Final = 17.0
_GOLDEN_RAD: Final = math.pi * (3.0 - math.sqrt(5.0))
_FAST_BITS_PER_S: Final = 1_000_000
_MOST_SOLDIERS: Final = 900


@dataclass(frozen=True)
class HeardFrame:
    """A frame that reaches the command post; event time."""

    time_ns: int
    data: bytes


@dataclass(frozen=True)
class Company:
    """So many soldiers, in squads of twelve at most, each with a leader's hub."""

    soldiers: int

    def __post_init__(self) -> None:
        if not 0 < self.soldiers <= _MOST_SOLDIERS:
            raise ValueError(
                f"{self.soldiers} soldiers, want 1 to {_MOST_SOLDIERS}: radio numbers end at 1023"
            )

    @property
    def squads(self) -> int:
        """How many squads there are."""
        return -(-self.soldiers // SQUAD)

    @cached_property
    def realm(self) -> Realm:
        """Everybody's roster: soldiers from number 1, the post, leaders after it."""
        soldiers = [_member(f"s{n}", n, n) for n in range(1, self.soldiers + 1)]
        leaders = [_member(f"l{n}", self.soldiers + 2 + n, 1 + n * SQUAD) for n in range(self.squads)]
        post = Member(id=POST, number=self.soldiers + 1, unit="company")
        return Realm(id="benchmark", origin=_ORIGIN, roster=(*soldiers, post, *leaders))

    def post(self) -> HubCore:
        """A fresh hub of the command post, which relays to the net above."""
        return self._hub(POST, "command_post", COMPANY_NET, ABOVE_NET)

    def frames(self, duration_s: int) -> list[HeardFrame]:
        """What the command post hears of everybody's first ``duration_s`` seconds."""
        heard = [frame for squad in range(self.squads) for frame in self._relayed(squad, duration_s)]
        return sorted(heard, key=lambda frame: frame.time_ns)

    def _hub(self, soldier: str, role: Role, *nets: str) -> HubCore:
        links = tuple(
            LinkProfile(name=net, rate_bits_per_s=_FAST_BITS_PER_S, header_bytes=0, mtu_bytes=1000)
            for net in nets
        )
        settings = HubSettings(role=role, links=links)
        return build_hub(
            self.realm, self.realm.member(soldier), settings, _GROUP_KEY, lambda _net: MemoryCounters()
        )

    def _relayed(self, squad: int, duration_s: int) -> Iterator[HeardFrame]:
        """What one leader's hub says on the company's net."""
        net = f"squad-{squad}"
        numbers = range(1 + squad * SQUAD, 1 + min(self.soldiers, (squad + 1) * SQUAD))
        hubs = {number: self._hub(f"s{number}", "soldier", net) for number in numbers}
        leader = self._hub(f"l{squad}", "squad_leader", net, COMPANY_NET)
        for second in range(duration_s):
            now_ns = START_NS + second * NS_PER_S
            for number, hub in hubs.items():
                hub.handle(Envelope(_address(number), position(number, now_ns)))
                hub.tick(now_ns)
                for frame in hub.take_frames():
                    leader.receive(net, frame.data, now_ns)
            leader.tick(now_ns)
            for frame in leader.take_frames():
                if frame.link == COMPANY_NET:
                    yield HeardFrame(now_ns, frame.data)


def position(number: int, time_ns: int) -> Position:
    """What a walker's fusion tells: legs of 17 s, each turned by the golden angle from the one before."""
    east_m, north_m, azimuth_rad = _walk(number, (time_ns - START_NS) / NS_PER_S)
    enu_m = east_m, north_m, 0.0
    return position_at(
        time_ns,
        enu_m,
        LocalFrame(_ORIGIN).to_geodetic(*enu_m),
        (1.0, 1.0, 1.0),
        velocity_m_s=(_PACE_M_S * math.sin(azimuth_rad), _PACE_M_S * math.cos(azimuth_rad)),
    )


def _address(number: int) -> Address:
    return Identity("benchmark", "company", f"s{number}").address("position", "fusion")


def _walk(number: int, elapsed_s: float) -> tuple[float, float, float]:
    """East and north (m) and the azimuth walked, from a place of one's own on a grid of 15 m."""
    east_m, north_m, azimuth_rad = 15.0 * (number % 30), 15.0 * (number // 30), number * _GOLDEN_RAD
    left_s = elapsed_s + number % _LEG_S
    while left_s > 0.0:
        azimuth_rad += _GOLDEN_RAD
        leg_m = _PACE_M_S * min(left_s, _LEG_S)
        east_m += leg_m * math.sin(azimuth_rad)
        north_m += leg_m * math.cos(azimuth_rad)
        left_s -= _LEG_S
    return east_m, north_m, azimuth_rad


def _member(id_: str, number: int, soldier: int) -> Member:
    return Member(id=id_, number=number, unit=f"squad{(soldier - 1) // SQUAD}", callsign=id_.upper())
