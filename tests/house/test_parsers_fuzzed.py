"""Every parser is fed sound examples, all that was ever found in it, and mutations by a fixed seed."""

import re
from pathlib import Path

import pytest

from support.fuzz_target import Target
from support.parser_fuzz import CORPUS, FindingError, Fuzz, targets

MUTATIONS = 150


@pytest.mark.parametrize("target", tuple(targets()), ids=lambda target: target.name)
def test_a_parser_takes_or_refuses_whatever_it_is_fed(target: Target, tmp_path: Path) -> None:
    fuzz = Fuzz(target, tmp_path, seed=7)
    fuzz.feed_known()
    fuzz.run(lambda count: count < MUTATIONS)
    assert sum(fuzz.answers.values()) == MUTATIONS


@pytest.mark.parametrize("target", tuple(targets()), ids=lambda target: target.name)
def test_sound_examples_are_taken(target: Target, tmp_path: Path) -> None:
    fuzz = Fuzz(target, tmp_path, seed=7)
    answers = [(seed[:80], fuzz.feed(seed)) for seed in fuzz.seeds]
    assert [each for each in answers if not re.fullmatch(target.taken, each[1])] == []
    assert answers


@pytest.mark.parametrize("target", tuple(targets()), ids=lambda target: target.name)
def test_a_fixed_seed_gives_the_same_inputs_again(target: Target, tmp_path: Path) -> None:
    folders = tmp_path / "once", tmp_path / "again"
    for folder in folders:
        folder.mkdir()
    once, again = (target.seeds(folder) for folder in folders)
    assert once == again


def test_what_a_parser_lets_through_is_found(tmp_path: Path) -> None:
    careless = Target("careless", lambda _: [b"12", b"7"], lambda _: lambda data: f"{int(data) > 9}", "True")
    fuzz = Fuzz(careless, tmp_path, seed=1)
    assert fuzz.feed_known() == ["True", "False"]
    with pytest.raises(FindingError) as found:
        fuzz.run(lambda count: count < 1000)
    assert isinstance(found.value.__cause__, ValueError)


def test_each_defect_is_found_once(tmp_path: Path) -> None:
    """A mutation of these examples is no number, as a rule, or a number that there is no place for."""

    def careless(data: bytes) -> str:
        number = int(data)
        return "yes" if (1, 2, 3)[number] else "no"

    fuzz = Fuzz(Target("careless", lambda _: [b"0", b"1"], lambda _: careless, "yes"), tmp_path, seed=1)
    left = iter(range(300, 0, -1))
    found = [type(finding.__cause__) for finding in fuzz.new_findings(lambda: next(left, 0) > 0)]
    assert sorted(found, key=str) == [IndexError, ValueError]


def test_a_defect_that_the_corpus_shows_is_not_kept_again(tmp_path: Path) -> None:
    known = Target("careless", lambda _: [b"1", b"?"], lambda _: lambda data: f"{int(data)}", "1")
    left = iter(range(100, 0, -1))
    assert list(Fuzz(known, tmp_path, seed=1).new_findings(lambda: next(left, 0) > 0)) == []


def test_the_corpus_belongs_to_parsers_that_there_are() -> None:
    kept = {folder.name for folder in CORPUS.iterdir()} if CORPUS.exists() else set()
    assert kept <= {target.name for target in targets()}
