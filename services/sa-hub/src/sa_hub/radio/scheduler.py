"""When to tell whom, and how: the error that receivers are believed to have, bought down at the price of bits.

Every receiver moves a soldier on from the last report on the air, by the rule of `bootprint.prediction`. The
scheduler keeps what receivers have (`listeners`), so it knows how far off they show everyone; what telling would be
worth is weighed against bits (`offers`), whose price follows the budget (`pacing`). What was heard on a net is
known there, so a relay never repeats a net's own news to it.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from sa_hub.radio import quantise as q
from sa_hub.radio.content import Feedback, Report, Reports, Update
from sa_hub.radio.grid import Grid
from sa_hub.radio.ground import FloatArray
from sa_hub.radio.history import History
from sa_hub.radio.listeners import LOSSLESS, Listeners
from sa_hub.radio.offers import MOTION_BITS, RESOLUTIONS, Terms, Wares, best_offer, least_misses, most_surplus
from sa_hub.radio.outlook import Outlook
from sa_hub.radio.pacing import WALKERS, Pacing, usual_level
from sa_hub.radio.persistence import STANDING_M_S, Persistence, Standard
from sa_hub.radio.picture import BoolArray, Spoken
from sa_hub.radio.references import resolved
from sa_hub.radio.refreshing import Refreshing
from sa_hub.radio.relevance import Relevance
from sa_hub.radio.room import Room
from sa_hub.radio.telling import FRESH_NS, Telling
from sa_hub.radio.wares import Candidates, candidates_of, samples_of
from sa_hub.radio.worth import CURVE, worth

ENOUGH: Final = 0.12
"""Of the threshold: an error below it is worth no bits."""
COARSE_CELL: Final = 0.5
"""Of the threshold: cells are no larger."""
CHEAP: Final = (math.exp(-4.0), math.exp(-5.0))
"""Prices of a bit below which cells are a half, and a quarter, of that."""
CLOCK_SET_BACK_NS: Final = 60 * NS_PER_S
_CHANGE_WORTH: Final = 3.0
_TURN_WORTH: Final = 0.5
_AGE_BITS: Final = 8.0
_CHEAP_MISSES: Final = 3
"""Where bits are cheap, what is told is proof against surprises: more may be missed, all goes in full often."""
_URGED_WORTH: Final = 50.0
SURE_MISSES: Final = 2
"""What updates allow for in any case where frames are lost: feedback is never of the last one."""
UNSURE: Final = (0.003, 0.001)
"""Who says what it hears refuses an update with no more than this probability, the second where bits are cheap."""
LOSSY_SHARE: Final = 0.15
"""Of the price of an entry's bits where frames are lost: who is told in every frame is never long wrong, and his
place, told against what is fresh, takes few bits. Counting only what is wrong now would leave him out."""
PERIOD_NS: Final = 200_000_000
LONG_PERIOD_NS: Final = 400_000_000
"""Times between decisions, the longer one after nothing was near to being worth its bits."""
_FAR_FROM_PAID: Final = 0.5
_LONGEST_ELAPSED_S: Final = 10.0
LONGEST_AHEAD_S: Final = 8.0
"""Reports are judged by the time until the next one of those who walk, up to this."""


@dataclass(frozen=True, slots=True)
class Policy:
    """The error to stay below where the budget allows it, the longest wanted silence, and the loss assumed."""

    threshold_m: float = 5.0
    heartbeat_s: float = 30.0
    loss: float = 0.0


class Scheduler:
    """What one net is told by this hub."""

    def __init__(self, policy: Policy, own: int, grid: Grid, relevance: Relevance | None = None) -> None:
        self.relevance = relevance or Relevance()
        self.listeners = Listeners(policy.loss, seed=own)
        self._policy = policy
        self._own = own
        self._grid = grid
        self._history = History(grid)
        self._pacing = Pacing()
        self._persistence = Persistence()
        self._slots: dict[int, int] = {}
        self._heard_ns: dict[int, int] = {}
        self._overheard: dict[int, Report] = {}
        self._refreshing = Refreshing()
        self._base_ns: int | None = None
        self._planned_ns: int | None = None
        self._pause_ns: int | None = None
        self._latest: Candidates | None = None

    # -- what was on the air ----------------------------------------------------------------------------------

    def told(self, report: Report) -> None:
        """Somebody else's report was on the air: the net has it, and we need not tell it."""
        newest_ns = self._heard_ns.get(report.number)
        if newest_ns is None or report.time_ns >= newest_ns:
            self._heard_ns[report.number] = report.time_ns
            self._overheard[report.number] = report

    def told_what_was_heard(self, listener: int, feedback: Feedback, now_ns: int) -> None:
        """A hub tells which of our frames it heard."""
        self._note_overheard()  # before, for it says nothing of what a new listener heard of others
        self.listeners.told(listener, feedback, now_ns)

    def _note_overheard(self) -> None:
        """Listeners have heard it, too. Asked for seldom: who does not relay tells of nobody but himself."""
        if self._overheard:
            self.listeners.overheard(self._spoken(tuple(self._overheard.values()), None, ours=False))
            self._overheard.clear()

    def sent(self, counter: int, content: object, now_ns: int) -> None:
        """Our frame with this counter was on the air; ``content`` as a receiver decodes it."""
        if counter == 0:
            self._history.epoch_begins()
        reports, misses = self._meant(content, now_ns)
        spoken = self._spoken(reports, misses, ours=True)
        self.listeners.spoke(counter, spoken)
        self._history.spoke(spoken, reports)
        if misses is None:
            self._refreshing.told_in_full(reports, now_ns)

    def _meant(self, content: object, now_ns: int) -> tuple[tuple[Report, ...], int | None]:
        """The reports of a frame as receivers have them, and what it allows to be missed."""
        match content:
            case Reports():
                return content.reports, None
            case Update():
                tick = q.tick_of(now_ns)
                told = self._history.told
                pairs = [(told[self._slot(entry.number)], entry) for entry in content.entries]
                meant = (resolved(self._grid, before, content, entry, tick) for before, entry in pairs)
                return tuple(report for report in meant if report is not None), content.misses
            case _:
                return (), None

    def forget(self, numbers: Iterable[int]) -> None:
        """Take these as never told, by us or by others, so that they are reported anew and in full."""
        self._note_overheard()
        for number in numbers:
            self._heard_ns.pop(number, None)
            self.listeners.forget(self._slot(number))
            self._history.forget(self._slot(number))

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much: nobody knows the new time yet, so all is told anew and in full."""
        self.begin_again()
        self._heard_ns = {number: time_ns - by_ns for number, time_ns in self._heard_ns.items()}
        self.relevance.set_back(by_ns)
        self._planned_ns = None
        self._latest = None
        self._base_ns = None

    def begin_again(self) -> None:
        """Nothing that was told before counts: all is told anew and in full."""
        self._overheard.clear()
        self.listeners.clear()
        self._history.clear()
        self._refreshing.clear()

    def _slot(self, number: int) -> int:
        """Where a soldier's values stand in all arrays."""
        slot = self._slots.get(number)
        if slot is None:
            slot = self._slots[number] = len(self._slots)
            if slot % 16 == 0:
                for part in (self.listeners, self._history, self._persistence):
                    part.widen(slot + 16)
        return slot

    def _slots_of(self, reports: Sequence[Report]) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
        return np.array([self._slot(each.number) for each in reports], dtype=np.int64)

    def _spoken(self, reports: Sequence[Report], misses: int | None, *, ours: bool) -> Spoken:
        if self._base_ns is None and reports:
            self._base_ns = reports[0].time_ns
        samples = samples_of(reports, self._base_ns or 0)
        time_s, latitude, longitude, east, north = samples.T
        slots = self._slots_of(reports)
        return Spoken(slots, time_s, latitude, longitude, east, north, misses, ours)

    # -- what to tell -----------------------------------------------------------------------------------------

    def is_due(self, now_ns: int) -> bool:
        """Whether it is time to decide again."""
        return self._planned_ns is None or now_ns - self._planned_ns >= (self._pause_ns or PERIOD_NS)

    def pass_time(self, room: Room, soldiers: int, now_ns: int) -> None:
        """It is decided now: the price of bits follows the budget and how many soldiers there are to tell of."""
        elapsed_s = _LONGEST_ELAPSED_S
        if self._planned_ns is not None:
            elapsed_s = min((now_ns - self._planned_ns) / NS_PER_S, _LONGEST_ELAPSED_S)
        self._planned_ns, self._pause_ns = now_ns, None
        self.listeners.pass_time(now_ns)
        usual = usual_level(room, soldiers, ENOUGH * self._policy.threshold_m)
        self._pacing.passed(elapsed_s, room.free_bits / room.depth_bits, usual)

    def plan(
        self, candidates: Sequence[Report], room: Room, now_ns: int, *, urged: bool = False
    ) -> Reports | Update | None:
        """The frame to send now, if one is worth it.

        ``urged``: updates could not be resolved here; our own report is worth more, since it takes feedback along.
        """
        news = [each for each in candidates if self._is_news(each, now_ns)]
        if not news:
            self._latest = None
            return None
        if any(each.number in self._overheard for each in news):
            self._note_overheard()
        telling = self._telling(news, room, now_ns)
        value, terms = self._worth(telling), self._terms(room)
        value += [urged * _URGED_WORTH * (number == self._own) for number in telling.who.numbers]
        refresh = self._refresh(telling, room)
        surplus = most_surplus(value.mean(axis=0) + refresh, terms)
        if self._pause_ns is None:  # by the first look: after a frame nothing is worth another, for a moment
            self._pause_ns = LONG_PERIOD_NS if surplus < _FAR_FROM_PAID * terms.frame_price else PERIOD_NS
        if surplus <= terms.frame_price:
            return None
        offer = best_offer(self._wares(telling, value, refresh), terms)
        if (
            offer is None
            or terms.price * offer.bits + terms.frame_price > self._pacing.price * room.free_bits
        ):
            return None
        return telling.in_full(offer) if offer.misses is None else telling.update(offer, offer.misses)

    def expected_errors_m(self) -> dict[int, float]:
        """How far off receivers show each soldier, as last decided: the mean over them, infinite if unknown."""
        who = self._latest
        if who is None:
            return {}
        pictures = self.listeners.pictures
        east, north = pictures.off_m(who.slots, who.latitude, who.longitude, who.now_s)
        errors_m = np.where(pictures.known[:, who.slots], np.hypot(east, north), math.inf).mean(axis=0)
        return dict(zip(who.numbers, errors_m.tolist(), strict=True))

    def newest_ns(self) -> dict[int, int]:
        """The time of the newest report that the net has of each soldier, ours or another's."""
        newest = dict(self._heard_ns)
        for number, slot in self._slots.items():
            told = self._history.told.get(slot)
            if told is not None:
                newest[number] = max(told.time_ns, newest.get(number, told.time_ns))
        return newest

    def known_by_listeners(self) -> Iterator[tuple[int, int, int]]:
        """(listener, soldier, time of the report) of what hubs that give feedback are sure to know."""
        self._note_overheard()
        numbers = {slot: number for number, slot in self._slots.items()}
        for listener, slot, time_s in self.listeners.certain():
            yield listener, numbers[slot], (self._base_ns or 0) + round(time_s * NS_PER_S)

    @property
    def telling_of(self) -> int:
        """How many soldiers this net is told of."""
        return 0 if self._latest is None else len(self._latest.reports)

    def _is_news(self, report: Report, now_ns: int) -> bool:
        """What the net told itself is not to be told to it, nor an old report of ourselves.

        By what a frame says of its sender receivers judge the sender's clock, so that must be of its moment.
        """
        if report.number == self._own and now_ns - report.time_ns > FRESH_NS:
            return False
        heard_ns = self._heard_ns.get(report.number)
        if heard_ns is None or report.time_ns > heard_ns:
            return True
        if report.number != self._own or heard_ns - report.time_ns <= CLOCK_SET_BACK_NS:
            return False
        # What was said of ourselves and is much newer than what we know now is of a clock since set right.
        self.forget([report.number])
        return True

    def _telling(self, reports: Sequence[Report], room: Room, now_ns: int) -> Telling:
        """Where these are now, and what velocity is worth telling of them."""
        if self._base_ns is None:
            self._base_ns = now_ns
        slots, samples = self._slots_of(reports), samples_of(reports, self._base_ns)
        standard = self._standard(room, len(reports))
        self._persistence.see(slots, samples, standard)
        lasting, now_s = self._persistence.lasting(slots), (now_ns - self._base_ns) / NS_PER_S
        who = candidates_of(reports, slots, samples, lasting, now_s)
        self._latest = who
        velocity = who.velocity * self._persistence.shares(slots, standard)[:, None]
        velocity = np.where(np.hypot(*velocity.T)[:, None] < STANDING_M_S, 0.0, velocity)
        if self.listeners.loss >= LOSSLESS:
            velocity = self._history.as_told(slots, velocity)
        faces: BoolArray = (velocity == 0.0).all(axis=1) & self.is_cheap
        outlook = Outlook(who, velocity, standard.ahead_s)
        return Telling(outlook, faces, self._resolution(), now_ns, self._history, self._grid)

    def _standard(self, room: Room, soldiers: int) -> Standard:
        """What a report costs here, and the error at which it is worth that."""
        bits = room.report_bits(soldiers)
        near_m = ENOUGH * self._policy.threshold_m + (self._pacing.price * bits) ** (1.0 / CURVE)
        usual_s = room.interval_s(max(1, round(WALKERS * soldiers)))
        return Standard(near_m, min(usual_s, LONGEST_AHEAD_S), bits, MOTION_BITS * room.bits_per_bit)

    @property
    def is_cheap(self) -> bool:
        """Whether bits are."""
        return self._pacing.price < CHEAP[0]

    def _resolution(self) -> int:
        """Finer cells when bits are cheap."""
        coarse = q.resolution_for(COARSE_CELL * self._policy.threshold_m)
        finer = sum(self._pacing.price < price for price in CHEAP)
        return min(max(coarse - finer, RESOLUTIONS[0]), RESOLUTIONS[-1])

    def _worth(self, telling: Telling) -> FloatArray:
        """(rows, n) of telling each soldier to each receiver."""
        policy, who = self._policy, telling.who
        enough_m = ENOUGH * policy.threshold_m
        value = worth(telling.outlook, self.listeners.pictures, enough_m, policy.heartbeat_s)
        weights = self.relevance.weights(who.numbers, who.latitude, who.longitude, telling.now_ns)
        value = value + _CHANGE_WORTH * telling.urgent() + _TURN_WORTH * telling.turned()
        weighted: FloatArray = weights * value
        return weighted

    def _refresh(self, telling: Telling, room: Room) -> FloatArray:
        """(n,) the worth of telling in full again."""
        return self._refreshing.worth(telling.who, telling.now_ns, self.listeners, room, cheap=self.is_cheap)

    def _wares(self, telling: Telling, value: FloatArray, refresh: FloatArray) -> Wares:
        who = telling.who
        old = who.now_s - who.time_s > FRESH_NS / NS_PER_S
        velocity_bits = np.where(telling.velocity.any(axis=1), 1.0 + MOTION_BITS, 1.0)
        off_cells = self._history.cells_off(who.slots, *telling.aimed(), who.now_s)
        return Wares(
            worth=value,
            behind=self.listeners.pictures.behind(who.slots),
            needs=self.listeners.needs(who.slots, UNSURE[self.is_cheap]),
            bits=velocity_bits + _AGE_BITS * old,
            velocity_bits=velocity_bits,
            steady=self._history.steady(who.slots, telling.velocity),
            changes_bits=telling.changes_bits(),
            off_cells=np.where(telling.out_of_reach()[:, None], np.inf, off_cells),
            refresh=refresh,
            span_cells=who.span_m() / q.cell_m(telling.resolution),
            span=max(who.numbers) - min(who.numbers),
            resolution=telling.resolution,
        )

    def _terms(self, room: Room) -> Terms:
        loss = self.listeners.loss
        certain = (SURE_MISSES if loss >= LOSSLESS else 0) if self.listeners.all_tell else least_misses(loss)
        return Terms(
            price=self._pacing.price * room.bits_per_bit,
            frame_price=self._pacing.price * room.frame_bits,
            room_bits=room.payload_bits,
            delivered=1.0 if loss < LOSSLESS else 1.0 - loss,
            entry_share=1.0 if loss < LOSSLESS else LOSSY_SHARE,
            least_misses=max(certain, _CHEAP_MISSES) if self.is_cheap else certain,
        )
