"""How often keys speak, by their messages' own times, against the table of topics."""

from collections import deque
from dataclasses import dataclass, field
from typing import Literal

import msgspec

from bootprint.errors import WireError
from bootprint.topics import Topic, parse_key

RateState = Literal["ok", "slow", "fast", "silent", "event", "unknown", "unreadable"]
WINDOW_NS = 10_000_000_000
SILENT_PERIODS = 3.0
SILENT_AT_LEAST_S = 2.0  # fused positions lag behind the samples they come from
_NS_PER_S = 1_000_000_000


class _Stamp(msgspec.Struct):
    time_ns: int


_STAMP = msgspec.msgpack.Decoder(_Stamp)


@dataclass(frozen=True, slots=True)
class KeyRate:
    """One row: rates over the last ten seconds of event time, None where there are too few messages.

    States: ``slow`` and ``fast`` are off the expected rate by more than the topic's tolerance, ``silent`` has
    said nothing for three periods and two seconds, ``event`` has no expected rate, ``unknown`` is no key of this
    version, ``unreadable`` carries no time in its newest message.
    """

    key: str
    messages: int
    rate_hz: float | None
    expected_hz: float | None
    bytes_per_s: float | None
    state: RateState


@dataclass(slots=True)
class _Heard:
    topic: Topic | None
    messages: int = 0
    readable: bool = True
    window: deque[tuple[int, int]] = field(default_factory=deque)

    def rates(self) -> tuple[float, float] | None:
        """Messages and bytes per second over the window."""
        if len(self.window) < 2:
            return None
        span_s = (self.window[-1][0] - self.window[0][0]) / _NS_PER_S
        if span_s <= 0.0:
            return None
        return (len(self.window) - 1) / span_s, sum(size for _, size in list(self.window)[1:]) / span_s


class RateMeter:
    """Counts messages by key."""

    def __init__(self) -> None:
        self._heard: dict[str, _Heard] = {}
        self._newest_ns = 0

    def observe(self, key: str, payload: bytes) -> None:
        """A message has been heard."""
        heard = self._heard.setdefault(key, _Heard(_topic(key)))
        heard.messages += 1
        try:
            time_ns = _STAMP.decode(payload).time_ns
        except (msgspec.MsgspecError, ValueError, RecursionError):
            heard.readable = False
            return
        heard.readable = True
        heard.window.append((time_ns, len(payload)))
        while heard.window[0][0] < time_ns - WINDOW_NS:
            heard.window.popleft()
        self._newest_ns = max(self._newest_ns, time_ns)

    def rows(self) -> list[KeyRate]:
        """A row for each key, sorted by key."""
        return [self._row(key, heard) for key, heard in sorted(self._heard.items())]

    def _row(self, key: str, heard: _Heard) -> KeyRate:
        rates = heard.rates()
        rate_hz, bytes_per_s = rates or (None, None)
        expected_hz = heard.topic.rate_hz if heard.topic else None
        return KeyRate(key, heard.messages, rate_hz, expected_hz, bytes_per_s, self._state(heard, rate_hz))

    def _state(self, heard: _Heard, rate_hz: float | None) -> RateState:
        if heard.topic is None:
            return "unknown"
        if not heard.readable:
            return "unreadable"
        expected_hz = heard.topic.rate_hz
        if expected_hz is None:
            return "event"
        quiet_s = (self._newest_ns - heard.window[-1][0]) / _NS_PER_S
        if quiet_s > max(SILENT_PERIODS / expected_hz, SILENT_AT_LEAST_S):
            return "silent"
        most = 1.0 + heard.topic.tolerance
        if rate_hz is None or expected_hz / most <= rate_hz <= expected_hz * most:
            return "ok"
        return "slow" if rate_hz < expected_hz else "fast"


def _topic(key: str) -> Topic | None:
    try:
        return parse_key(key).topic
    except WireError:
        return None
