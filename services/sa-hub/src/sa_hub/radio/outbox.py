"""Notices waiting for the air: alerts before observations before status, repeated, since nobody acknowledges."""

from dataclasses import dataclass
from typing import Final

from sa_hub.radio.content import AlertNotice, Notice, ObservationNotice, StatusNotice
from sa_hub.radio.quantise import tick_of

_S: Final = 1_000_000_000
REPEATS: Final[dict[type, int]] = {AlertNotice: 3, ObservationNotice: 2, StatusNotice: 1}
FIRST_PAUSE_NS: Final = 2 * _S
CAPACITY: Final = 32

Key = tuple[str, int, int, str]


def key_of(notice: Notice) -> Key:
    """What makes two notices the same event: text may be cut and hops differ on the way."""
    kind = notice.kind if isinstance(notice, AlertNotice) else ""
    return type(notice).__name__, notice.number, tick_of(notice.time_ns), kind


@dataclass(slots=True)
class _Waiting:
    notice: Notice
    left: int
    due_ns: int
    pause_ns: int = FIRST_PAUSE_NS


class Outbox:
    """Notices of one net; a soldier's next status supersedes the one before. ``dropped``: what found no room."""

    def __init__(self) -> None:
        self._waiting: list[_Waiting] = []
        self.dropped = 0

    def post(self, notice: Notice, now_ns: int) -> None:
        """Queue a notice; when all is full of what is no less urgent, the oldest of the least urgent goes."""
        if isinstance(notice, StatusNotice):
            self._supersede(notice.number)
        self._waiting.append(_Waiting(notice, REPEATS[type(notice)], now_ns))
        self._waiting.sort(key=lambda waiting: _rank(waiting.notice))
        if len(self._waiting) > CAPACITY:
            last = _rank(self._waiting[-1].notice)
            self._waiting.remove(next(each for each in self._waiting if _rank(each.notice) == last))
            self.dropped += 1

    def due(self, now_ns: int) -> Notice | None:
        """The most urgent notice whose time has come."""
        return next((waiting.notice for waiting in self._waiting if waiting.due_ns <= now_ns), None)

    def sent(self, notice: Notice, now_ns: int) -> None:
        """It was on the air once: wait twice as long before each further time."""
        for waiting in self._waiting:
            if waiting.notice is notice:
                waiting.left -= 1
                waiting.due_ns = now_ns + waiting.pause_ns
                waiting.pause_ns *= 2
        self._waiting = [waiting for waiting in self._waiting if waiting.left > 0]

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        for waiting in self._waiting:
            waiting.due_ns -= by_ns

    def _supersede(self, number: int) -> None:
        self._waiting = [
            waiting
            for waiting in self._waiting
            if not (isinstance(waiting.notice, StatusNotice) and waiting.notice.number == number)
        ]


def _rank(notice: Notice) -> int:
    return (AlertNotice, ObservationNotice, StatusNotice).index(type(notice))
