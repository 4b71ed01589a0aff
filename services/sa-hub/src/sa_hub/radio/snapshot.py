"""The picture on demand: who comes late, was cut off or cannot open frames asks; one who knows more answers.

Nobody asks in an ordinary start, where everyone hears everyone's first frames. A hub is late when the first frame
that it hears of somebody is far from that one's first. It was cut off when nothing was heard for a while, and asks
while that lasts, too: the first frame to pass when the link comes back then wakes everybody. A hub that has never
heard anybody is silent.
"""

import random
from typing import Final

from bootprint.clock import NS_PER_S
from sa_hub.radio.control import MOST_UNREAD, Request
from sa_hub.radio.outbox import Sending

CUT_OFF_NS: Final = 45 * NS_PER_S
LATE_COUNTER: Final = 16
ASKS: Final = 4
FIRST_WAIT_S: Final = (0.2, 0.8)
PAUSE_S: Final = 3.5
CUT_OFF_PAUSES_S: Final = (10.0, 30.0)
CUT_OFF_SHARE: Final = 0.2
"""Of its rate a hub that is cut off spends no more on asking, if it can do so and still ask every 30 s."""
CUT_OFF_LONG_NS: Final = 600 * NS_PER_S
CUT_OFF_LONG_PAUSE_S: Final = 60.0
UNREAD_FRAMES: Final = 3
UNREAD_PAUSES_S: Final = (15.0, 120.0)
RELAY_WAIT_S: Final = (0.1, 0.4)
OTHERS_WAIT_S: Final = (1.5, 3.5)
ANSWER_PAUSE_NS: Final = 2 * NS_PER_S
_JITTER: Final = 0.2


class Asking:
    """When this hub asks on one net. ``ask_s``: for how long the link is at its full rate with one request.

    ``known``: how many soldiers it knows where they are, for the hub to set.
    """

    def __init__(self, seed: str, ask_s: float) -> None:
        least_s, most_s = CUT_OFF_PAUSES_S
        self._cut_off_pause_s = min(max(least_s, ask_s / CUT_OFF_SHARE), most_s)
        self.known = 0
        self._random = random.Random(seed)
        self._began_ns: int | None = None
        self._heard_ns: int | None = None
        self._asks = 0
        self._due_ns = 0
        self._senders: set[int] = set()
        self._unread: dict[int, int] = {}
        self._strangers: set[int] = set()
        self._unread_pause_s = UNREAD_PAUSES_S[0]
        self._unread_due_ns = 0

    # -- what happens -----------------------------------------------------------------------------------------

    def opened(self, sender: int, counter: int, now_ns: int) -> bool:
        """A frame was opened; whether it is the first one after we were cut off."""
        regained = self._silence_ns(now_ns) >= CUT_OFF_NS
        late = sender not in self._senders and counter >= LATE_COUNTER
        if regained or late:
            self._begin(now_ns)
        self._heard_ns = now_ns
        self._senders.add(sender)
        self._strangers.discard(sender)
        if self._unread.pop(sender, 0) >= UNREAD_FRAMES and not self._unread_now():
            self._unread_pause_s = UNREAD_PAUSES_S[0]
        return regained

    def unread(self, sender: int, *, epoch_known: bool) -> None:
        """A frame of somebody in the roster could not be opened; the first is enough where no epoch is known."""
        counted = self._unread.get(sender, 0) + 1
        if epoch_known:
            self._unread[sender] = counted
        else:
            self._strangers.add(sender)
            self._unread[sender] = max(counted, UNREAD_FRAMES)

    def heard_request(self, now_ns: int) -> None:
        """Somebody else asks: the answer will do for us, too."""
        if self._asks:
            self._due_ns = max(self._due_ns, now_ns + self._seconds(PAUSE_S))

    # -- what follows -----------------------------------------------------------------------------------------

    def due(self, now_ns: int) -> Sending | None:
        """The request to send now."""
        if self._began_ns is None:
            self._began_ns = now_ns
        unread = self._unread_now()
        if unread and self._asks == 0 and now_ns >= self._unread_due_ns:
            self._begin(now_ns)
        if now_ns < self._due_ns or not (self._asks or self._is_cut_off(now_ns)):
            return None
        return Sending(Request(self.known, None if self._strangers else unread), self._sent)

    def _sent(self, now_ns: int, _counter: int) -> None:
        self._asks = max(0, self._asks - 1)
        if self._is_cut_off(now_ns):
            self._due_ns = now_ns + self._seconds(self._pause_cut_off_s(now_ns))
        else:
            self._due_ns = now_ns + self._seconds(PAUSE_S)
        if self._asks == 0:
            self._unread_due_ns = now_ns + self._seconds(self._unread_pause_s)
            self._unread_pause_s = min(2.0 * self._unread_pause_s, UNREAD_PAUSES_S[1])

    def _pause_cut_off_s(self, now_ns: int) -> float:
        long = self._silence_ns(now_ns) >= CUT_OFF_LONG_NS
        return CUT_OFF_LONG_PAUSE_S if long else self._cut_off_pause_s

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        self._due_ns -= by_ns
        self._unread_due_ns -= by_ns
        self._heard_ns = None if self._heard_ns is None else self._heard_ns - by_ns
        self._began_ns = None if self._began_ns is None else self._began_ns - by_ns

    def _begin(self, now_ns: int) -> None:
        if self._asks:
            return
        self._asks = ASKS
        self._due_ns = now_ns + round(self._random.uniform(*FIRST_WAIT_S) * NS_PER_S)

    def _silence_ns(self, now_ns: int) -> int:
        """For how long nothing was heard, since we began if nothing ever was."""
        since_ns = self._began_ns if self._heard_ns is None else self._heard_ns
        return 0 if since_ns is None else now_ns - since_ns

    def _is_cut_off(self, now_ns: int) -> bool:
        return self._heard_ns is not None and self._silence_ns(now_ns) >= CUT_OFF_NS

    def _unread_now(self) -> tuple[int, ...]:
        numbers = (number for number, count in self._unread.items() if count >= UNREAD_FRAMES)
        return tuple(sorted(numbers))[:MOST_UNREAD]

    def _seconds(self, pause_s: float) -> int:
        return round(pause_s * self._random.uniform(1.0 - _JITTER, 1.0 + _JITTER) * NS_PER_S)


class Answering:
    """When this hub answers on one net: a relay soon, the others later and only if nobody else did."""

    def __init__(self, seed: str, *, relays: bool) -> None:
        self._random = random.Random(seed)
        self._wait_s = RELAY_WAIT_S if relays else OTHERS_WAIT_S
        self._due_ns: int | None = None
        self._answered_ns: int | None = None

    def asked(self, request: Request, known: int, now_ns: int) -> None:
        """Somebody asks, while we know where so many soldiers are; we answer if those are more."""
        just_now = self._answered_ns is not None and now_ns - self._answered_ns < ANSWER_PAUSE_NS
        if known > request.known and not just_now and self._due_ns is None:
            self._due_ns = now_ns + round(self._random.uniform(*self._wait_s) * NS_PER_S)

    def heard_answer(self, now_ns: int) -> None:
        """Somebody else has told of others."""
        self._due_ns = None
        self._answered_ns = now_ns

    def due(self, now_ns: int) -> bool:
        """Whether to tell of everybody now; true once."""
        if self._due_ns is None or now_ns < self._due_ns:
            return False
        self.heard_answer(now_ns)
        return True

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        self._due_ns = None
        self._answered_ns = None
