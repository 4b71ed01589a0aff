"""Fuzz of every parser (`fuzz_streams`, `fuzz_files`): mutated sound examples, and what was found before.

``python -m support.parser_fuzz --minutes 10`` looks for new findings and keeps each in the corpus,
``tests/data/fuzz/PARSER/``, one input for each defect; the tests feed all of the corpus again, and some mutations
by a fixed seed. Inputs that lead to an answer not seen before are mutated further, so the search gets deeper than
one step from the examples.
"""

import hashlib
import random
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Final

import typer

from bootprint import logs
from support.fuzz_files import file_targets
from support.fuzz_streams import stream_targets
from support.fuzz_target import Feed, Target

CORPUS: Final = Path(__file__).parents[1] / "data" / "fuzz"
_MOST_BYTES: Final = 20_000
_WORDS: Final = (
    *b"nan inf -1 1e999 0 18446744073709551616 -0.0 true null".split(),
    *b", ; \" ' \\ = # [ ] { } [[ < & &#0; ../ %00".split(),
    *(b"9" * 40, b"\x00", b"\xff\xfe", b"\xc3", "é☃".encode(), b"\n", b"\r\n", b"<!ENTITY a 'b'>"),
)
Mutation = Callable[[random.Random, bytearray, list[bytes]], None]


def _flip(rng: random.Random, data: bytearray, _others: list[bytes]) -> None:
    if data:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _put_word(rng: random.Random, data: bytearray, _others: list[bytes]) -> None:
    at = rng.randrange(len(data) + 1)
    data[at : at + rng.choice((0, 1, 4))] = rng.choice(_WORDS)


def _put_random(rng: random.Random, data: bytearray, _others: list[bytes]) -> None:
    at = rng.randrange(len(data) + 1)
    data[at:at] = rng.randbytes(rng.randrange(1, 9))


def _cut_out(rng: random.Random, data: bytearray, _others: list[bytes]) -> None:
    begin, end = _piece(rng, data)
    del data[begin:end]


def _repeat(rng: random.Random, data: bytearray, _others: list[bytes]) -> None:
    begin, end = _piece(rng, data)
    data[end:end] = data[begin:end] * rng.choice((1, 1, 2, 30))


def _splice(rng: random.Random, data: bytearray, others: list[bytes]) -> None:
    other = rng.choice(others)
    data[rng.randrange(len(data) + 1) :] = other[rng.randrange(len(other) + 1) :]


_MUTATIONS: Final[tuple[Mutation, ...]] = (
    _flip,
    _flip,
    _put_word,
    _put_word,
    _put_random,
    _cut_out,
    _repeat,
    _splice,
)


def _piece(rng: random.Random, data: bytearray) -> tuple[int, int]:
    begin = rng.randrange(len(data) + 1)
    return begin, min(len(data), begin + int(rng.expovariate(1 / 20)))


def mutations(rng: random.Random, pool: list[bytes]) -> Iterator[bytes]:
    """Without end: something of the pool, changed in one to four places."""
    while True:
        data = bytearray(rng.choice(pool))
        for _ in range(rng.choice((1, 1, 1, 2, 4))):
            rng.choice(_MUTATIONS)(rng, data, pool)
        yield bytes(data[:_MOST_BYTES])


class FindingError(Exception):
    """A parser did what it should not; ``data`` is what it was fed, ``defect`` the exception's type and place."""

    def __init__(self, target: str, data: bytes, cause: Exception) -> None:
        super().__init__(f"{target} was fed {data[:60]!r}… ({len(data)} bytes)")
        self.data = data
        place = traceback.extract_tb(cause.__traceback__)[-1]
        self.defect = type(cause), place.filename, place.lineno


class Fuzz:
    """One parser under fuzz: the examples, the corpus, and what came of interesting ones."""

    def __init__(self, target: Target, folder: Path, seed: int) -> None:
        self.name = target.name
        self._feed: Feed = target.open_in(folder)
        self.seeds = target.seeds(folder)
        self.pool = [*self.seeds, *corpus(target.name)]
        self._rng = random.Random(seed)
        self.answers: dict[str, int] = {}

    def feed(self, data: bytes) -> str:
        """What became of it; FindingError if that is nothing the parser may do."""
        try:
            return self._feed(data)
        except Exception as error:
            raise FindingError(self.name, data, error) from error

    def feed_known(self) -> list[str]:
        """The examples and the corpus, as they are."""
        return [self.feed(data) for data in self.pool]

    def run(self, goes_on: Callable[[int], bool]) -> None:
        """Mutations, as long as ``goes_on`` says so of their count."""
        for count, data in enumerate(mutations(self._rng, self.pool)):
            if not goes_on(count):
                return
            answer = self.feed(data)
            if answer not in self.answers:
                self.pool.append(data)
            self.answers[answer] = self.answers.get(answer, 0) + 1

    def new_findings(self, goes_on: Callable[[], bool]) -> Iterator[FindingError]:
        """Each defect once, and none that the examples or the corpus show already."""
        known = {finding.defect for finding in self._known_findings()}
        while goes_on():
            try:
                self.run(lambda _: goes_on())
            except FindingError as finding:
                if finding.defect not in known:
                    known.add(finding.defect)
                    yield finding

    def _known_findings(self) -> Iterator[FindingError]:
        for data in self.pool:
            try:
                self.feed(data)
            except FindingError as finding:
                yield finding


def targets() -> Iterator[Target]:
    """Every parser."""
    yield from stream_targets()
    yield from file_targets()


def corpus(name: str) -> list[bytes]:
    """What was found in a parser before."""
    return [path.read_bytes() for path in sorted((CORPUS / name).glob("*"))]


def keep(finding: FindingError, name: str) -> Path:
    """Put a finding into the corpus."""
    path = CORPUS / name / hashlib.sha256(finding.data).hexdigest()[:12]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(finding.data)
    return path


def main(
    minutes: Annotated[float, typer.Option(help="In all, shared alike.")] = 10.0,
    seed: Annotated[int, typer.Option(help="Another one finds something else.")] = 1,
    only: Annotated[str, typer.Option(help="One parser's name.")] = "",
) -> None:
    """Fuzz every parser; exit 1 if anything new was found, which then is in the corpus."""
    logs.configure("critical")  # parsers warn of what they mend
    chosen = [target for target in targets() if only in ("", target.name)]
    found = 0
    for target in chosen:
        with tempfile.TemporaryDirectory() as folder:
            found += _fuzz(Fuzz(target, Path(folder), seed), 60.0 * minutes / len(chosen))
    raise typer.Exit(1 if found else 0)


def _fuzz(fuzz: Fuzz, seconds: float) -> int:
    """For so long; how many new defects there were."""
    found, until_s = 0, time.monotonic() + seconds
    for finding in fuzz.new_findings(lambda: time.monotonic() < until_s):
        found += 1
        typer.echo(f"{finding}: {finding.__cause__!r}; kept as {keep(finding, fuzz.name)}", err=True)
    fed = sum(fuzz.answers.values())
    typer.echo(f"{fuzz.name}: {fed} inputs, {len(fuzz.answers)} different answers, {found} findings")
    return found


if __name__ == "__main__":
    typer.run(main)
