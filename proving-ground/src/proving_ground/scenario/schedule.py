"""When everybody does what: orders and persons' durations become itineraries in which people wait for each other.

Nobody's speed depends on the time of day, so each soldier's clock is pushed on until an order waits for somebody;
when nobody can go on, the rest wait for each other in a circle, and the scenario is at fault.
"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from proving_ground.people import Itinerary, Leg, Person, leg_duration_s
from proving_ground.scenario.faulty import ScenarioFault
from proving_ground.scenario.orders import Act, Await, Mark, Meet, Note, Order, OrderBook, Stay
from proving_ground.scenario.schema.tasks import Posture

FloatArray = npt.NDArray[np.float64]
_WORTH_WAITING_S = 0.05
_POSTURES: tuple[Posture, ...] = ("stand", "kneel", "prone")
_WORTH_KNEELING_S = 4.0  # nobody goes down for less


@dataclass(frozen=True)
class Doing:
    """A line of a soldier's timeline."""

    start_s: float
    end_s: float
    text: str


@dataclass(frozen=True)
class Timetable:
    """A soldier's itinerary and what it is made of."""

    itinerary: Itinerary
    doings: tuple[Doing, ...]
    end_s: float


@dataclass
class _Clock:
    """One soldier on the way through the orders."""

    person: Person
    orders: list[Order]
    place_m: FloatArray  # (1, 3)
    time_s: float = 0.0
    next: int = 0
    key: str = ""
    legs: list[Leg] = field(default_factory=list)
    notes: list[tuple[float, str]] = field(default_factory=list)

    @property
    def done(self) -> bool:
        """Whether all orders have been obeyed."""
        return self.next >= len(self.orders)

    def act(self, leg: Leg) -> None:
        """Go a leg."""
        self.legs.append(leg)
        self.time_s += leg_duration_s(self.person, leg)
        self.place_m = leg.points_m[-1:]

    def wait(self, until_s: float, posture: Posture) -> None:
        """Keep a posture until a time; a wait right after one in the same posture makes that longer."""
        length = until_s - self.time_s
        if length < _WORTH_WAITING_S:
            return
        already = bool(self.legs) and self.legs[-1].gait == posture
        low = already or length >= _WORTH_KNEELING_S
        _hold(self.legs, posture if low else "stand", self.place_m, length)
        self.time_s += length


def _hold(legs: list[Leg], posture: Posture, place_m: FloatArray, length_s: float) -> None:
    """Keep a posture; right after a leg in which one did, that leg becomes longer."""
    last = legs[-1] if legs else None
    if last is not None and last.duration_s is not None and last.gait == posture:
        legs[-1] = Leg(posture, last.points_m, duration_s=last.duration_s + length_s)
    else:
        legs.append(Leg(posture, place_m, duration_s=length_s))


def schedule(
    book: OrderBook,
    persons: Mapping[str, Person],
    starts: Mapping[str, tuple[FloatArray, float]],
    settle_s: float,
) -> dict[str, Timetable]:
    """Timetables by soldier. ``starts``: place (1, 3) and yaw; everyone first stands still for ``settle_s``."""
    clocks = {
        soldier: _Clock(persons[soldier], orders, starts[soldier][0])
        for soldier, orders in book.orders.items()
    }
    for clock in clocks.values():
        clock.wait(settle_s, "stand")
    _Run(book, clocks).run()
    return {soldier: _timetable(clock, starts[soldier][1]) for soldier, clock in clocks.items()}


def lasting(timetable: Timetable, duration_s: float) -> Timetable:
    """The same, standing (or lying) at the end until the exercise is over."""
    rest_s = duration_s - timetable.end_s
    if rest_s < _WORTH_WAITING_S:
        return timetable
    legs = list(timetable.itinerary.legs)
    gait = legs[-1].gait
    _hold(legs, gait if gait in _POSTURES else "stand", legs[-1].points_m[-1:], rest_s)
    itinerary = Itinerary(tuple(legs), timetable.itinerary.start_s, timetable.itinerary.start_yaw_rad)
    return Timetable(itinerary, timetable.doings, duration_s)


class _Run:
    """Pushes all clocks to their ends."""

    def __init__(self, book: OrderBook, clocks: dict[str, _Clock]) -> None:
        self._book = book
        self._clocks = clocks
        self._marks: dict[str, list[float]] = defaultdict(list)
        self._arrivals: dict[int, dict[int, float]] = defaultdict(dict)

    def run(self) -> None:
        """ScenarioFault if somebody waits for ever."""
        moved = True
        while moved:
            # Counted, so that in every round everyone goes on as far as they can.
            moved = sum(self._push(clock) for clock in self._clocks.values()) > 0
        waiting = [clock for clock in self._clocks.values() if not clock.done]
        if waiting:
            raise ScenarioFault(
                waiting[0].key, "waits for something that itself waits for this: nobody goes on"
            )

    def _push(self, clock: _Clock) -> bool:
        """As far as it goes; whether it went on at all."""
        before = clock.next
        while not clock.done and self._step(clock, clock.orders[clock.next]):
            clock.next += 1
        return clock.next > before

    def _step(self, clock: _Clock, order: Order) -> bool:
        """Obey one order; False if it has to wait for others."""
        match order:
            case Act(leg):
                clock.act(leg)
            case Stay(posture, for_s, until_s):
                clock.wait(max(clock.time_s + for_s, until_s), posture)
            case Mark(label):
                self._marks[label].append(clock.time_s)
            case Note(text, key):
                clock.key = key
                clock.notes.append((clock.time_s, text))
            case Await(label, after_s, posture):
                if len(self._marks[label]) < self._book.marks[label]:
                    return False
                clock.wait(max(self._marks[label]) + after_s, posture)
            case Meet(meeting, posture):
                return self._meet(clock, meeting, posture)
        return True

    def _meet(self, clock: _Clock, meeting: int, posture: Posture) -> bool:
        """Wait until all clocks of a meeting have come to it."""
        arrivals = self._arrivals[meeting]
        arrivals.setdefault(id(clock), clock.time_s)
        if len(arrivals) < len(self._book.meetings[meeting]):
            return False
        clock.wait(max(arrivals.values()), posture)
        return True


def _timetable(clock: _Clock, yaw_rad: float) -> Timetable:
    ends = [*(time for time, _ in clock.notes[1:]), clock.time_s]
    doings = tuple(
        Doing(start, end, text) for (start, text), end in zip(clock.notes, ends, strict=True) if end > start
    )
    return Timetable(Itinerary(tuple(clock.legs), 0.0, yaw_rad), doings, clock.time_s)
