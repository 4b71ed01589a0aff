"""What hubs tell each other about the traffic itself: what was heard, what is wanted, parts of what is too long."""

from dataclasses import dataclass
from typing import Final

COUNTED_BITS: Final = 8
"""Low bits of a frame's counter by which it is acknowledged; who sent it keeps far fewer frames in mind."""
MOST_ACKNOWLEDGED: Final = 8
MOST_ASKED: Final = 7
MOST_UNREAD: Final = 14
MOST_FRAGMENTS: Final = 16


@dataclass(frozen=True, slots=True)
class Asked:
    """Who is to acknowledge a frame; everybody if nobody is named."""

    numbers: tuple[int, ...] = ()

    def includes(self, number: int) -> bool:
        """Whether this one is meant."""
        return not self.numbers or number in self.numbers


@dataclass(frozen=True, slots=True)
class Acknowledgement:
    """Frames that the sender of this one has heard: (their sender, low 8 bits of their counter)."""

    heard: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Request:
    """Somebody wants the picture, and perhaps the counters of those whose frames cannot be opened.

    ``known``: how many soldiers the asker knows where they are now; who knows more may answer.
    ``unread``: who is to send full headers, None for everybody.
    """

    known: int
    unread: tuple[int, ...] | None = ()


@dataclass(frozen=True, slots=True)
class Fragment:
    """Part ``index`` of ``last`` + 1 of a payload too long for a frame; ``message`` numbers the payloads."""

    message: int
    index: int
    last: int
    data: bytes


Control = Acknowledgement | Request | Fragment
