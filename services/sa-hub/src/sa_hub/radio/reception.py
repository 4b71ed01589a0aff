"""What comes of reports that are heard on a net: resolved here, and fed back to their senders."""

from sa_hub.radio.content import Content, Feedback, Reports, Update
from sa_hub.radio.grid import Grid
from sa_hub.radio.hearing import Hearing
from sa_hub.radio.lone_feedback import LoneFeedback
from sa_hub.radio.references import References
from sa_hub.radio.seal import Opened


class Reception:
    """One net's. ``seed`` and ``frame_s`` are those of `LoneFeedback`."""

    def __init__(self, grid: Grid, seed: str, frame_s: float) -> None:
        self._references = References(grid)
        self._hearing = Hearing()
        self._lone = LoneFeedback(seed, frame_s)
        self._unresolved_told = 0

    @property
    def unresolved(self) -> int:
        """Soldiers in updates that said nothing to us, since we had missed too much."""
        return self._references.unresolved

    @property
    def urged(self) -> bool:
        """Whether updates could not be resolved of which no sender was told yet."""
        return self.unresolved > self._unresolved_told

    def heard(self, opened: Opened, content: Content, now_ns: int) -> Reports | None:
        """A frame was opened: an update as the reports that it means to us, if it is one."""
        sender, epoch, counter = opened.sender, opened.epoch, opened.counter
        self._references.heard(sender, epoch, counter)
        if isinstance(content, Reports):
            self._references.told(sender, epoch, counter, content, now_ns)
            others = [report.number for report in content.reports if report.number != sender]
            if others:
                self._hearing.heard_telling(sender, epoch, counter, others)
        if not isinstance(content, Update):
            return None
        self._hearing.heard_telling(sender, epoch, counter, (entry.number for entry in content.entries))
        return Reports(self._references.resolve(sender, epoch, counter, content, now_ns))

    def feedback(self, telling_of: int, now_ns: int, *, cheap: bool) -> Feedback | None:
        """What a report that goes now should take along; we tell of so many soldiers ourselves."""
        return self._hearing.due(self._references.in_order, telling_of, now_ns, cheap=cheap)

    def lone_feedback(self, telling_of: int, now_ns: int) -> Feedback | None:
        """What is to go in a frame of its own now: not what is only kept fresh."""
        if not self._lone.looks(now_ns):
            return None
        feedback = self.feedback(telling_of, now_ns, cheap=False)
        is_due = self._lone.is_due(now_ns, waiting=feedback is not None, telling=telling_of > 0)
        return feedback if is_due else None

    def fed_back(self, feedback: Feedback, now_ns: int, *, alone: bool) -> None:
        """This was on the air."""
        self._hearing.sent(feedback, now_ns)
        self._lone.sent(now_ns, alone=alone)
        self._unresolved_told = self.unresolved

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much: what was told is of another time."""
        self._references.clear()
        self._hearing.set_back(by_ns)
        self._lone.set_back(by_ns)
