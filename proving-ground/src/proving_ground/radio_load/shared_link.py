"""The one radio net that everybody of a load test speaks on, in event time.

One transmission at a time, in the order of asking; each costs what the radio's profile says (header, key-up,
slots, symbols). A sender that already has `QUEUE_FRAMES` messages waiting loses the next one, as a radio with a
full buffer does. What is longer than the MTU goes in fragments, all of which must be heard.
"""

import struct
from collections import defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from proving_ground.exercises.processes.emulated_radio import Air, NetProfile
from proving_ground.radio_load.load import NET, Load
from sa_hub.radio.medium import Medium

QUEUE_FRAMES: Final = 4
_INSTANTLY: Final = 1e15  # the air's own rate: the time a frame takes is this module's affair
_ENVELOPE: Final = struct.Struct(
    ">HIBB"
)  # sender, message, fragment, of how many: known without a byte on the air


@dataclass(frozen=True, slots=True)
class Heard:
    """A message that has reached a member in full."""

    at_s: float
    member: str
    sender: int
    message: bytes


class SharedLink:
    """``members`` hear each other, each missing frames for itself by the test's loss.

    ``rate_bits_per_s``: a radio that is slower than the test's own.
    """

    def __init__(self, load: Load, members: Sequence[str], rate_bits_per_s: float | None = None) -> None:
        self._medium = load.medium
        self._slowness = load.medium.rate_bits_per_s / (rate_bits_per_s or load.medium.rate_bits_per_s)
        profile = NetProfile(NET, _INSTANTLY, load.latency_s, load.loss, seed=load.seed)
        self._air = Air(profile, members, zero_s=0.0)
        self._free_at_s = 0.0
        self._ends_s: dict[int, deque[float]] = defaultdict(deque)
        self._parts: dict[tuple[str, int], list[bytes]] = defaultdict(list)
        self._messages = 0
        self.dropped = 0

    def send(self, member: str, sender: int, message: bytes, now_s: float) -> bool:
        """Put a message in the sender's queue; False if that is full."""
        waiting = self._ends_s[sender]
        while waiting and waiting[0] <= now_s:
            waiting.popleft()
        if len(waiting) >= QUEUE_FRAMES:
            self.dropped += 1
            return False
        fragments = fragments_of(message, self._medium.mtu_bytes)
        for index, fragment in enumerate(fragments):
            airtime_s = self._medium.airtime_s(len(fragment)) * self._slowness
            self._free_at_s = max(self._free_at_s, now_s) + airtime_s
            envelope = _ENVELOPE.pack(sender, self._messages, index, len(fragments))
            self._air.transmit(member, envelope + fragment, self._free_at_s)
        waiting.append(self._free_at_s)
        self._messages += 1
        return True

    def arrived(self, now_s: float) -> list[Heard]:
        """The messages that are complete by now, in the order of their arrival."""
        heard = []
        for delivery in self._air.arrived(now_s):
            sender, message, _, count = _ENVELOPE.unpack_from(delivery.datagram)
            parts = self._parts[delivery.member, message]
            parts.append(delivery.datagram[_ENVELOPE.size :])
            if len(parts) == count:
                heard.append(Heard(delivery.due_s, delivery.member, sender, b"".join(parts)))
                del self._parts[delivery.member, message]
        return heard


def fragments_of(message: bytes, mtu_bytes: int) -> list[bytes]:
    """A message in pieces of at most the MTU."""
    return [message[at : at + mtu_bytes] for at in range(0, len(message), mtu_bytes)]


def air_bytes(medium: Medium, message: bytes) -> int:
    """What a message costs on the air, in as many frames as it needs."""
    return sum(medium.air_bytes(len(fragment)) for fragment in fragments_of(message, medium.mtu_bytes))
