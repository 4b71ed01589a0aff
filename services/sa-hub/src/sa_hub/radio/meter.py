"""What a link carried: totals, faults by cause, bits per second and airtime over sliding windows of event time."""

from collections import Counter, deque
from typing import Final

from sa_hub.radio.medium import DUTY_WINDOW_S, Medium

WINDOW_NS: Final = 10_000_000_000
_NS_PER_S: Final = 1_000_000_000


class LinkMeter:
    """Bytes are those on the air, the link's header included."""

    def __init__(self, medium: Medium) -> None:
        self.frames_sent = 0
        self.frames_received = 0
        self.bytes_sent = 0
        self.bytes_received = 0
        self.rejected: Counter[str] = Counter()
        self._medium = medium
        self._recent: deque[tuple[int, int]] = deque()
        self._hour: deque[tuple[int, int]] = deque()
        """(second, bits sent in it), the last hour's."""
        self._hour_bits = 0

    def sent(self, air_bytes: int, now_ns: int) -> None:
        """A frame went out."""
        bits = 8 * air_bytes
        self.frames_sent += 1
        self.bytes_sent += air_bytes
        self._recent.append((now_ns, bits))
        second = now_ns // _NS_PER_S
        before = self._hour.pop()[1] if self._hour and self._hour[-1][0] == second else 0
        self._hour.append((second, before + bits))
        self._hour_bits += bits

    def heard(self, air_bytes: int) -> None:
        """Something came in, good or bad."""
        self.bytes_received += air_bytes

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        self._recent = deque((time_ns - by_ns, bits) for time_ns, bits in self._recent)
        self._hour = deque((second - by_ns // _NS_PER_S, bits) for second, bits in self._hour)

    def bits_per_s(self, now_ns: int) -> float:
        """Bits sent in the last 10 s of event time, per second."""
        while self._recent and self._recent[0][0] <= now_ns - WINDOW_NS:
            self._recent.popleft()
        return sum(bits for _, bits in self._recent) * 1e9 / WINDOW_NS

    def airtime_share(self, now_ns: int) -> float:
        """The share of the last hour in which our transmitter was keyed."""
        return self._airtime_s(now_ns) / DUTY_WINDOW_S

    def duty_left_s(self, now_ns: int) -> float | None:
        """Airtime that the duty cycle still leaves in this hour, s; None without such a rule."""
        if self._medium.duty_cycle == 1.0:
            return None
        return max(0.0, self._medium.duty_cycle * DUTY_WINDOW_S - self._airtime_s(now_ns))

    def _airtime_s(self, now_ns: int) -> float:
        while self._hour and self._hour[0][0] <= now_ns // _NS_PER_S - DUTY_WINDOW_S:
            self._hour_bits -= self._hour.popleft()[1]
        return self._hour_bits / self._medium.rate_bits_per_s
