"""A squad's real hubs on one emulated net that loses frames at random, walking at random: what trials play on."""

import math
import random
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Member, Origin, Realm
from bootprint.geodesy import LocalFrame
from bootprint.messages import Alert, Track
from bootprint.prediction import moved_m
from bootprint.topics import Identity
from proving_ground.exercises.processes.emulated_radio import Air, NetProfile
from proving_ground.positions import position_at
from sa_hub.assembly import build_hub
from sa_hub.hub import STEP_NS, HubCore
from sa_hub.radio.counters import MemoryCounters
from sa_hub.settings import HubSettings, LinkProfile, Role

START_NS: Final = 1_790_000_000 * NS_PER_S
NET: Final = "squad"
_ORIGIN: Final = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=50.0)
_GROUP_KEY: Final = bytes(range(32))  # nothing secret passes here
_SHARE: Final = 0.9
_POSITIONS_PER_S: Final = 5
_SPEED_M_S: Final = 1.3
_LEG_S: Final = (5.0, 40.0)


@dataclass(frozen=True)
class Room:
    """What a trial plays in: so many soldiers and their leader, on one net that all share."""

    soldiers: int = 12
    rate_bits_per_s: float = 1200.0
    loss: float = 0.3
    header_bytes: int = 0
    leader: bool = True
    tag_bytes: int = 8

    @property
    def names(self) -> tuple[str, ...]:
        """Everybody, the leader last."""
        return (*(f"a{n}" for n in range(1, self.soldiers + 1)), *(("lead",) if self.leader else ()))


class Walker:
    """Straight legs of random length, each in a random direction."""

    def __init__(self, seed: str) -> None:
        self._random = random.Random(seed)
        self._east, self._north = (self._random.uniform(-60.0, 60.0) for _ in range(2))
        self._velocity = (0.0, 0.0)
        self._left_s = 0.0

    @property
    def place(self) -> tuple[float, float]:
        """East and north in metres."""
        return self._east, self._north

    def walk(self, seconds: float) -> tuple[float, float, tuple[float, float]]:
        """So much later: east and north in metres, and the velocity."""
        if self._left_s <= 0.0:
            azimuth = self._random.uniform(0.0, 2.0 * math.pi)
            self._velocity = _SPEED_M_S * math.sin(azimuth), _SPEED_M_S * math.cos(azimuth)
            self._left_s = self._random.uniform(*_LEG_S)
        self._left_s -= seconds
        self._east += seconds * self._velocity[0]
        self._north += seconds * self._velocity[1]
        return self._east, self._north, self._velocity


@dataclass
class Trial:
    """One run; `run` goes on from where it was. ``silences_s``: (member or "" for all, from, until)."""

    room: Room
    seed: int
    silences_s: Sequence[tuple[str, float, float]] = ()
    tracks: dict[tuple[str, str], Track] = field(default_factory=dict)
    heard: list[tuple[float, str, Envelope]] = field(default_factory=list)
    now_ns: int = START_NS
    bits: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        room = self.room
        members = tuple(
            Member(id=name, number=number, unit="alpha", role="squad_leader" if name == "lead" else "soldier")
            for number, name in enumerate(room.names, start=1)
        )
        self.realm = Realm(id="bp", origin=_ORIGIN, roster=members)
        profile = NetProfile(
            NET, room.rate_bits_per_s, loss=room.loss, header_bytes=room.header_bytes, seed=self.seed
        )
        self._air = Air(profile, room.names, self.silences_s, zero_s=0.0)
        self._frame = LocalFrame(_ORIGIN)
        self._walkers = {name: Walker(f"{self.seed}|{name}") for name in room.names}
        self._epochs = dict.fromkeys(room.names, 0)
        self.hubs: dict[str, HubCore] = {}

    @property
    def now_s(self) -> float:
        """Event time since the start."""
        return (self.now_ns - START_NS) / NS_PER_S

    def start(self, names: Iterable[str]) -> None:
        """Switch hubs on, for the first time or again with nothing remembered."""
        for name in names:
            self._epochs[name] += 1
            self.hubs[name] = self._hub(name)

    def _hub(self, name: str) -> HubCore:
        room, epoch = self.room, self._epochs[name]
        budget = int(_SHARE * room.rate_bits_per_s / len(room.names))
        link = LinkProfile(name=NET, rate_bits_per_s=budget, header_bytes=room.header_bytes)
        role: Role = "squad_leader" if name == "lead" else "soldier"
        settings = HubSettings(role=role, links=(link,), tag_bytes=4 if room.tag_bytes == 4 else 8)
        member = self.realm.member(name)
        return build_hub(self.realm, member, settings, _GROUP_KEY, lambda _net: MemoryCounters(epoch))

    def run(self, until_s: float, each_step: Callable[[], None] = lambda: None) -> None:
        """Let time pass: positions at 5 Hz, decisions at 10 Hz."""
        while self.now_s < until_s - 1e-9:
            self.now_ns += STEP_NS
            self._deliver()
            if self.now_ns % (NS_PER_S // _POSITIONS_PER_S) == 0:
                self._move()
            for name, hub in self.hubs.items():
                self._keep(name, hub.tick(self.now_ns))
                self._send(name, hub)
            each_step()

    def say(self, name: str, alert: Alert) -> None:
        """A soldier raises an alert."""
        address = Identity("bp", "alpha", name).address("alert", "people")
        self._keep(name, self.hubs[name].handle(Envelope(address, alert)))

    def _move(self) -> None:
        for name, walker in self._walkers.items():
            east, north, velocity = walker.walk(1.0 / _POSITIONS_PER_S)
            if name in self.hubs:
                self._keep(name, self.hubs[name].handle(self._position(name, east, north, velocity)))

    def _position(self, name: str, east: float, north: float, velocity: tuple[float, float]) -> Envelope:
        enu_m = east, north, 0.0
        geodetic = self._frame.to_geodetic(*enu_m)
        message = position_at(self.now_ns, enu_m, geodetic, (1.0, 1.0, 4.0), velocity_m_s=velocity)
        return Envelope(Identity("bp", "alpha", name).address("position", "fusion"), message)

    def _send(self, name: str, hub: HubCore) -> None:
        for frame in hub.take_frames():
            self.bits[name] = self.bits.get(name, 0) + 8 * (len(frame.data) + self.room.header_bytes)
            self._air.transmit(name, frame.data, self.now_s)

    def _deliver(self) -> None:
        for delivery in self._air.arrived(self.now_s):
            if delivery.member in self.hubs:
                at_ns = START_NS + round(delivery.due_s * NS_PER_S)
                hub = self.hubs[delivery.member]
                self._keep(delivery.member, hub.receive(NET, delivery.datagram, at_ns))

    def _keep(self, name: str, envelopes: Iterable[Envelope]) -> None:
        for envelope in envelopes:
            match envelope.message:
                case Track() as track:
                    self.tracks[name, track.soldier] = track
                case Alert():
                    self.heard.append((self.now_s, name, envelope))

    def error_m(self, name: str, soldier: str) -> float:
        """How far off a hub shows a soldier now, its track moved on; NaN if it has none that is fresh."""
        track = self.tracks.get((name, soldier))
        if track is None or track.state != "fresh":
            return math.nan
        shown_east, shown_north, _ = self._frame.to_enu(
            track.latitude_deg, track.longitude_deg, track.height_m or 0.0
        )
        elapsed_s = (self.now_ns - track.time_ns) / NS_PER_S
        moved = moved_m(track.east_velocity_m_s, track.north_velocity_m_s, elapsed_s)
        east, north = self._walkers[soldier].place
        return math.hypot(shown_east + moved[0] - east, shown_north + moved[1] - north)
