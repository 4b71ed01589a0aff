"""What is fuzzed: a parser as a function of bytes, with sound examples of what it reads.

Feeding tells in a word what became of the bytes. What a parser refuses as it should is such a word as well; any
other exception is a finding.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

Feed = Callable[[bytes], str]


@dataclass(frozen=True)
class Target:
    """A parser: ``open_in`` gives what feeds it, with a folder for files; ``seeds`` are sound inputs.

    ``taken``: a pattern that the whole answer to each of these has.
    """

    name: str
    seeds: Callable[[Path], list[bytes]]
    open_in: Callable[[Path], Feed]
    taken: str


def refusing(feed: Feed, *refusals: type[Exception]) -> Feed:
    """The same, where refusals that are meant to be are words, too: their text up to the first value."""

    def checked(data: bytes) -> str:
        try:
            return feed(data)
        except refusals as error:
            return f"refused: {_kind_of(str(error))}"

    return checked


def _kind_of(text: str) -> str:
    return "".join(letter for letter in text.rsplit(": ", 1)[-1] if letter.isalpha() or letter == " ")[:24]
