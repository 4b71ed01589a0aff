"""Our own format: one real hub speaks for the whole squad, real hubs receive, in event time.

The sender is a squad leader's hub. Everybody's positions come to it as fusions tell them, five times a second,
whole, as over broadband nets inside the squad; only what it says on the narrow link is measured.
Receivers are independent hubs. With feedback they walk, too, and report themselves on the same link, or they are
command posts that tell only what they heard.
"""

import hashlib
from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Final

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Member, Realm
from bootprint.geodesy import LocalFrame
from bootprint.messages import Position, Track
from bootprint.topics import Address, Identity
from proving_ground.positions import position_at
from proving_ground.radio_load.budget_check import exceeds_budget
from proving_ground.radio_load.load import BEGINS_NS, NET, ORIGIN, SETTLE_S, Load, Outcome
from proving_ground.radio_load.picture_error import DAMPED, Errors, Seen
from proving_ground.radio_load.shared_link import SharedLink
from proving_ground.radio_load.squad_tracks import SquadTracks
from proving_ground.radio_load.telling import DELAY_S, PERIOD_S
from sa_hub.assembly import build_hub
from sa_hub.hub import STEP_NS, HubCore
from sa_hub.radio.counters import MemoryCounters
from sa_hub.settings import HubSettings, LinkProfile, Role, check_settings

_GROUP_KEY: Final = hashlib.sha256(b"radio load test").digest()
_SENDER: Final = "s1"
_VARIANCE_M2: Final = 4.0
OnProgress = Callable[[float], None]


class _Feed:
    """Positions of many soldiers, built from their tracks when they are wanted."""

    def __init__(self, tracks: SquadTracks, first_number: int) -> None:
        self.tracks = tracks
        self.first_number = first_number
        frame = LocalFrame(ORIGIN)
        self._geodetic = [frame.all_to_geodetic(place).tolist() for place in tracks.place_m]
        self._places = tracks.place_m.tolist()
        self._velocities = tracks.velocity_m_s.tolist()

    def position(self, soldier: int, index: int) -> Position:
        """The fused position of a soldier at a stamp's index."""
        east_m_s, north_m_s = self._velocities[soldier][index]
        return position_at(
            BEGINS_NS + index * round(PERIOD_S * NS_PER_S),
            self._places[soldier][index],
            self._geodetic[soldier][index],
            (_VARIANCE_M2, _VARIANCE_M2, _VARIANCE_M2),
            velocity_m_s=(east_m_s, north_m_s),
            speed_m_s=(east_m_s**2 + north_m_s**2) ** 0.5,
        )


class HubSquad:
    """One load test of our own hubs; `run` once."""

    def __init__(self, load: Load, tracks: SquadTracks) -> None:
        self._load = load
        self._tracks = tracks
        soldiers = [f"s{index + 1}" for index in range(load.soldiers)]
        names = [*soldiers, *load.receivers]
        roster = tuple(Member(id=name, number=index + 1, unit="alpha") for index, name in enumerate(names))
        self._realm = Realm(id="load", origin=ORIGIN, roster=roster)
        self._numbers = {member.id: member.number for member in roster}
        self._indices = {name: index for index, name in enumerate(soldiers)}
        self._sender = self._hub(_SENDER, "squad_leader", load.hub_link)
        receivers_link = load.receivers_link
        role: Role = "command_post" if load.posts else "soldier"
        self._receivers = {
            name: self._hub(name, role, receivers_link or load.hub_link) for name in load.receivers
        }
        self._speaking = {} if receivers_link is None else self._receivers
        self._squad_feed = _Feed(tracks, 1)
        walking = receivers_link is not None and not load.posts
        self._receivers_feed = _Feed(load.receivers_tracks(), load.soldiers + 1) if walking else None
        self._air = SharedLink(load, [_SENDER, *load.receivers])
        self._seen: dict[tuple[str, int], Seen] = defaultdict(Seen)
        self._frame = LocalFrame(ORIGIN)
        self._frames: list[tuple[int, int]] = []
        self._feedback_bytes = 0
        self._reports = 0

    def _hub(self, name: str, role: Role, link: LinkProfile) -> HubCore:
        settings = HubSettings(role=role, links=(link,), tag_bytes=self._load.tag)
        check_settings(settings, f"--link {self._load.link} --bitrate {self._load.bitrate}")
        return build_hub(
            self._realm, self._realm.member(name), settings, _GROUP_KEY, lambda _net: MemoryCounters()
        )

    def run(self, on_progress: OnProgress = lambda _share: None) -> Outcome:
        """Play it to the end of the tracks, and a little longer for what is on the air."""
        last_ns = BEGINS_NS + round((self._tracks.duration_s + SETTLE_S) * NS_PER_S)
        steps = range(BEGINS_NS, last_ns + 1, STEP_NS)
        for count, now_ns in enumerate(steps):
            self._deliver(now_ns)
            self._feed(count)
            self._speak(_SENDER, self._sender, now_ns)
            for name, hub in self._speaking.items():
                self._speak(name, hub, now_ns)
            if count % 500 == 0:
                on_progress(count / len(steps))
        return self._outcome()

    def _deliver(self, now_ns: int) -> None:
        for heard in self._air.arrived((now_ns - BEGINS_NS) / NS_PER_S):
            at_ns = BEGINS_NS + round(heard.at_s * NS_PER_S)
            hub = self._sender if heard.member == _SENDER else self._receivers[heard.member]
            outputs = hub.receive(NET, heard.message, at_ns)
            if heard.member != _SENDER:
                self._see(heard.member, outputs, heard.at_s)

    def _see(self, receiver: str, outputs: Iterable[Envelope], at_s: float) -> None:
        """Keep what a receiver's bus now tells of the squad."""
        for envelope in outputs:
            track = envelope.message
            if isinstance(track, Track) and track.soldier in self._indices:
                self._see_track(receiver, track, at_s)

    def _see_track(self, receiver: str, track: Track, at_s: float) -> None:
        height_m = ORIGIN.height_m if track.height_m is None else track.height_m
        east_m, north_m, _ = self._frame.to_enu(track.latitude_deg, track.longitude_deg, height_m)
        velocity = track.east_velocity_m_s, track.north_velocity_m_s
        stamp_s = (track.time_ns - BEGINS_NS) / NS_PER_S
        self._seen[receiver, self._indices[track.soldier]].add(at_s, stamp_s, (east_m, north_m), velocity)
        self._reports += 1

    def _feed(self, step: int) -> None:
        """Positions that come out of the fusions at this step."""
        index, rest = divmod(
            step - round(DELAY_S * NS_PER_S) // STEP_NS, round(PERIOD_S * NS_PER_S) // STEP_NS
        )
        if rest or not 0 <= index < len(self._tracks.time_s):
            return
        self._sender.handle(self._own(_SENDER, self._squad_feed.position(0, index)))
        for soldier in range(1, self._load.soldiers):
            self._sender.take_in(self._squad_feed.position(soldier, index), soldier + 1)
        self._feed_receivers(index)

    def _feed_receivers(self, index: int) -> None:
        feed = self._receivers_feed
        if feed is not None and index < len(feed.tracks.time_s):
            for receiver, (name, hub) in enumerate(self._receivers.items()):
                hub.handle(self._own(name, feed.position(receiver, index)))

    def _own(self, name: str, position: Position) -> Envelope:
        address: Address = Identity(self._realm.id, "alpha", name).address("position", "fusion")
        return Envelope(address, position)

    def _speak(self, name: str, hub: HubCore, now_ns: int) -> None:
        hub.tick(now_ns)
        for frame in hub.take_frames():
            size = self._load.medium.air_bytes(len(frame.data))
            if name == _SENDER:
                self._frames.append((now_ns, size))
            else:
                self._feedback_bytes += size
            self._air.send(name, self._numbers[name], frame.data, (now_ns - BEGINS_NS) / NS_PER_S)

    def _outcome(self) -> Outcome:
        errors = Errors()
        for receiver in self._load.receivers:
            for soldier in range(self._load.soldiers):
                errors.take(self._seen[receiver, soldier], self._tracks, soldier, DAMPED)
        return Outcome(
            errors,
            self._tracks.duration_s,
            self._frames,
            reports=round(self._reports / len(self._load.receivers) / (1.0 - self._load.loss)),
            dropped=self._air.dropped,
            feedback_bits=8 * self._feedback_bytes,
            budget_exceeded=exceeds_budget(self._frames, self._load.bitrate, BEGINS_NS, empty_at_start=True),
        )
