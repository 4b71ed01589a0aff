"""How far behind listeners may be, against every way to lose frames; and what is learnt of how many are lost."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sa_hub.radio.arrears import after, certainly, needed
from sa_hub.radio.content import Feedback
from sa_hub.radio.layout import MISSES
from sa_hub.radio.listeners import ROWS, Listeners
from sa_hub.radio.picture import Pictures, Spoken

SLOTS = 3
frames = st.tuples(
    st.sets(st.integers(0, SLOTS - 1), min_size=1), st.one_of(st.none(), st.sampled_from(MISSES[:4]))
)


def spoken(slots: set[int], misses: int | None) -> Spoken:
    nought = np.zeros(len(slots))
    return Spoken(np.array(sorted(slots)), *(nought,) * 5, misses)


@given(st.lists(frames, min_size=1, max_size=7), st.sampled_from([0.1, 0.5, 0.9]))
def test_the_odds_are_those_of_all_ways_to_lose_frames(
    told: list[tuple[set[int], int | None]], loss: float
) -> None:
    ways = 1 << len(told)
    heard = (np.arange(ways)[:, None] >> np.arange(len(told)) & 1).astype(bool)
    pictures = Pictures(ways, SLOTS)
    odds = certainly(pictures.behind(np.arange(SLOTS))[0])
    for index, frame in enumerate(told):
        pictures.hear(heard[:, index], spoken(*frame))
        odds = after(odds, spoken(*frame), loss)
    chances = np.prod(np.where(heard, 1.0 - loss, loss), axis=1)
    behind = np.minimum(pictures.behind(np.arange(SLOTS)), odds.shape[1] - 1)
    for slot in range(SLOTS):
        assert np.bincount(behind[:, slot], chances, odds.shape[1]) == pytest.approx(odds[slot])


def test_updates_allow_for_what_two_of_five_frames_may_have_left() -> None:
    """Told for sure, then not in five frames of which each is missed with 0.3: binomial(5, 0.3)."""
    odds = certainly(np.zeros(2, dtype=np.int64))
    for _ in range(5):
        odds = after(odds, spoken({1}, 2), 0.3)
    assert [int(needed(odds, unsure)[0]) for unsure in (0.2, 0.17, 0.04, 0.01)] == [2, 2, 3, 4]


@pytest.mark.parametrize(("assumed", "learnt"), [(0.0, 4 / 12), (0.2, 8 / 28)])
def test_what_the_first_feedback_tells_of_the_loss_counts_at_once(assumed: float, learnt: float) -> None:
    """Eight frames, four of them missed: beside four of which nothing was said, or twenty that were stated."""
    listeners = Listeners(assumed, seed=1)
    listeners.widen(16)
    for counter in range(8):
        listeners.spoke(counter, spoken({1}, None))
    listeners.told(7, Feedback(about=1, newest=7, span=8, heard=0b0101010), 0)
    assert listeners.loss == pytest.approx(learnt)


def test_who_does_not_tell_counts_as_much_as_who_does_once_frames_are_lost() -> None:
    """Two were heard, one tells of losses: half of the receivers that are played stand for the other."""
    listeners = Listeners(0.0, seed=1)
    listeners.widen(16)
    for number in (7, 8):
        listeners.heard_from(number, 0)
    for counter in range(8):
        listeners.spoke(counter, spoken({1}, None))
    listeners.told(7, Feedback(about=1, newest=7, span=8, heard=0b0101010), 0)
    assert listeners.pictures.rows == ROWS
    listeners.spoke(8, spoken({1}, None))
    assert 0 < listeners.pictures.missed[ROWS // 2 :].sum() < ROWS // 2


def test_who_is_forgotten_was_never_told() -> None:
    """The next soldier of that number is as unknown to a listener as one it never heard of."""
    listeners = Listeners(0.3, seed=1)
    listeners.widen(16)
    for counter in range(4):
        listeners.spoke(counter, spoken({1}, None))
    listeners.told(7, Feedback(about=1, newest=3, span=4, heard=0b1111), 0)
    known, never = np.array([1]), np.array([9])
    assert listeners.needs(known, 0.01) == [0]
    listeners.forget(1)
    for each in listeners._listeners.values():
        np.testing.assert_array_equal(each.arrears[known], each.arrears[never])
