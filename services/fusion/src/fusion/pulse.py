"""What time it is by the inputs' own stamps, and which stamps can be true.

The *drivers* (the feet) make time. `LivePulse` believes no single stamp: one further than ten seconds from where
time stands drives nothing, and only when drivers say the same many times in a row is their clock followed, ahead
or back. Others (receivers, people) never move time while drivers speak. Silence of the drivers is measured on each
other clock *by itself*, as how far it went on, so a clock that is wrong by any constant does no harm.

`ReplayPulse` is for replay as fast as possible: there sources run ahead of one another by any amount, nothing is
lost on the way, and waiting costs nothing. So it never overrules anybody.
"""

from dataclasses import dataclass
from enum import Enum, auto
from typing import Protocol

from bootprint.clock import NS_PER_S

JUMP_NS = 10 * NS_PER_S
NEVER = -(1 << 63)
_ENOUGH = 25  # messages: one to three seconds of boots; a fault that passes is shorter
_HOST = ""  # the host's clock among the sources' clocks


class Verdict(Enum):
    """What a stamp is worth."""

    NEAR = auto()
    CONTRADICTS = auto()  # near, from a driver: those that stood alone were wrong
    LONE = auto()  # may be true, but drives nothing
    CONFIRMED = auto()  # enough have said so: time has leapt, those that stood alone were right
    REFUSED = auto()
    BEHIND = auto()  # long past
    SET_BACK = auto()  # enough have said so: the drivers' clock has been set back


class Pulse(Protocol):
    """Where time stands."""

    driven_ns: int
    in_order: bool  # whether every source's messages come in order and none is missing

    def hear(self, source: str, time_ns: int, low_ns: int) -> Verdict:
        """A source has spoken; everything before ``low_ns`` has been released."""

    def tick(self, now_ns: int) -> None:
        """The host's event time."""

    def sure_before_ns(self) -> int:
        """Before this nothing is waited for."""

    def restart(self, time_ns: int) -> int:
        """Follow the drivers back to ``time_ns``; by how much time has moved (negative), ns."""


@dataclass(slots=True)
class _Clock:
    """How far one clock went on since it was first read after a driver; its leaps tell nothing."""

    last_ns: int | None
    since_ns: int = 0

    def reset(self) -> None:
        self.last_ns, self.since_ns = None, 0

    def go(self, to_ns: int) -> None:
        ahead_ns = 0 if self.last_ns is None else to_ns - self.last_ns
        if 0 < ahead_ns <= JUMP_NS:
            self.since_ns += ahead_ns
        if self.last_ns is None or ahead_ns > 0 or ahead_ns < -JUMP_NS:
            self.last_ns = to_ns


@dataclass(slots=True)
class _Row:
    """Stamps in a row that are far from where time stands, but near one another."""

    last_ns: int = NEVER
    length: int = 0

    def is_long_with(self, time_ns: int) -> bool:
        """Add a stamp; whether so many cannot be chance."""
        self.length = self.length + 1 if abs(time_ns - self.last_ns) <= JUMP_NS else 1
        self.last_ns = time_ns
        return self.length >= _ENOUGH

    def end(self) -> bool:
        """Forget the row; whether there was one."""
        length, self.length, self.last_ns = self.length, 0, NEVER
        return length > 0


class LivePulse:
    """Time as the drivers tell it, with bounded waiting."""

    in_order = False

    def __init__(self, drivers: frozenset[str], window_ns: int, patience_ns: int) -> None:
        self.driven_ns = NEVER  # newest stamp of a driver
        self._drivers = drivers
        self._window_ns = window_ns
        self._patience_ns = patience_ns
        self._first_ns = NEVER  # what anybody said first
        self._ticked_ns = NEVER
        self._clocks: dict[str, _Clock] = {}
        self._row = _Row()

    def hear(self, source: str, time_ns: int, low_ns: int) -> Verdict:
        """Judge a stamp, and let it move time if it may."""
        ahead = self._first_ns != NEVER and time_ns > max(self._present_ns, self._ticked_ns) + JUMP_NS
        if source not in self._drivers:
            return Verdict.REFUSED if ahead else self._follow(source, time_ns)
        if ahead:
            return self._confirm(time_ns) if self._row.is_long_with(time_ns) else Verdict.LONE
        if time_ns < min(low_ns, low_ns if self.driven_ns == NEVER else self.driven_ns) - JUMP_NS:
            return Verdict.SET_BACK if self._row.is_long_with(time_ns) else Verdict.BEHIND
        self._drive(time_ns)
        return Verdict.CONTRADICTS if self._row.end() else Verdict.NEAR

    def _confirm(self, time_ns: int) -> Verdict:
        self._row.end()
        self._drive(time_ns)
        return Verdict.CONFIRMED

    def _follow(self, source: str, time_ns: int) -> Verdict:
        self._begin(time_ns)
        self._clocks.setdefault(source, _Clock(time_ns)).go(time_ns)
        return Verdict.NEAR

    def _drive(self, time_ns: int) -> None:
        self._begin(time_ns)
        self.driven_ns = max(self.driven_ns, time_ns)
        for clock in self._clocks.values():
            clock.reset()

    def _begin(self, time_ns: int) -> None:
        if self._first_ns == NEVER:
            self._first_ns = time_ns

    def tick(self, now_ns: int) -> None:
        """The host's event time: for silent drivers, and for what may be true."""
        self._begin(now_ns)
        self._ticked_ns = now_ns
        start_ns = self._first_ns if self.driven_ns == NEVER else self.driven_ns
        self._clocks.setdefault(_HOST, _Clock(start_ns)).go(now_ns)

    @property
    def _silence_ns(self) -> int:
        return max((clock.since_ns for clock in self._clocks.values()), default=0)

    @property
    def _present_ns(self) -> int:
        """The drivers' newest stamp and the silence since; before they were heard, the host's time."""
        if self.driven_ns != NEVER:
            return self.driven_ns + self._silence_ns
        return self._first_ns + self._silence_ns if self._ticked_ns == NEVER else self._ticked_ns

    def sure_before_ns(self) -> int:
        """The window behind the drivers, or behind the present once their silence has outlasted the patience.

        Patience is the doubt whether they are silent or delayed: it is over when it has been waited for. Before
        they were ever heard, the present is the host's clock, which may be wrong by as much.
        """
        if self._silence_ns <= self._patience_ns:
            return self.driven_ns - self._window_ns
        if self.driven_ns == NEVER:
            return self._present_ns - self._patience_ns
        return self._present_ns - self._window_ns

    def restart(self, time_ns: int) -> int:
        """Follow the drivers back."""
        by_ns = time_ns - self._present_ns
        self._row.end()
        self.driven_ns = NEVER
        self._drive(time_ns)
        return by_ns


class ReplayPulse:
    """Time in a replay as fast as possible: only the sources' own watermarks count."""

    in_order = True

    def __init__(self, drivers: frozenset[str]) -> None:
        self.driven_ns = NEVER
        self._drivers = drivers
        self._last_ns: dict[str, int] = {}

    def hear(self, source: str, time_ns: int, low_ns: int) -> Verdict:
        """A stamp far from its source's last one is kept but moves nothing."""
        last_ns = self._last_ns.get(source, time_ns)
        self._last_ns[source] = time_ns
        if abs(time_ns - last_ns) > JUMP_NS:
            return Verdict.LONE
        if source in self._drivers:
            self.driven_ns = max(self.driven_ns, time_ns)
        return Verdict.NEAR

    def tick(self, now_ns: int) -> None:
        """A replay as fast as possible has no clock."""

    def sure_before_ns(self) -> int:
        """Everybody is waited for."""
        return NEVER

    def restart(self, time_ns: int) -> int:
        """Never asked for: no stamp is called `Verdict.SET_BACK` here."""
        return 0
