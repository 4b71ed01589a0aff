"""Which frame is sent: it fits, the least worth stays behind, and none that pays is missed."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sa_hub.radio.content import Reports, Update
from sa_hub.radio.frame import Codec
from sa_hub.radio.history import DEPTH
from sa_hub.radio.offers import Terms, Wares, best_offer, most_surplus
from sa_hub.radio.room import Room
from sa_hub.radio.scheduler import Policy, Scheduler
from support.hub_squad import ORIGIN, START_NS, S
from support.radio_reports import at

CODEC = Codec(ORIGIN)
SOLDIERS = 30


@pytest.mark.parametrize("payload_bytes", [20, 30, 40, 50])
@pytest.mark.parametrize("on_stairs", [(), (30,), tuple(range(1, SOLDIERS + 1, 2))])
def test_an_update_fits_its_frame_and_leaves_out_who_matters_least(
    payload_bytes: int, on_stairs: tuple[int, ...]
) -> None:
    """All have walked on, the higher their number the farther; the new floors of some take bits, too."""
    plan, numbers = Scheduler(Policy(), own=1, grid=CODEC.grid), range(1, SOLDIERS + 1)
    plan.sent(0, Reports(tuple(at(each, 0.0, 50.0 * each, floor=1) for each in numbers)), START_NS)
    squad = [
        at(each, 1.0, 5.0 + 50.1 * each, floor=1 + (each in on_stairs), north_m_s=1.3) for each in numbers
    ]
    content = plan.plan(squad, Room(40_000.0, 40_000.0, 1200.0, 8.0 * payload_bytes, 80.0), START_NS + S)
    assert isinstance(content, Update)
    assert payload_bytes - 6 < len(CODEC.encode(1, content, 3, 999)) <= payload_bytes
    told = {entry.number for entry in content.entries}
    assert any(entry.level for entry in content.entries) == bool(on_stairs)
    for alike in (set(on_stairs), set(numbers) - set(on_stairs)):
        assert told & alike == set(sorted(alike)[len(alike) - len(told & alike) :])


@given(
    st.integers(1, 64),
    st.floats(0.0, 12.0),
    st.floats(0.01, 3.0),
    st.floats(0.0, 20.0),
    st.sampled_from([1.0, 0.15]),
    st.booleans(),
)
@example(64, 7.9, 1.0, 10.0, 1.0, False)  # a whole company of whom each pays for his 7 bits
@example(64, 2.0, 1.0, 10.0, 0.15, False)  # or for his share of them
@settings(deadline=None)
def test_the_quick_look_refuses_no_frame_that_pays(
    n: int, worth_in_bits: float, price: float, frame_price: float, entry_share: float, steady: bool
) -> None:
    worth = np.full(n, worth_in_bits * price)
    wares = Wares(
        worth=worth[None, :],
        behind=np.zeros((1, n), dtype=np.int64),
        needs=np.zeros(n, dtype=np.int64),
        bits=np.ones(n),
        velocity_bits=np.ones(n),
        steady=np.full((n, DEPTH), steady),
        changes_bits=np.zeros((n, DEPTH)),
        off_cells=np.zeros((n, DEPTH)),
        refresh=np.zeros(n),
        span_cells=100.0,
        span=n - 1,
        resolution=3,
    )
    terms = Terms(price, frame_price, 1600.0, 1.0, 0, entry_share)
    assert most_surplus(worth, terms) > frame_price or best_offer(wares, terms) is None
