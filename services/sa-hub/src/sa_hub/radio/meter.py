"""What a link carried: totals, faults by cause, and bits per second over a sliding window of event time."""

from collections import Counter, deque
from typing import Final

WINDOW_NS: Final = 10_000_000_000


class LinkMeter:
    """Bytes are those on the air, the link's header included."""

    def __init__(self) -> None:
        self.frames_sent = 0
        self.frames_received = 0
        self.bytes_sent = 0
        self.bytes_received = 0
        self.rejected: Counter[str] = Counter()
        self._recent: deque[tuple[int, int]] = deque()

    def sent(self, air_bytes: int, now_ns: int) -> None:
        """A frame went out."""
        self.frames_sent += 1
        self.bytes_sent += air_bytes
        self._recent.append((now_ns, 8 * air_bytes))

    def heard(self, air_bytes: int) -> None:
        """Something came in, good or bad."""
        self.bytes_received += air_bytes

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        self._recent = deque((time_ns - by_ns, bits) for time_ns, bits in self._recent)

    def bits_per_s(self, now_ns: int) -> float:
        """Bits sent in the last 10 s of event time, per second."""
        while self._recent and self._recent[0][0] <= now_ns - WINDOW_NS:
            self._recent.popleft()
        return sum(bits for _, bits in self._recent) * 1e9 / WINDOW_NS
