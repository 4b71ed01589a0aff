"""Payloads too long for a frame: cut by the sender, put together by the receiver, who keeps few, briefly."""

from collections import OrderedDict
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


class Collector:
    """Parts of others' payloads: at most 16 payloads at a time, 4 kB each, for two minutes."""

    def __init__(self) -> None:
        self._parts: OrderedDict[tuple[int, int, int], tuple[int, dict[int, bytes]]] = OrderedDict()

    def add(self, sender: int, fragment: Fragment, now_ns: int) -> bytes | None:
        """Keep a part; the whole payload when this was the last one missing."""
        self._forget_old(now_ns)
        key = sender, fragment.message, fragment.last
        _, parts = self._parts.setdefault(key, (now_ns, {}))
        parts[fragment.index] = fragment.data
        if len(parts) <= fragment.last:
            return None
        del self._parts[key]
        return b"".join(parts[index] for index in range(fragment.last + 1))

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        for key, (since_ns, parts) in self._parts.items():
            self._parts[key] = since_ns - by_ns, parts

    def __len__(self) -> int:
        return len(self._parts)

    def _forget_old(self, now_ns: int) -> None:
        """Room for one more: the oldest go first."""
        while self._parts:
            since_ns, _ = next(iter(self._parts.values()))
            if len(self._parts) < CAPACITY and now_ns - since_ns <= KEEP_NS:
                return
            self._parts.popitem(last=False)
