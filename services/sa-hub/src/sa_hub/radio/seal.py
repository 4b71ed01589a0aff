"""The seal of a frame: AES-256-CCM with a short tag, and a nonce that costs one byte on the air.

Each (net, sender) has its own key, HKDF-SHA256 of the group key; the nonce is (sender, epoch, counter). Frames
carry the counter's low byte; epoch and counter travel in full in the first frames after a start and once a minute,
so that a late listener needs nothing but a minute's patience. The header is authenticated, the payload is
encrypted too.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESCCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.counters import CounterSource
from sa_hub.radio.errors import FrameError
from sa_hub.radio.layout import (
    COUNTER_LOW_BITS,
    FULL_HEADER_BYTES,
    HEADER,
    SHORT_HEADER_BYTES,
    VERSION,
    Kind,
    read_fields,
    write_fields,
)
from sa_hub.radio.replay import Heard, Memory

GROUP_KEY_BYTES: Final = 32
FULL_EVERY_NS: Final = 60_000_000_000
FULL_AT_START: Final = 3
TagBytes = Literal[4, 8]


@dataclass(frozen=True, slots=True)
class Header:
    """What stands in clear; epoch and the counter's high bits only in full headers."""

    kind: int
    sender: int
    counter_low: int
    epoch: int | None
    counter_high: int | None


@dataclass(frozen=True, slots=True)
class Opened:
    """An authentic frame that was not heard before."""

    kind: int
    sender: int
    payload: bytes


@dataclass(frozen=True)
class NetKeys:
    """The keys of one radio net. Net and tag length are bound into each key, so frames do not cross nets."""

    group_key: bytes
    net: str
    tag_bytes: TagBytes

    @cached_property
    def _ciphers(self) -> dict[int, AESCCM]:
        return {}

    def cipher(self, sender: int) -> AESCCM:
        """The cipher of one sender."""
        if sender not in self._ciphers:
            info = b"bootprint radio 1|%d|%d|" % (self.tag_bytes, sender) + self.net.encode()
            key = HKDF(algorithm=SHA256(), length=32, salt=None, info=info).derive(self.group_key)
            self._ciphers[sender] = AESCCM(key, tag_length=self.tag_bytes)
        return self._ciphers[sender]


class Sealer:
    """Seals this hub's own frames on one net.

    ConfigError from any method if no more counters can be reserved; then nothing may be sent.
    """

    def __init__(self, keys: NetKeys, sender: int, counters: CounterSource) -> None:
        self._keys = keys
        self._sender = sender
        self._counters = counters
        self._block = counters.reserve()
        self._next = self._block.first
        self._full_sent = 0
        self._full_ns = 0

    @property
    def tag_bytes(self) -> int:
        """Length of the tag."""
        return self._keys.tag_bytes

    def overhead_bytes(self, now_ns: int) -> int:
        """Header and tag of the next frame."""
        self._hold_counter()
        return self._keys.tag_bytes + (FULL_HEADER_BYTES if self._is_full(now_ns) else SHORT_HEADER_BYTES)

    def seal(self, kind: Kind, payload: bytes, now_ns: int) -> bytes:
        """Header, encrypted payload, tag; ``overhead_bytes`` longer than the payload."""
        self._hold_counter()
        full = self._is_full(now_ns)
        epoch, counter = self._block.epoch, self._next
        self._next += 1
        header = _header_bytes(kind, self._sender, epoch, counter, full=full)
        if full:
            self._full_sent += 1
            self._full_ns = now_ns
        nonce = _nonce(self._sender, epoch, counter)
        return header + self._keys.cipher(self._sender).encrypt(nonce, payload, header)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        self._full_ns -= by_ns

    def _is_full(self, now_ns: int) -> bool:
        return self._full_sent < FULL_AT_START or now_ns - self._full_ns >= FULL_EVERY_NS

    def _hold_counter(self) -> None:
        """See that the next counter is reserved; a new epoch starts with full headers again."""
        if self._next < self._block.end:
            return
        block = self._counters.reserve()
        if block.epoch != self._block.epoch:
            self._full_sent = 0
        self._block, self._next = block, block.first


class Opener:
    """Opens others' frames on one net, each once. ``opened`` counts them, ``lost`` those that never came."""

    def __init__(self, keys: NetKeys, memory: Memory | None = None) -> None:
        self._keys = keys
        self.memory: Memory = {} if memory is None else memory
        self.lost = 0
        self.opened = 0

    def open(self, frame: bytes) -> Opened:
        """The authentic payload; FrameError (short, version, unknown_epoch, forged, replayed) otherwise."""
        header, length = read_header(frame)
        if len(frame) < length + self._keys.tag_bytes:
            raise FrameError("short", f"{len(frame)} bytes")
        heard = self.memory.get(header.sender)
        replayed = False
        for epoch, counter in _counters_of(header, heard):
            if heard is not None and not heard.is_new(epoch, counter):
                replayed = True
                continue
            payload = self._decrypt(header.sender, epoch, counter, frame, length)
            if payload is not None:
                self._remember(header.sender, epoch, counter)
                return Opened(header.kind, header.sender, payload)
        if replayed:
            raise FrameError("replayed", f"frame of {header.sender} was heard before or is too old")
        raise FrameError("forged", f"frame of {header.sender} is not sealed with this net's key")

    def _decrypt(
        self, sender: int, epoch: int, counter: int, frame: bytes, header_bytes: int
    ) -> bytes | None:
        nonce = _nonce(sender, epoch, counter)
        try:
            return self._keys.cipher(sender).decrypt(nonce, frame[header_bytes:], frame[:header_bytes])
        except InvalidTag:
            return None

    def _remember(self, sender: int, epoch: int, counter: int) -> None:
        self.opened += 1
        heard = self.memory.get(sender)
        if heard is None:
            self.memory[sender] = Heard(epoch, counter)
        else:
            self.lost += heard.accept(epoch, counter)


def read_header(frame: bytes) -> tuple[Header, int]:
    """The header and its length in bytes; nothing in it is to be trusted yet."""
    reader = BitReader(frame[:FULL_HEADER_BYTES])
    values = read_fields(reader, HEADER, {})
    if values["version"] != VERSION:
        raise FrameError("version", f"version {values['version']}")
    full = values["full"]
    header = Header(
        kind=values["kind"],
        sender=values["sender"],
        counter_low=values["counter_low"],
        epoch=values["epoch"] if full else None,
        counter_high=values["counter_high"] if full else None,
    )
    return header, FULL_HEADER_BYTES if full else SHORT_HEADER_BYTES


def _counters_of(header: Header, heard: Heard | None) -> Iterable[tuple[int, int]]:
    """The (epoch, counter) pairs this header may stand for."""
    if header.epoch is not None and header.counter_high is not None:
        return [(header.epoch, header.counter_high << COUNTER_LOW_BITS | header.counter_low)]
    if heard is None:
        raise FrameError("unknown_epoch", f"no full header of {header.sender} heard yet")
    return ((heard.epoch, counter) for counter in heard.candidates(header.counter_low))


def _header_bytes(kind: Kind, sender: int, epoch: int, counter: int, *, full: bool) -> bytes:
    writer = BitWriter()
    values = {
        "version": VERSION,
        "kind": kind,
        "sender": sender,
        "full": int(full),
        "counter_low": counter % (1 << COUNTER_LOW_BITS),
        "epoch": epoch,
        "counter_high": counter >> COUNTER_LOW_BITS,
    }
    write_fields(writer, HEADER, values)
    return writer.to_bytes()


def _nonce(sender: int, epoch: int, counter: int) -> bytes:
    """13 bytes: sender 2, epoch 4, counter 4, zeros."""
    return sender.to_bytes(2) + epoch.to_bytes(4) + counter.to_bytes(4) + bytes(3)
