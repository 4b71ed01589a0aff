"""The seal of a frame: AES-256-CCM with a short tag, and a nonce that costs three bits on the air.

Each (net, sender) has its own key, HKDF-SHA256 of the group key; the nonce is (sender, epoch, counter). Frames
carry the counter's lowest bits, and a receiver tries the counters around the newest it has heard; epoch and counter
travel in full now and then, often after a start and when somebody asks. The header is authenticated, the payload is
encrypted too.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from cryptography.exceptions import InvalidTag

from bootprint.clock import NS_PER_S
from sa_hub.radio.counters import CounterSource
from sa_hub.radio.errors import FrameError
from sa_hub.radio.header import Header, nonce, read_header, write_header
from sa_hub.radio.layout import FULL_HEADER_BYTES, SHORT_HEADER_BYTES
from sa_hub.radio.net_keys import Keys, NetKeys
from sa_hub.radio.replay import Heard, Memory

FULL_FIRST_PAUSE_NS: Final = NS_PER_S
FULL_LONGEST_PAUSE_NS: Final = 120 * NS_PER_S
FULL_ASKED_PAUSE_NS: Final = 10 * NS_PER_S
FAR_TRIES_PER_S: Final = 64
FAR_TRIES_DEPTH: Final = 1024


@dataclass(frozen=True, slots=True)
class Opened:
    """An authentic frame that was not heard before."""

    sender: int
    payload: bytes
    epoch: int
    counter: int


class FullHeaders:
    """When epoch and counter travel in full: at once, then after 1 s, 2 s, 4 s, … and at last every 2 min.

    ``ample``: bits are plenty, so that every frame may carry them and nobody has to wait. ``known``: everybody who
    was heard says that it hears nearly all of ours, so it knows the counter; then they come every 2 min at once,
    until somebody asks: whoever does was not among them, and the row begins anew.
    """

    def __init__(self) -> None:
        self.ample = False
        self.known = False
        self.begin()

    def begin(self) -> None:
        """There may be somebody who does not know the counter."""
        self._sent_ns: int | None = None
        self._pause_ns = FULL_FIRST_PAUSE_NS
        self._asked_ns: int | None = None

    def asked(self, now_ns: int) -> None:
        """Somebody asks for the counter; at most every 10 s that begins afresh."""
        if self._asked_ns is None or now_ns - self._asked_ns >= FULL_ASKED_PAUSE_NS:
            self.begin()
            self._asked_ns = now_ns

    def is_due(self, now_ns: int) -> bool:
        """Whether the next frame is to have a full header."""
        return self.ample or self._has_come(now_ns)

    def _has_come(self, now_ns: int) -> bool:
        seldom = self.known and self._asked_ns is None
        pause_ns = FULL_LONGEST_PAUSE_NS if seldom else self._pause_ns
        return self._sent_ns is None or now_ns - self._sent_ns >= pause_ns

    def sent(self, now_ns: int) -> None:
        """One was on the air; one that only ampleness sent moves nothing."""
        if not self._has_come(now_ns):
            return
        if self._sent_ns is not None:
            self._pause_ns = min(2 * self._pause_ns, FULL_LONGEST_PAUSE_NS)
        self._sent_ns = now_ns

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        if self._sent_ns is not None:
            self._sent_ns -= by_ns
        if self._asked_ns is not None:
            self._asked_ns -= by_ns


class Sealer:
    """Seals this hub's own frames on one net.

    ConfigError from any method if no more counters can be reserved; then nothing may be sent.
    """

    def __init__(self, keys: Keys, sender: int, counters: CounterSource) -> None:
        self.full_headers = FullHeaders()
        self._keys = keys
        self._sender = sender
        self._counters = counters
        self._block = counters.reserve()
        self._next = self._block.first

    @property
    def last_counter(self) -> int:
        """The counter of the frame that was sealed last."""
        return self._next - 1

    @property
    def tag_bytes(self) -> int:
        """Length of the tag."""
        return self._keys.tag_bytes

    def overhead_bytes(self, now_ns: int) -> int:
        """Header and tag of the next frame."""
        self._hold_counter()
        full = self.full_headers.is_due(now_ns)
        return self._keys.tag_bytes + (FULL_HEADER_BYTES if full else SHORT_HEADER_BYTES)

    def next_epoch(self) -> int:
        """The epoch of the next frame."""
        self._hold_counter()
        return self._block.epoch

    def seal(self, payload: bytes, now_ns: int) -> bytes:
        """Header, encrypted payload, tag; ``overhead_bytes`` longer than the payload."""
        self._hold_counter()
        full = self.full_headers.is_due(now_ns)
        epoch, counter = self._block.epoch, self._next
        self._next += 1
        header = write_header(self._sender, epoch, counter, full=full)
        if full:
            self.full_headers.sent(now_ns)
        cipher = self._keys.sending(now_ns).cipher(self._sender)
        return header + cipher.encrypt(nonce(self._sender, epoch, counter), payload, header)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        self.full_headers.set_back(by_ns)

    def _hold_counter(self) -> None:
        """See that the next counter is reserved; a new epoch starts with full headers again."""
        if self._next < self._block.end:
            return
        block = self._counters.reserve()
        if block.epoch != self._block.epoch:
            self.full_headers.begin()
        self._block, self._next = block, block.first


class Opener:
    """Opens others' frames on one net, each once. ``opened`` counts them, ``lost`` those that never came.

    A frame that fits no counter costs at most 8 tries, and 60 more while far tries are left: 64 of those a second,
    so that a flood of garbage can neither busy the computer nor guess tags faster. Twice as many in a roll-over.
    """

    def __init__(self, keys: Keys, memory: Memory | None = None) -> None:
        self._keys = keys
        self.memory: Memory = {} if memory is None else memory
        self.lost = 0
        self.opened = 0
        self._far_tries = FAR_TRIES_DEPTH
        self._filled_s = 0
        self._now_ns = 0

    def pass_time(self, now_ns: int) -> None:
        """Event time is ``now_ns``: far tries come back."""
        now_s = now_ns // NS_PER_S
        gained = FAR_TRIES_PER_S * max(0, now_s - self._filled_s)
        self._far_tries = min(self._far_tries + gained, FAR_TRIES_DEPTH)
        self._filled_s = now_s
        self._now_ns = now_ns

    def open(self, frame: bytes, header: Header | None = None) -> Opened:
        """The authentic payload; FrameError (short, version, unknown_epoch, forged, replayed) otherwise.

        ``header``: the frame's own, if it was read before.
        """
        header = header or read_header(frame)
        if len(frame) < header.length_bytes + self._keys.tag_bytes:
            raise FrameError("short", f"{len(frame)} bytes")
        heard = self.memory.get(header.sender)
        for epoch, counter in self._counters_of(header, heard):
            payload = self._decrypt(header, epoch, counter, frame)
            if payload is None:
                continue
            if heard is not None and not heard.is_new(epoch, counter):
                raise FrameError("replayed", f"frame of {header.sender} was heard before or is too old")
            self._remember(header.sender, epoch, counter)
            return Opened(header.sender, payload, epoch, counter)
        raise FrameError("forged", f"frame of {header.sender} is not sealed with this net's key")

    def _counters_of(self, header: Header, heard: Heard | None) -> Iterable[tuple[int, int]]:
        """The (epoch, counter) pairs this header may stand for."""
        if header.full is not None:
            yield header.full
            return
        if heard is None:
            raise FrameError("unknown_epoch", f"no full header of {header.sender} heard yet")
        for counter in heard.near(header.counter_low):
            yield heard.epoch, counter
        for counter in heard.far(header.counter_low):
            if self._far_tries == 0:
                return
            self._far_tries -= 1
            yield heard.epoch, counter

    def _decrypt(self, header: Header, epoch: int, counter: int, frame: bytes) -> bytes | None:
        for keys in self._keys.accepted(self._now_ns):
            payload = self._decrypt_with(keys, header, nonce(header.sender, epoch, counter), frame)
            if payload is not None:
                return payload
        return None

    def _decrypt_with(self, keys: NetKeys, header: Header, number: bytes, frame: bytes) -> bytes | None:
        clear = header.length_bytes
        try:
            return keys.cipher(header.sender).decrypt(number, frame[clear:], frame[:clear])
        except InvalidTag:
            return None

    def _remember(self, sender: int, epoch: int, counter: int) -> None:
        self.opened += 1
        heard = self.memory.get(sender)
        if heard is None:
            self.memory[sender] = Heard(epoch, counter)
        else:
            self.lost += heard.accept(epoch, counter)
