"""Fuzz of a hub's ear: mutated, random, replayed and crossed frames against one that hears good ones in between.

``make fuzz`` (``python -m support.radio_fuzz``) plays ten million. Every good frame must be taken, once; nothing
else may be, also after restarts with the replay memory as it was stored; nothing may crash, and memory stays
bounded. Half of the payloads are damaged *before* they are sealed: the decoders see authentic nonsense, too, and
updates are resolved against it. Whatever the hub is told then is a place on earth.
"""

import math
import random
import resource
import tempfile
import time
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final

import typer

from sa_hub.radio.content import Report, Reports, Update
from sa_hub.radio.counters import MemoryCounters
from sa_hub.radio.errors import FrameError
from sa_hub.radio.frame import Codec
from sa_hub.radio.layout import Kind
from sa_hub.radio.net import RadioNet
from sa_hub.radio.net_keys import NetKeys, TagBytes
from sa_hub.radio.references import References
from sa_hub.radio.replay_file import MemoryFile
from sa_hub.radio.scheduler import Policy
from sa_hub.radio.seal import Opener, Sealer
from sa_hub.settings import LinkProfile
from support.radio_vectors import NOW_NS, ORIGIN, SENDER, S, contents

NET: Final = "squad"
GROUP_KEY: Final = bytes(range(1, 33))
LISTENER: Final = 1
SENDERS: Final = tuple(range(2, 14))
ROSTER: Final = range(1, 40)
_STEP_NS: Final = S // 50
_KEPT: Final = 4096
_GOOD_SHARE: Final = 0.05
_LOWEST_M: Final = -1024.0
_HIGHEST_M: Final = 15_359.0 + 127.0
"""The highest anchor, and the most above it."""


class FuzzError(AssertionError):
    """Something was accepted, or refused, that should not have been."""


@dataclass
class Fuzz:
    """One run of so many frames; ``counts`` tells what became of them."""

    seed: int
    folder: Path
    tag_bytes: TagBytes = 8
    restart_every: int = 20_000
    counts: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self.random = random.Random(self.seed)
        self.codec = Codec(ORIGIN)
        self._keys = NetKeys(GROUP_KEY, NET, self.tag_bytes)
        self._sealers = {number: Sealer(self._keys, number, MemoryCounters()) for number in SENDERS}
        self._strangers = [
            Sealer(NetKeys(GROUP_KEY, "other", self.tag_bytes), 2, MemoryCounters()),
            Sealer(NetKeys(bytes(32), NET, self.tag_bytes), 3, MemoryCounters()),
        ]
        self.payloads = [
            self.codec.encode(SENDER, content, 3, 240, asked) for _, content, asked in contents()
        ]
        self._heard: deque[bytes] = deque(maxlen=_KEPT)
        self._now_ns = NOW_NS
        self._file = MemoryFile(self.folder / "squad.heard")
        self.net = self._listener(Opener(self._keys))

    def _listener(self, opener: Opener) -> RadioNet:
        profile = LinkProfile(name=NET, rate_bits_per_s=1_000_000, header_bytes=0)
        sealer = Sealer(self._keys, LISTENER, MemoryCounters())
        return RadioNet(profile, Policy(loss=0.1), LISTENER, self.codec, sealer, opener)

    def run(self, frames: int) -> None:
        """Play so many frames; FuzzError if one is taken that should not be, or a good one is not."""
        for index in range(frames):
            self._now_ns += _STEP_NS
            if self.random.random() < _GOOD_SHARE:
                self._good()
            else:
                self._bad()
            if index % 200 == 199:
                self.net.correspondence.known = 5
                self.net.speak([walker(self._now_ns)], self._now_ns)
            if index % self.restart_every == self.restart_every - 1:
                self._restart()

    def _good(self) -> None:
        """A sound or senseless payload, authentic: it is opened, whatever the decoder says of it."""
        payload = self.random.choice(self.payloads)
        if self.random.random() < 0.5:
            payload = self.mutated(payload)
        sealer = self._sealers[self.random.choice(SENDERS)]
        frame = sealer.seal(payload, self._now_ns)
        if self._hear(frame) != 1:
            raise FuzzError(f"an authentic frame was not opened: {frame.hex()}")
        self._file.keep(self.net.opener.memory)
        self._heard.append(frame)
        self.counts["good"] += 1

    def _bad(self) -> None:
        frame = self._bad_frame()
        if self._hear(frame) != 0:
            raise FuzzError(f"taken: {frame.hex()}")
        self.counts["bad"] += 1

    def _bad_frame(self) -> bytes:
        choice = self.random.random()
        if choice < 0.2 or not self._heard:
            return self.random.randbytes(self.random.randrange(0, 60))
        if choice < 0.4:
            return self._heard[self.random.randrange(len(self._heard))]
        if choice < 0.5:
            stranger = self.random.choice(self._strangers)
            return stranger.seal(self.random.choice(self.payloads), self._now_ns)
        if choice < 0.6:
            head, tail = self.random.choice(self._heard), self.random.choice(self._heard)
            crossed = head[: self.random.randrange(1, 9)] + tail[self.random.randrange(1, 9) :]
            return crossed if crossed not in (head, tail) else b""
        frame = self.random.choice(self._heard)
        damaged = self.mutated(frame)
        return damaged if damaged != frame else b""

    def mutated(self, data: bytes) -> bytes:
        """``data`` with some bits flipped, bytes put in, or cut."""
        damaged = bytearray(data)
        for _ in range(self.random.randrange(1, 4)):
            choice = self.random.random()
            place = self.random.randrange(len(damaged) + 1)
            if choice < 0.7 and place < len(damaged):
                damaged[place] ^= 1 << self.random.randrange(8)
            elif choice < 0.85:
                damaged[place:place] = self.random.randbytes(self.random.randrange(1, 4))
            else:
                del damaged[place:]
        return bytes(damaged)

    def _hear(self, frame: bytes) -> int:
        """How many more frames were opened."""
        before = self.net.opener.opened
        heard = self.net.hear(frame, self._now_ns, ROSTER, exercise=False)
        opened = self.net.opener.opened - before
        if heard is not None and isinstance(heard[1], Reports):
            check(heard[1].reports)
            self.counts["reports"] += len(heard[1].reports)
        return opened

    def _restart(self) -> None:
        """Now and then a clean end, else a power cut: only what is on disk is left."""
        if self.random.random() < 0.5:
            self._file.close(self.net.opener.memory)
        self.counts.update(self.net.meter.rejected)
        self.counts["spoken"] += self.net.meter.frames_sent
        self.counts["unresolved"] += self.net.unresolved
        memory, sound = MemoryFile(self._file.path).load()
        if not sound:
            raise FuzzError("the stored memory is not sound")
        self._file = MemoryFile(self._file.path)
        self.net = self._listener(Opener(self._keys, memory))
        # Counters that count as heard after a power cut are passed over; a new full header finds the place again.
        for sealer in self._sealers.values():
            for _ in range(8):
                sealer.seal(b"\x40", self._now_ns)
            sealer.full_headers.begin()
        self.counts["restarts"] += 1


def walker(now_ns: int) -> Report:
    """The listener itself, whose frames others tell to have heard or not: around in a circle within 5 min."""
    turn = math.tau * (now_ns - NOW_NS) / (300 * S)
    east_m_s, north_m_s = 1.3 * math.sin(turn), 1.3 * math.cos(turn)
    place = ORIGIN.latitude_deg + 6e-4 * math.sin(turn), ORIGIN.longitude_deg - 1.1e-3 * math.cos(turn)
    return Report(LISTENER, now_ns, *place, 2.0, east_m_s, north_m_s, height_m=50.0)


def check(reports: Sequence[Report]) -> None:
    """FuzzError unless each is of somebody, somewhere on earth, at a height that frames can say."""
    for report in reports:
        sound = (
            0 <= report.number <= 1023
            and abs(report.latitude_deg) <= 90.0
            and abs(report.longitude_deg) <= 180.0
            and math.hypot(report.east_m_s, report.north_m_s) < 13.0
            and (report.height_m is None or _LOWEST_M <= report.height_m <= _HIGHEST_M)
            and (report.floor is None or -32 <= report.floor <= 95)
        )
        if not sound:
            raise FuzzError(f"nonsense was told: {report}")


def decode_nonsense(fuzz: Fuzz, count: int) -> Counter[str]:
    """Random and damaged payloads straight into the decoder: contents or FrameError, nothing else."""
    found: Counter[str] = Counter()
    for _ in range(count):
        payload = fuzz.mutated(fuzz.random.choice(fuzz.payloads))
        try:
            content = fuzz.codec.decode(2, payload, NOW_NS).content
            found[type(content).__name__] += 1
        except FrameError as error:
            found[error.cause] += 1
    return found


def resolve_nonsense(fuzz: Fuzz, references: References, count: int) -> Counter[str]:
    """Reports and updates, half of them damaged, in and out of order, over epochs: nothing but sound reports.

    Counters and epochs go back, too, and clocks jump: more than an opener and a hub let through.
    """
    found: Counter[str] = Counter()
    rng, epoch, counters = fuzz.random, 1, Counter[int]()
    payloads = [each for each in fuzz.payloads if each[0] >> 4 in (Kind.SELF, Kind.SQUAD, Kind.SQUAD_UPDATE)]
    for _ in range(count):
        payload = rng.choice(payloads)
        sender = rng.choice(SENDERS)
        now_ns = NOW_NS + rng.choice((0, 0, 0, S, -900 * S, 10**6 * S))
        try:
            decoded = fuzz.codec.decode(
                sender, fuzz.mutated(payload) if rng.random() < 0.5 else payload, now_ns
            )
        except FrameError:
            continue
        epoch += rng.random() < 0.001
        counters[sender] += rng.choice((1, 1, 1, 1, 1, 1, 1, 2, 9))
        counter = max(0, counters[sender] - (rng.random() < 0.05) * rng.choice((1, 40)))
        frame = sender, epoch - (rng.random() < 0.01), counter
        references.heard(*frame)
        if isinstance(decoded.content, Reports):
            references.told(*frame, decoded.content, now_ns)
            found["told"] += len(decoded.content.reports)
        elif isinstance(decoded.content, Update):
            reports = references.resolve(*frame, decoded.content, now_ns)
            check(reports)
            found["resolved"] += len(reports)
    found["unresolved"] = references.unresolved
    return found


def main(
    frames: Annotated[int, typer.Option(help="How many.")] = 10_000_000,
    seed: int = 1,
    tag_bytes: Annotated[int, typer.Option(help="8 or 4.")] = 8,
) -> None:
    """Play frames and tell what became of them, how fast, and how much memory that took."""
    with tempfile.TemporaryDirectory() as folder:
        _play(Fuzz(seed, Path(folder), 4 if tag_bytes == 4 else 8), frames)


def _play(fuzz: Fuzz, frames: int) -> None:
    began_s, done = time.perf_counter(), 0
    while done < frames:
        fuzz.run(min(100_000, frames - done))
        done += min(100_000, frames - done)
        rate = done / (time.perf_counter() - began_s)
        memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        typer.echo(f"{done} frames, {rate:.0f} a second, {memory_mb:.0f} MB at most; {dict(fuzz.counts)}")


if __name__ == "__main__":
    typer.run(main)
