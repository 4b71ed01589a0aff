"""Hubs wired by an in-memory radio that loses, delays and reorders: what the hub's tests play on."""

import heapq
import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.config import Member, Origin, Realm
from bootprint.messages import Position, Track
from bootprint.prediction import moved_m
from bootprint.topics import Identity
from sa_hub.assembly import build_hub
from sa_hub.hub import HubCore
from sa_hub.radio.counters import MemoryCounters
from sa_hub.settings import HubSettings, LinkProfile

S = 1_000_000_000
START_NS = 1_790_000_000 * S
ORIGIN = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=50.0)
GROUP_KEY = bytes(range(32))
REALM = Realm(
    id="bp",
    origin=ORIGIN,
    roster=(
        *(Member(id=f"a{n}", number=n, unit="alpha", callsign=f"Alpha {n}") for n in range(1, 9)),
        Member(id="lead", number=10, unit="alpha", role="squad_leader"),
        *(Member(id=f"b{n}", number=20 + n, unit="bravo") for n in range(1, 4)),
        Member(id="blead", number=30, unit="bravo", role="squad_leader"),
        Member(id="cp", number=100, unit="hq", role="command_post"),
    ),
)


def link(name: str, rate_bits_per_s: int = 9600, **options: object) -> LinkProfile:
    """A link's profile with the defaults of these tests."""
    return LinkProfile(name=name, rate_bits_per_s=rate_bits_per_s, **options)  # type: ignore[arg-type]


def hub(soldier: str, *links: LinkProfile, group_key: bytes = GROUP_KEY, **options: object) -> HubCore:
    """A hub's core without files."""
    settings = HubSettings(links=links, **options)  # type: ignore[arg-type]
    return build_hub(REALM, REALM.member(soldier), settings, group_key, lambda _net: MemoryCounters())


@dataclass(frozen=True)
class Walk:
    """Straight legs of 20 s at 1.3 m/s, each turned by ``turn_deg`` from the one before; starts ``east_m`` off."""

    east_m: float = 0.0
    turn_deg: float = 70.0
    speed_m_s: float = 1.3
    height_m: float = 50.0

    def at(self, elapsed_s: float) -> tuple[float, float, float, float]:
        """(east m, north m, east m/s, north m/s) around the origin."""
        east, north, azimuth = self.east_m, 0.0, math.radians(20.0)
        left = elapsed_s
        while True:
            velocity = self.speed_m_s * math.sin(azimuth), self.speed_m_s * math.cos(azimuth)
            leg = min(left, 20.0)
            east, north = east + leg * velocity[0], north + leg * velocity[1]
            left -= leg
            if left <= 0.0:
                return east, north, *velocity
            azimuth += math.radians(self.turn_deg)


_METRES_PER_DEG = 111_405.0  # of latitude at 59.35°
_METRES_PER_DEG_EAST = 56_891.0


def position(soldier: str, time_ns: int, walk: Walk, **options: object) -> Envelope:
    """What fusion would say of a walker at this time."""
    east, north, east_m_s, north_m_s = walk.at((time_ns - START_NS) / S)
    values: dict[str, object] = {
        "mode": "boots",
        "covariance_m2": (1.0, 0.0, 0.0, 1.0, 0.0, 4.0),
        "height_m": walk.height_m,
        "velocity_m_s": (east_m_s, north_m_s, 0.0),
    }
    message = Position(
        time_ns=time_ns,
        latitude_deg=ORIGIN.latitude_deg + north / _METRES_PER_DEG,
        longitude_deg=ORIGIN.longitude_deg + east / _METRES_PER_DEG_EAST,
        east_m=east,
        north_m=north,
        up_m=0.0,
        **(values | options),  # type: ignore[arg-type]
    )
    return Envelope(own_identity(soldier).address("position", "fusion"), message)


def own_identity(soldier: str) -> Identity:
    """The part of the key that a soldier's topics share."""
    return Identity("bp", REALM.member(soldier).unit, soldier)


def distance_m(track: Track, walk: Walk, time_ns: int) -> float:
    """How far a receiver that moves the track on by the common rule is from the walker."""
    east, north, _, _ = walk.at((time_ns - START_NS) / S)
    elapsed_s = (time_ns - track.time_ns) / S
    shown_east = (track.longitude_deg - ORIGIN.longitude_deg) * _METRES_PER_DEG_EAST
    shown_north = (track.latitude_deg - ORIGIN.latitude_deg) * _METRES_PER_DEG
    return math.hypot(
        shown_east + moved_m(track.east_velocity_m_s, 0.0, elapsed_s)[0] - east,
        shown_north + moved_m(0.0, track.north_velocity_m_s, elapsed_s)[1] - north,
    )


@dataclass
class Air:
    """The radio nets between hubs; every frame reaches all others on its link, or not, sooner or later.

    Who is in ``cut_off`` neither reaches anybody nor is reached.
    """

    hubs: dict[str, HubCore]
    loss: float = 0.0
    jitter_s: float = 0.0
    seed: int = 1
    now_ns: int = START_NS
    log: list[tuple[int, str, str, bytes]] = field(default_factory=list)
    published: list[tuple[str, bytes]] = field(default_factory=list)
    tracks: dict[tuple[str, str], Track] = field(default_factory=dict)
    outputs: list[tuple[str, Envelope]] = field(default_factory=list)
    cut_off: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)
        self._flying: list[tuple[int, int, str, str, bytes]] = []
        self._links = {name: set(hub.links) for name, hub in self.hubs.items()}

    def keep(self, receiver: str, envelopes: list[Envelope]) -> None:
        """Note what a hub publishes."""
        for envelope in envelopes:
            self.outputs.append((receiver, envelope))
            self.published.append((envelope.address.key, wire.encode(envelope.message)))
            if isinstance(envelope.message, Track):
                self.tracks[receiver, envelope.message.soldier] = envelope.message

    def say(self, envelope: Envelope) -> None:
        """Hand a hub a message of its own soldier."""
        name = envelope.address.soldier
        self.keep(name, self.hubs[name].handle(envelope))

    def run(
        self, seconds: float, walks: dict[str, Walk], each_step: Callable[[int], None] | None = None
    ) -> None:
        """Let time pass: positions at 5 Hz, ticks at 20 Hz, frames in between."""
        end_ns = self.now_ns + round(seconds * S)
        while self.now_ns < end_ns:
            self.now_ns += S // 20
            if self.now_ns % (S // 5) == 0:
                for soldier, walk in walks.items():
                    self.say(position(soldier, self.now_ns, walk))
            self._deliver()
            for name, hub in self.hubs.items():
                self.keep(name, hub.tick(self.now_ns))
                self._send(name, hub)
            if each_step:
                each_step(self.now_ns)

    def _send(self, sender: str, hub: HubCore) -> None:
        for frame in hub.take_frames():
            self.log.append((self.now_ns, sender, frame.link, frame.data))
            for name, links in self._links.items():
                if name == sender or frame.link not in links or self._random.random() < self.loss:
                    continue
                if not self.cut_off.isdisjoint((sender, name)):
                    continue
                due_ns = self.now_ns + round((0.03 + self.jitter_s * self._random.random()) * S)
                heapq.heappush(self._flying, (due_ns, len(self.log), name, frame.link, frame.data))

    def _deliver(self) -> None:
        while self._flying and self._flying[0][0] <= self.now_ns:
            _, _, name, link_name, data = heapq.heappop(self._flying)
            self.keep(name, self.hubs[name].receive(link_name, data, self.now_ns))
