"""What a hub owes the others on a net and is owed by them: notices, acknowledgements, requests, answers.

Everything here is about one net. What comes in passes through `heard`, what is to go out comes from `due`, the most
urgent first; the net pays for it and seals it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

from bootprint.clock import NS_PER_S
from sa_hub.radio.answers import Answers
from sa_hub.radio.content import Feedback, Notice, ObservationNotice, Reports, Update
from sa_hub.radio.control import Acknowledgement, Fragment, Request
from sa_hub.radio.errors import FrameError
from sa_hub.radio.fragments import Collector
from sa_hub.radio.frame import Frame
from sa_hub.radio.outbox import Outbox, Sending, key_of
from sa_hub.radio.seal import FullHeaders, Opened
from sa_hub.radio.snapshot import Answering, Asking

LATELY_NS: Final = 120 * NS_PER_S
"""Who was heard within this time is expected to acknowledge."""

Told = Reports | Notice


@dataclass(frozen=True, slots=True)
class Station:
    """Who we are on a net: our number in the roster, whether we relay, how long a request takes at our rate."""

    net: str
    number: int
    relays: bool
    ask_s: float


class Correspondence:
    """``known``: how many soldiers we know where they are, for the hub to set. ``regained``: contact came back.

    ``look``: in which of the hub's looks at what has come frames are heard now; what is heard after the look
    ``kept_until`` is not yet to be acknowledged (None: everything is). Both are for the hub to set.
    """

    def __init__(
        self, station: Station, full_headers: FullHeaders, decode: Callable[[int, bytes, int], Frame]
    ) -> None:
        seed = f"{station.net}|{station.number}"
        self.outbox = Outbox(seed)
        self.answering = Answering(seed, relays=station.relays)
        self.known = 0
        self.look = 0
        self.kept_until: int | None = None
        self.regained = False
        self._station = station
        self._full_headers = full_headers
        self._decode = decode
        self._answers = Answers(seed)
        self._asking = Asking(seed, station.ask_s)
        self._collector = Collector()
        self._members: dict[int, int] = {}

    # -- in ---------------------------------------------------------------------------------------------------

    def heard(self, opened: Opened, frame: Frame, now_ns: int) -> Told | None:
        """A good frame: what of it is for the hub, if anything (an update is for who can resolve it)."""
        self._members[opened.sender] = now_ns
        self.regained |= self._asking.opened(opened.sender, opened.counter, now_ns)
        match frame.content:
            case Acknowledgement():
                self._acknowledged(opened.sender, frame.content)
                return None
            case Request():
                self._asked(frame.content, now_ns)
                return None
            case Fragment():
                return self._collected(opened, frame, frame.content, now_ns)
            case Reports():
                self._heard_reports(opened.sender, frame.content, now_ns)
                return frame.content
            case Update() | Feedback():
                return None
            case _:
                self._owe(opened, frame, key_of(frame.content), now_ns)
                return frame.content

    def unread(self, sender: int, *, epoch_known: bool) -> None:
        """A frame with a short header of somebody in the roster could not be opened."""
        self._asking.unread(sender, epoch_known=epoch_known)

    def _owe(self, opened: Opened, frame: Frame, what: object, now_ns: int) -> None:
        if frame.asked is not None and frame.asked.includes(self._station.number):
            by_name = bool(frame.asked.numbers)
            self._answers.owe(opened.sender, what, opened.counter, now_ns, by_name=by_name, look=self.look)

    def _acknowledged(self, by: int, content: Acknowledgement) -> None:
        for sender, counted in content.heard:
            if sender == self._station.number:
                self.outbox.acknowledged(by, counted)

    def _asked(self, request: Request, now_ns: int) -> None:
        self._asking.heard_request(now_ns)
        self.answering.asked(request, self.known, now_ns)
        if request.unread is None or self._station.number in request.unread:
            self._full_headers.asked(now_ns)

    def _heard_reports(self, sender: int, content: Reports, now_ns: int) -> None:
        """A frame that tells of a good part of the others is as good as an answer of ours."""
        others = sum(report.number != sender for report in content.reports)
        if others and 3 * others >= self.known:
            self.answering.heard_answer(now_ns)

    def _collected(self, opened: Opened, frame: Frame, part: Fragment, now_ns: int) -> Told | None:
        owe = partial(self._owe, opened, frame, (part.message, part.index))
        payload = self._collector.add((opened.sender, opened.epoch), part, now_ns, owe)
        if payload is None:
            return None
        content = self._decode(opened.sender, payload, now_ns).content
        if not isinstance(content, ObservationNotice):
            raise FrameError("fragments", "only observations come in parts")
        return content

    # -- out --------------------------------------------------------------------------------------------------

    def due(self, now_ns: int) -> Sending | None:
        """What to send next, if anything: alerts, acknowledgements, requests, then the other notices."""
        members = [number for number, at_ns in self._members.items() if now_ns - at_ns < LATELY_NS]
        self._asking.known = self.known
        return (
            self.outbox.due(now_ns, members, alerts_only=True)
            or self._answers.due(now_ns, self.kept_until)
            or self._asking.due(now_ns)
            or self.outbox.due(now_ns, members)
        )

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        for part in (self.outbox, self._answers, self._asking, self.answering, self._collector):
            part.set_back(by_ns)
        self._members = {number: at_ns - by_ns for number, at_ns in self._members.items()}
