"""Event time for shells: the only place where a host clock becomes the time that cores think in.

At speed 1 event time is UTC. A replay at speed N runs event time N times as fast from a common origin, so that
budgets, timers and ages hold in event time whatever the speed. A replay "as fast as possible" has no steady
clock at all: event time is then the newest stamp seen.
"""

import time
from collections.abc import Callable
from typing import Protocol

from bootprint.errors import ConfigError

NS_PER_S = 1_000_000_000
_YEAR_2100_S = 4_102_444_800
_MAX_SPEED = 1e6


class EventClock(Protocol):
    """Where a shell reads event time."""

    def now_ns(self) -> int:
        """Event time now, UTC ns."""

    def observe(self, stamp_ns: int) -> None:
        """A message with this stamp has arrived."""

    def host_seconds_since(self, event_ns: int) -> float | None:
        """How long ago, in host seconds, event time stood at ``event_ns``; None if that has no meaning."""

    def host_seconds_until(self, event_ns: int) -> float:
        """How long, in host seconds, until event time reaches ``event_ns``; never negative."""


class ScaledClock:
    """Event time that runs at ``speed`` from a common origin: ``origin + speed · (host − origin)``."""

    def __init__(self, speed: float, origin_ns: int, host: Callable[[], int] = time.time_ns) -> None:
        if not speed > 0:
            raise ValueError(f"speed must be positive, got {speed}")
        self._speed = speed
        self.origin_ns = origin_ns
        self._host = host

    def now_ns(self) -> int:
        """Event time now, UTC ns."""
        return self.origin_ns + round(self._speed * (self._host() - self.origin_ns))

    def observe(self, stamp_ns: int) -> None:
        """Stamps do not move a steady clock."""

    def host_seconds_since(self, event_ns: int) -> float | None:
        """How long ago, in host seconds, event time stood at ``event_ns``."""
        return (self.now_ns() - event_ns) / (self._speed * NS_PER_S)

    def host_seconds_until(self, event_ns: int) -> float:
        """How long, in host seconds, until event time reaches ``event_ns``."""
        return max(0.0, (event_ns - self.now_ns()) / (self._speed * NS_PER_S))


class DataClock:
    """Event time that follows the newest stamp seen: for replay as fast as possible."""

    def __init__(self) -> None:
        self._newest_ns = 0

    def now_ns(self) -> int:
        """The newest stamp seen, 0 before the first."""
        return self._newest_ns

    def observe(self, stamp_ns: int) -> None:
        """Move on to this stamp if it is newer."""
        self._newest_ns = max(self._newest_ns, stamp_ns)

    def host_seconds_since(self, event_ns: int) -> float | None:
        """Has no meaning without a steady clock."""
        return None

    def host_seconds_until(self, event_ns: int) -> float:
        """Nothing is waited for."""
        return 0.0


def make_clock(speed: str, origin_s: float | None, offset_s: float = 0.0) -> EventClock:
    """A clock from the command line's ``--speed`` (a number, or ``max``) and ``--clock-origin`` (UTC seconds).

    ``offset_s`` is added to the host's clock. ConfigError if any makes no sense.
    """
    if origin_s is not None and not 0 <= origin_s < _YEAR_2100_S:
        raise ConfigError(f"--clock-origin {origin_s} must be UTC seconds since 1970, before the year 2100")
    if speed == "max":
        return DataClock()
    origin_ns = time.time_ns() if origin_s is None else round(origin_s * NS_PER_S)
    offset_ns = round(offset_s * NS_PER_S)
    return ScaledClock(_speed(speed), origin_ns, lambda: time.time_ns() + offset_ns)


def _speed(text: str) -> float:
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0 < speed < _MAX_SPEED:
        raise ConfigError(f"--speed {text!r} must be a positive number or 'max'")
    return speed
