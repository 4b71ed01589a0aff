"""Payloads too long for a frame: cut by the sender, put together by the receiver, who keeps few, briefly."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Final

from bootprint.clock import NS_PER_S
from sa_hub.radio.control import MOST_FRAGMENTS, Fragment

HEAD_BYTES: Final = 13
"""Bytes of a fragment's payload before its data, seven names of those who are asked included."""
KEEP_NS: Final = 120 * NS_PER_S
CAPACITY: Final = 16
_MESSAGES: Final = 64


class Cutter:
    """Numbers this hub's long payloads and cuts them."""

    def __init__(self) -> None:
        self._next = 0

    def cut(self, payload: bytes, limit_bytes: int) -> list[Fragment]:
        """Parts that each fit a payload of ``limit_bytes``; what does not fit 16 of them is lost."""
        size = limit_bytes - HEAD_BYTES
        parts = [payload[start : start + size] for start in range(0, len(payload), size)][:MOST_FRAGMENTS]
        message, self._next = self._next, (self._next + 1) % _MESSAGES
        return [Fragment(message, index, len(parts) - 1, part) for index, part in enumerate(parts)]


@dataclass(slots=True)
class _Collected:
    """Parts of a payload by index, and how each is acknowledged."""

    since_ns: int
    parts: dict[int, bytes] = field(default_factory=dict)
    acknowledge: dict[int, Callable[[int], None]] = field(default_factory=dict)


_Key = tuple[Hashable, int, int]


class Collector:
    """Parts of others' payloads: at most 16 payloads at a time, 4 kB each, for two minutes.

    Parts are acknowledged when all are there: who forgets them before that, killed perhaps, must get them again.
    """

    def __init__(self) -> None:
        self._begun: OrderedDict[_Key, _Collected] = OrderedDict()
        self._whole: OrderedDict[_Key, int] = OrderedDict()

    def add(
        self, source: Hashable, fragment: Fragment, now_ns: int, acknowledge: Callable[[int], None]
    ) -> bytes | None:
        """Keep a part; the whole payload when this was the last one missing.

        ``source``: its sender and their epoch, in which they number their payloads. ``acknowledge`` is called
        with the time when the payload is whole, at once where it was before.
        """
        self._forget_old(now_ns)
        key = source, fragment.message, fragment.last
        if key in self._whole:
            acknowledge(now_ns)
            return None
        begun = self._begun.setdefault(key, _Collected(now_ns))
        begun.parts[fragment.index] = fragment.data
        begun.acknowledge[fragment.index] = acknowledge
        if len(begun.parts) <= fragment.last:
            return None
        del self._begun[key]
        self._whole[key] = now_ns
        for each in begun.acknowledge.values():
            each(now_ns)
        return b"".join(begun.parts[index] for index in range(fragment.last + 1))

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        for begun in self._begun.values():
            begun.since_ns -= by_ns
        for key in self._whole:
            self._whole[key] -= by_ns

    def __len__(self) -> int:
        return len(self._begun)

    def _forget_old(self, now_ns: int) -> None:
        """Room for one more: the oldest go first."""
        while self._begun:
            oldest = next(iter(self._begun.values()))
            if len(self._begun) < CAPACITY and now_ns - oldest.since_ns <= KEEP_NS:
                break
            self._begun.popitem(last=False)
        while self._whole:
            if len(self._whole) < _MESSAGES and now_ns - next(iter(self._whole.values())) <= KEEP_NS:
                break
            self._whole.popitem(last=False)
