"""What a soldier does, step by step, before anybody knows how long it takes.

Plans are made of orders: acts of motion, and the places where one waits for a time, for a task, or for each other.
`schedule` turns them into itineraries once the persons, and so the durations, are known.
"""

from collections import Counter
from dataclasses import dataclass, field

from proving_ground.people import Leg
from proving_ground.scenario.schema.tasks import Posture


@dataclass(frozen=True)
class Act:
    """Move as this leg says."""

    leg: Leg


@dataclass(frozen=True)
class Stay:
    """Keep a posture for a while, and at least until a time."""

    posture: Posture
    for_s: float = 0.0
    until_s: float = 0.0


@dataclass(frozen=True)
class Meet:
    """Wait until everybody of this meeting is there."""

    meeting: int
    posture: Posture = "stand"


@dataclass(frozen=True)
class Await:
    """Wait until everybody who has to has made this mark."""

    label: str
    after_s: float = 0.0
    posture: Posture = "stand"


@dataclass(frozen=True)
class Mark:
    """Tell the others that this is done."""

    label: str


@dataclass(frozen=True)
class Note:
    """From here on the soldier does this: a line of the timeline, and the key of the task."""

    text: str
    key: str


Order = Act | Stay | Meet | Await | Mark | Note


@dataclass
class OrderBook:
    """Everybody's orders, who meets whom, and how often each mark is made."""

    orders: dict[str, list[Order]] = field(default_factory=dict)
    meetings: list[frozenset[str]] = field(default_factory=list)
    marks: Counter[str] = field(default_factory=Counter)
    count: int = 0

    def meeting(self, soldiers: list[str]) -> int:
        """Arrange a new meeting; its number."""
        self.meetings.append(frozenset(soldiers))
        return len(self.meetings) - 1

    def give(self, soldier: str, order: Order) -> None:
        """One more order for a soldier."""
        self.count += 1
        if isinstance(order, Mark):
            self.marks[order.label] += 1
        self.orders.setdefault(soldier, []).append(order)
