"""The hub's picture: the newest report of every soldier, and whether it is fresh, stale or lost by now."""

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from bootprint.clock import NS_PER_S
from bootprint.display import Ages
from bootprint.messages import TrackState
from sa_hub.radio.content import Report, one_hop_on

CLOCK_TOLERANCE_NS: Final = 10 * NS_PER_S
"""A sender's clock that seems off by less is taken as right: the way of a frame takes time, too."""
CLOCK_SET_BACK_NS: Final = 60 * NS_PER_S
"""Our own positions going back by more than this mean that a clock was set right, not that one came late."""
_CLOCK_SAMPLES: Final = 8
_CLOCK_SET_SAMPLES: Final = 3
_RELAYED_ONLY: Final = 64
"""Frames without the sender's own report after which its old ones tell nothing of its clock any more."""
_SMOOTHING_S: Final = 0.5
_NEVER_NS: Final = 1 << 63


@dataclass(slots=True)
class Known:
    """One soldier as known here. Times are this hub's; ``via`` is the net it came over, "own" for ourselves."""

    report: Report
    received_ns: int
    via: str
    state: TrackState = "fresh"
    _passed_on: Report | None = None

    @property
    def passed_on(self) -> Report:
        """The report as a relay sends it on; made once, since relays ask for everybody's ten times a second."""
        if self._passed_on is None:
            self._passed_on = one_hop_on(self.report)
        return self._passed_on


class Tracks:
    """The newest report of each soldier. Our own track ages by its arrival, others by their report's time."""

    def __init__(self, own: int, own_ages: Ages, ages: Ages) -> None:
        self._own = own
        self._own_ages = own_ages
        self._ages = ages
        self._known: dict[int, Known] = {}
        self._sorted: list[int] = []
        self._next_change_ns = _NEVER_NS

    def update(self, report: Report, received_ns: int, via: str) -> Known | None:
        """Take a report in; None if the one known is as new."""
        known = self._known.get(report.number)
        if known is not None and not self._supersedes(report, known.report):
            return None
        fresh = Known(report, received_ns, via)
        fresh.state = self._state(fresh, received_ns)
        self._known[report.number] = fresh
        if known is None:
            self._sorted = sorted(self._known)
        self._next_change_ns = min(self._next_change_ns, self._changes_ns(fresh))
        return fresh

    def get(self, number: int) -> Known | None:
        """What is known of a soldier."""
        return self._known.get(number)

    def all(self) -> list[Known]:
        """Everyone known, by number."""
        return [self._known[number] for number in self._sorted]

    def changes(self, now_ns: int) -> Iterator[Known]:
        """Those whose state has changed by ``now_ns``; their new state is set."""
        if now_ns < self._next_change_ns:
            return
        for known in self.all():
            state = self._state(known, now_ns)
            if state != known.state:
                known.state = state
                yield known
        self._next_change_ns = min(map(self._changes_ns, self.all()), default=_NEVER_NS)

    def own_arrived(self, now_ns: int) -> None:
        """It is ``now_ns``: our own report, whatever its stamp says, came no later than this."""
        own = self._known.get(self._own)
        if own is not None:
            own.received_ns = min(own.received_ns, now_ns)
            self._next_change_ns = min(self._next_change_ns, self._changes_ns(own))

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much: everyone is as old as before."""
        for known in self._known.values():
            known.report = replace(known.report, time_ns=known.report.time_ns - by_ns)
            known.received_ns -= by_ns
            known._passed_on = None
        self._next_change_ns -= by_ns

    def _supersedes(self, report: Report, known: Report) -> bool:
        set_back = report.number == self._own and known.time_ns - report.time_ns > CLOCK_SET_BACK_NS
        return report.time_ns > known.time_ns or set_back

    def _state(self, known: Known, now_ns: int) -> TrackState:
        ages, since_ns = self._aging(known)
        return ages.state(now_ns - since_ns)

    def _changes_ns(self, known: Known) -> int:
        """When it will be stale, or lost, if nothing is heard meanwhile."""
        ages, since_ns = self._aging(known)
        in_ns = {"fresh": ages.stale_ns, "stale": ages.lost_ns}.get(known.state)
        return _NEVER_NS if in_ns is None else since_ns + in_ns

    def _aging(self, known: Known) -> tuple[Ages, int]:
        """By what, and since when, a track grows old."""
        if known.report.number == self._own:
            return self._own_ages, known.received_ns
        return self._ages, known.report.time_ns


class SenderClock:
    """How far a sender's clock is behind ours, from the times that its frames tell.

    The smallest of the last differences (arrival − report), for a frame's way only adds to it; within ten seconds
    the sender's clock is taken as right. What a frame tells of its sender is of the moment that it was sent. What
    it relays may be old, so that alone never proves a clock to be behind; but nothing is reported before it
    happens, so a newest report in our future proves the sender's clock to be ahead. Three differences in a row a
    minute above the smallest mean that the sender's clock was set back.
    """

    def __init__(self) -> None:
        self._own_ns: deque[int] = deque(maxlen=_CLOCK_SAMPLES)
        self._newest_ns: deque[int] = deque(maxlen=_CLOCK_SAMPLES)
        self._relayed_only = 0

    def observe(self, own_ns: Sequence[int], newest_ns: int, arrived_ns: int) -> None:
        """A frame has arrived: the sender's reports of itself in it, if any, and its newest report of anybody."""
        self._relayed_only = 0 if own_ns else self._relayed_only + 1
        if self._relayed_only > _RELAYED_ONLY:
            self._own_ns.clear()
        for time_ns in own_ns:
            _append(self._own_ns, arrived_ns - time_ns)
        _append(self._newest_ns, arrived_ns - newest_ns)

    @property
    def offset_ns(self) -> int:
        """What to add to the sender's times to have ours."""
        least = min((*self._own_ns, *self._newest_ns), default=0)
        if not self._own_ns:
            least = min(least, 0)
        return 0 if abs(least) <= CLOCK_TOLERANCE_NS else least


def _append(differences_ns: deque[int], difference_ns: int) -> None:
    """Take a difference in; after three in a row a minute above the smallest, those before are of another clock."""
    differences_ns.append(difference_ns)
    recent = list(differences_ns)[-_CLOCK_SET_SAMPLES:]
    if len(recent) == _CLOCK_SET_SAMPLES and min(recent) > min(differences_ns) + CLOCK_SET_BACK_NS:
        differences_ns.clear()
        differences_ns.extend(recent)


class SmoothVelocity:
    """First-order low-pass (0.5 s) of velocity: a report's velocity must outlast the sway of a stride."""

    def __init__(self) -> None:
        self._velocity = (0.0, 0.0)
        self._time_ns: int | None = None

    def update(self, time_ns: int, east_m_s: float, north_m_s: float) -> tuple[float, float]:
        """The smoothed (east, north) velocity; afresh after ten time constants or when time goes back."""
        elapsed_s = math.inf if self._time_ns is None else (time_ns - self._time_ns) / NS_PER_S
        gain = -math.expm1(-elapsed_s / _SMOOTHING_S) if 0.0 <= elapsed_s < 10 * _SMOOTHING_S else 1.0
        east, north = self._velocity
        self._velocity = (east + gain * (east_m_s - east), north + gain * (north_m_s - north))
        self._time_ns = time_ns
        return self._velocity
