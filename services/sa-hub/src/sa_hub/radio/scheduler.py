"""When to report whom: what the receivers on a net believe, and how wrong that belief has become.

Every receiver moves a soldier on at constant velocity from the last report on the air, whoever sent it. A report
is worth sending when that prediction is off by more than a threshold, or when a heartbeat is due; since what was
heard on a net is believed there, a relay never repeats a net's own news to it.

Nobody acknowledges a report, so news is confirmed: after a report that changed the belief the next heartbeat comes
early, then later and later (doubling, as the Trickle algorithm of RFC 6206), until something changes again.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from bootprint.clock import NS_PER_S
from bootprint.geodesy import ground_offset
from sa_hub.radio.content import Report

COMPANION_URGENCY: Final = 0.6
"""Who is this near to being due comes along in a frame that is sent anyway."""

CLOCK_SET_BACK_S: Final = 60.0
"""A belief about ourselves that is this much newer than what we know now is of a clock since set right."""


@dataclass(frozen=True, slots=True)
class Policy:
    """Error and silence that make a report due, and how long the first one due waits for others.

    ``confirm_s`` is the silence allowed after news, ``heartbeat_s`` the silence it grows to.
    """

    threshold_m: float
    heartbeat_s: float
    confirm_s: float
    gather_s: float


@dataclass(frozen=True, slots=True)
class Belief:
    """What a net knows of a soldier, and after which silence it is to hear again."""

    report: Report
    silence_s: float


class Scheduler:
    """The receivers' beliefs on one net."""

    def __init__(self, policy: Policy, own: int) -> None:
        self._policy = policy
        self._own = own
        self._beliefs: dict[int, Belief] = {}
        self._first_due_ns: int | None = None

    def told(self, report: Report) -> None:
        """This report was on the air: it is what the net believes now, unless it knows better."""
        belief = self._beliefs.get(report.number)
        if belief is None or report.time_ns > belief.report.time_ns or report.number == self._own:
            self._beliefs[report.number] = Belief(report, self._silence_after(report, belief))

    def _silence_after(self, report: Report, belief: Belief | None) -> float:
        policy = self._policy
        if (
            belief is None
            or predicted_error_m(belief.report, report) > COMPANION_URGENCY * policy.threshold_m
        ):
            return min(policy.confirm_s, policy.heartbeat_s)
        return min(2.0 * belief.silence_s, policy.heartbeat_s)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much. Of ourselves nobody knows the new time yet: that is news."""
        self._first_due_ns = None
        self._beliefs.pop(self._own, None)
        for number, belief in self._beliefs.items():
            report = replace(belief.report, time_ns=belief.report.time_ns - by_ns)
            self._beliefs[number] = replace(belief, report=report)

    def due(self, candidates: Sequence[Report], now_ns: int) -> list[Report]:
        """Who is to be reported now, the most urgent first: those due and those nearly so; none while gathering."""
        ranked = sorted(((self.urgency(each), each) for each in candidates), key=lambda pair: -pair[0])
        if not ranked or ranked[0][0] < 1.0:
            self._first_due_ns = None
            return []
        if self._first_due_ns is None:
            self._first_due_ns = now_ns
        if len(candidates) > 1 and now_ns - self._first_due_ns < self._policy.gather_s * NS_PER_S:
            return []
        return [report for urgency, report in ranked if urgency >= COMPANION_URGENCY]

    def urgency(self, report: Report) -> float:
        """1 when due: the larger of error and silence, each over what is allowed; infinite if never told."""
        belief = self._beliefs.get(report.number)
        if belief is None:
            return math.inf
        silence_s = (report.time_ns - belief.report.time_ns) / NS_PER_S
        if silence_s <= 0.0:
            set_back = report.number == self._own and silence_s < -CLOCK_SET_BACK_S
            return math.inf if set_back else 0.0
        error_m = predicted_error_m(belief.report, report)
        return max(error_m / self._policy.threshold_m, silence_s / belief.silence_s)


def predicted_error_m(belief: Report, report: Report) -> float:
    """How far off a receiver that believes ``belief`` puts the soldier at the time of ``report``, horizontally."""
    elapsed_s = (report.time_ns - belief.time_ns) / NS_PER_S
    east, north = ground_offset(
        (belief.latitude_deg, belief.longitude_deg), (report.latitude_deg, report.longitude_deg)
    )
    return math.hypot(east - belief.east_m_s * elapsed_s, north - belief.north_m_s * elapsed_s)
