"""Where a foot was of late, against a plain list of the newest places."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fusion.trail import MOST, Trail
from fusion.transform import RigidTransform


def test_places_between_and_beyond() -> None:
    trail = Trail()
    assert not trail
    assert trail.moved_since(0) is None
    trail.put(100, np.array([0.0, 0.0, 0.0]))
    trail.put(200, np.array([1.0, 2.0, 0.0]))
    trail.put(150, np.array([2.0, 2.0, 0.0]))  # late: where the foot is now
    assert trail.span_ns == (100, 200)
    assert trail.at(50).tolist() == [0.0, 0.0, 0.0]
    assert trail.at(125).tolist() == [0.5, 0.5, 0.0]
    assert trail.at(999).tolist() == [2.0, 2.0, 0.0]
    assert trail.moved_since(99) is None
    assert np.asarray(trail.moved_since(150)).tolist() == [1.0, 1.0, 0.0]


def test_all_that_is_remembered_moves() -> None:
    trail = Trail()
    trail.put(0, np.zeros(3))
    trail.put(10, np.array([1.0, 0.0, 0.0]))
    trail.carry(np.array([0.0, 0.0, 5.0]))
    trail.transform(RigidTransform((0.0, 0.0, 0.0), (0.0, 10.0, 0.0), math.pi / 2, np.zeros((4, 4))))
    trail.shift(1000)
    assert trail.span_ns == (1000, 1010)
    assert np.allclose(trail.at(1000), [0.0, 10.0, 5.0])
    assert np.allclose(trail.at(1010), [0.0, 11.0, 5.0])
    trail.clear()
    assert not trail


@given(st.lists(st.integers(-3, 40), max_size=400), st.integers(0, 6000))
def test_the_newest_places_are_remembered(gaps: list[int], asked_ns: int) -> None:
    trail, plain, time_ns = Trail(), [], 0
    for index, gap in enumerate(gaps):
        time_ns += gap
        place = np.array([index, -index, 0.5 * index])
        trail.put(time_ns, place)
        if not plain or time_ns > plain[-1][0]:
            plain.append((time_ns, place))
        else:
            plain[-1], time_ns = (plain[-1][0], place), plain[-1][0]
        plain = plain[-MOST:]
    assert bool(trail) == bool(plain)
    if plain:
        times_ns, places = zip(*plain, strict=True)
        assert trail.span_ns == (times_ns[0], times_ns[-1])
        expected = [np.interp(asked_ns, times_ns, column) for column in np.array(places).T]
        assert np.allclose(trail.at(asked_ns), expected)
