"""The sa-hub process: links, key and counter files around the hub's core."""

import heapq
import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Final

from bootprint.bus import Envelope
from bootprint.clock import EventClock
from bootprint.config import Member
from bootprint.figures import Figures
from bootprint.messages import Fix, Track
from bootprint.rooms import RoomMap
from bootprint.service import Context, Service
from sa_hub.assembly import build_hub
from sa_hub.companions.keeping import Keeping
from sa_hub.companions.together import companions_of
from sa_hub.first_second import FirstSecond
from sa_hub.hub import STEP_NS, HubCore
from sa_hub.keys import load_group_key, load_next_key
from sa_hub.radio.counters import FileCounters
from sa_hub.radio.links import Link
from sa_hub.radio.links.opening import Surroundings, open_link
from sa_hub.radio.replay import Memory
from sa_hub.radio.replay_file import MemoryFile
from sa_hub.settings import HubSettings, LinkProfile, check_settings

_LATENCIES: Final = 512
_STOOD_STILL_S: Final = 0.5  # host time; ticks come every 0.1 s
_MOST_WAITING: Final = 8192
"""Frames kept between two looks; of a flood the newest."""


class LatencyGauge:
    """Host time from the event time of our own positions to the publication of their tracks."""

    def __init__(self, clock: EventClock) -> None:
        self._clock = clock
        self._seconds: deque[float] = deque(maxlen=_LATENCIES)

    def observe(self, outputs: Iterable[Envelope]) -> None:
        """Note the tracks of our own soldier among these outputs."""
        for envelope in outputs:
            if isinstance(envelope.message, Track) and _is_sensed(envelope.message):
                latency_s = self._clock.host_seconds_since(envelope.message.time_ns)
                if latency_s is not None:
                    self._seconds.append(latency_s)

    def gauges(self) -> dict[str, float]:
        """``latency_p99_ms``, if there is anything to tell."""
        if not self._seconds:
            return {}
        count = len(self._seconds)
        longest = heapq.nlargest(count - math.ceil(0.99 * count) + 1, self._seconds)
        return {"latency_p99_ms": 1e3 * longest[-1]}


def _is_sensed(track: Track) -> bool:
    """Whether this is our own soldier's track with a sensor behind it: a coasting one is late by design."""
    return track.via == "own" and track.mode in ("gnss", "boots", "body", "camera")


class HubPart:
    """A hub's core with its links; replay memory is kept before what a frame said is published.

    Where there is an archive, notices are acknowledged by radio when it has them.
    """

    def __init__(
        self,
        context: Context,
        core: HubCore,
        settings: HubSettings,
        memories: Mapping[str, MemoryFile],
        first_second: FirstSecond,
    ) -> None:
        self._context = context
        self._core = core
        self._latency = LatencyGauge(context.clock)
        self._memories = memories
        self._first_second = first_second
        self._memory_faults = 0
        self._frames_dropped = 0
        self._ticked_ns: int | None = None
        self._arrivals: deque[tuple[str, bytes]] = deque(maxlen=_MOST_WAITING)
        self._companions = companions_of(context, settings, self._announce, self._place)
        self._keeping = Keeping(self._companions.entrust)
        self._links = self._open(settings.links)
        self._hold()

    def _open(self, profiles: Iterable[LinkProfile]) -> dict[str, Link]:
        computer = self._context.computer
        around = Surroundings(
            computer.realm.id,
            computer.member.number,
            computer.path.parent,
            self._context.clock.now_ns,
            computer.credentials,
        )
        return {each.name: open_link(each, partial(self._arrived, each.name), around) for each in profiles}

    def start(self) -> None:
        """Begin to receive, and to tell the companions."""
        self._companions.start(self._context)
        for link in self._links.values():
            link.start()

    def _announce(self, envelope: Envelope) -> None:
        """In a companion's thread: publish what it has heard."""
        self._context.post(lambda: self._told([envelope]))

    def _place(self, fix: Fix, member: Member) -> list[Envelope]:
        """In the main loop: a person at the page says where somebody is."""
        return self._told(self._core.place(fix, member))

    def _told(self, envelopes: list[Envelope]) -> list[Envelope]:
        """The companions are told what is published."""
        self._companions.tell(envelopes)
        return envelopes

    def _arrived(self, name: str, data: bytes) -> None:
        """Perhaps in the link's thread: the frame waits for the next look, and nobody is woken."""
        self._frames_dropped += len(self._arrivals) == _MOST_WAITING
        self._arrivals.append((name, data))

    def _receive(self, now_ns: int) -> list[Envelope]:
        """Everything that has arrived; what was heard is on disk before it is told."""
        for link in self._links.values():
            link.poll()
        heard_before = {name: self._core.frames_heard(name) for name in self._links}
        outputs: list[Envelope] = []
        while self._arrivals:
            outputs += self._core.receive(*self._arrivals.popleft(), now_ns)
        for name, before in heard_before.items():
            if self._core.frames_heard(name) != before:
                self._keep(name, self._memories[name].keep)
        return outputs

    def _keep(self, name: str, write: Callable[[Memory], None]) -> None:
        try:
            write(self._core.memory(name))
        except OSError:
            self._memory_faults += 1

    def handle(self, envelope: Envelope) -> list[Envelope]:
        """A message of our own soldier."""
        if isinstance(envelope.message, RoomMap):
            if envelope.message.soldier == envelope.address.soldier:  # others' were published by ourselves
                self._companions.tell([envelope])
            return []
        outputs = self._core.handle(envelope)
        self._latency.observe(outputs)
        self._companions.tell([envelope])
        return self._told(outputs)

    def tick(self, now_ns: int) -> list[Envelope]:
        """Event time goes on; what the nets have to say goes out."""
        heard = self._made_up(now_ns) + self._receive(now_ns)
        self._keeping.heard(heard)
        self._core.kept(self._keeping.until(), self._keeping.look)
        self._hold()
        said = self._told(self._core.tick(now_ns))
        for frame in self._core.take_frames():
            self._links[frame.link].send(frame.data)
        return heard + said

    def _hold(self) -> None:
        """Nets whose modem is busy, and those that may not speak yet, keep back what is due."""
        for name, link in self._links.items():
            self._core.hold(name, busy=link.busy or self._first_second.waits(name))

    def _made_up(self, now_ns: int) -> list[Envelope]:
        """After standing still, what would have been said meanwhile is not said now, all at once."""
        clock, last_ns = self._context.clock, self._ticked_ns
        self._ticked_ns = now_ns
        if last_ns is None or (clock.host_seconds_since(last_ns) or 0.0) < _STOOD_STILL_S:
            return []
        for name in self._links:
            self._core.hold(name, busy=True)
        return self._core.tick(max(last_ns, now_ns - STEP_NS))

    def figures(self) -> Figures:
        """The core's figures, the links' faults and the latency."""
        figures = self._core.figures()
        faults = {
            "send_faults": sum(link.send_faults for link in self._links.values()),
            "link_garbled": sum(link.garbled for link in self._links.values()),
            "memory_faults": self._memory_faults,
            "frames_dropped": self._frames_dropped,
            "acknowledged_unkept": self._keeping.unkept,
        }
        beside = self._companions.figures()
        note = figures.note or "; ".join(link.fault for link in self._links.values() if link.fault)
        note = note or beside.note
        return replace(
            figures,
            state="degraded" if note else figures.state,
            counters=figures.counters | faults | beside.counters,
            gauges=figures.gauges | self._latency.gauges() | beside.gauges,
            note=note,
        )

    def close(self) -> Iterable[Envelope]:
        """Close the links; what was heard is complete then."""
        for name, link in self._links.items():
            link.close()
            self._keep(name, self._memories[name].close)
        self._companions.close()
        return ()


def build(context: Context) -> HubPart:
    """Read key, counters and replay memory, and open the links; ConfigError if anything is not there or wrong."""
    computer = context.computer
    settings = computer.section("hub", HubSettings)
    check_settings(settings, f"{computer.path}: [hub]")
    key_file = computer.keys_dir / f"{settings.group_key or computer.realm.group_key}.key"
    radio_dir = computer.state_dir / "radio"
    files = {link.name: MemoryFile(radio_dir / f"{link.name}.heard") for link in settings.links}
    first = FirstSecond()
    if context.lossless:
        first.started()  # a replay at full speed would be over before anybody spoke

    def counters(net: str) -> FileCounters:
        path = radio_dir / f"{net}.counters"
        return FileCounters(path, time.time, earlier_life=files[net].path, sleep=first.waiting(net))

    def memory(net: str) -> Memory:
        loaded, sound = files[net].load()
        if not sound:
            context.log.warning("replay memory is damaged, starting afresh", net=net)
        return loaded

    core = build_hub(
        computer.realm,
        computer.member,
        settings,
        load_group_key(key_file),
        counters,
        memories=memory,
        next_key=load_next_key(key_file),
    )
    first.started()
    return HubPart(context, core, settings, files, first)


SERVICE = Service(
    name="sa-hub",
    summary="Keep the squad's picture: tracks, alerts and the radio that carries them.",
    subjects=("position", "fix", "alert", "observation", "status", "aim", "rooms"),
    build=build,
)


def preload() -> None:
    """What a started service needs beyond this module (`bootprint.fork_server`)."""
    import sa_hub.radio.links.udp  # noqa: F401

    SERVICE.preload()


def main() -> None:
    """The console script."""
    SERVICE.main()
