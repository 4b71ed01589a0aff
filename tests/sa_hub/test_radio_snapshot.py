"""The picture on demand: who asks when, who answers, and how soon a hub that comes late or back has everybody."""

import math
from collections import Counter
from itertools import pairwise

import pytest

from proving_ground.radio_trials.delivery import RIGHT_M, Room, Trial, late_joiner, outage
from sa_hub.radio.control import Request
from sa_hub.radio.frame import Codec
from sa_hub.radio.seal import NetKeys, Opener
from sa_hub.radio.snapshot import ASKS, CUT_OFF_NS, LATE_COUNTER, Answering, Asking
from support.hub_squad import GROUP_KEY, ORIGIN, START_NS, Air, S, Walk, hub, link


def asked_times(asking: Asking, from_s: float, until_s: float) -> list[tuple[float, Request]]:
    """When a hub asks, on a grid of 0.1 s."""
    found = []
    for tenth in range(round(10 * from_s), round(10 * until_s)):
        now_ns = START_NS + tenth * S // 10
        sending = asking.due(now_ns)
        if sending is not None:
            assert isinstance(sending.content, Request)
            found.append((tenth / 10, sending.content))
            sending.sent(now_ns, 0)
    return found


def began() -> Asking:
    """A hub that has just been switched on."""
    asking = Asking("seed", ask_s=0.1)
    assert asking.due(START_NS) is None
    return asking


def test_nobody_asks_in_an_ordinary_start_nor_alone() -> None:
    asking = began()
    assert asked_times(asking, 0.0, 1000.0) == []
    asking = began()
    for second in range(0, 300, 3):
        asking.opened(7, second // 3, START_NS + second * S)
        assert asked_times(asking, second, second + 3) == []


def test_who_hears_that_it_is_late_asks_a_few_times() -> None:
    asking = began()
    asking.known = 1
    assert not asking.opened(7, LATE_COUNTER, START_NS + S)
    times = [time for time, _ in asked_times(asking, 1.0, 40.0)]
    assert len(times) == ASKS
    assert 1.2 <= times[0] <= 1.9
    assert times[-1] <= 1.9 + 3 * 1.2 * 3.5 + 0.4


def test_who_does_not_know_an_epoch_asks_everybody_for_full_headers_at_once() -> None:
    asking = began()
    asking.unread(7, epoch_known=False)
    (first, request), *more = asked_times(asking, 0.0, 15.0)
    assert first <= 0.9
    assert request.unread is None
    assert len(more) == ASKS - 1


def test_three_frames_that_fit_no_counter_are_asked_about_by_name_and_ever_more_rarely() -> None:
    asking = began()
    asking.opened(7, 0, START_NS)
    found = []
    for second in range(600):
        asking.opened(8, second, START_NS + second * S)
        asking.unread(7, epoch_known=True)
        found += asked_times(asking, second, second + 1)
    assert found[0][0] >= 2.0
    assert all(request.unread == (7,) for _, request in found)
    # Four times each, then pauses of about 15 s, 30 s, 60 s, then two minutes: garbage costs little.
    assert 5 * ASKS <= len(found) <= 8 * ASKS


def test_who_is_cut_off_asks_until_it_hears_somebody_again_then_for_the_picture() -> None:
    asking = began()
    asking.opened(7, 0, START_NS)
    silent = [time for time, _ in asked_times(asking, 0.0, 345.0)]
    assert CUT_OFF_NS / S <= silent[0] <= CUT_OFF_NS / S + 0.1
    assert max(late - early for early, late in pairwise(silent)) <= 12.1
    assert asking.opened(7, 5, START_NS + 345 * S)
    assert not asking.opened(7, 6, START_NS + 346 * S)
    assert len(asked_times(asking, 346.0, 380.0)) == ASKS


def test_after_ten_minutes_of_silence_it_asks_once_a_minute() -> None:
    asking = began()
    asking.opened(7, 0, START_NS)
    asked_times(asking, 0.0, 660.0)
    assert len(asked_times(asking, 660.0, 1260.0)) in range(8, 14)


def answer_time(answering: Answering, from_s: float) -> float:
    """When it answers; infinite if not within 10 s."""
    for tenth in range(100):
        if answering.due(START_NS + round((from_s + tenth / 10) * S)):
            return from_s + tenth / 10
    return math.inf


def test_a_relay_answers_soon_others_later_and_only_who_knows_more() -> None:
    for relays, begin_s, end_s in ((True, 0.1, 0.5), (False, 1.5, 3.6)):
        answering = Answering("seed", relays=relays)
        answering.asked(Request(known=3), known=3, now_ns=START_NS)
        assert answer_time(answering, 0.0) == math.inf
        answering.asked(Request(known=3), known=4, now_ns=START_NS)
        assert begin_s <= answer_time(answering, 0.0) <= end_s


def test_who_hears_an_answer_keeps_silent() -> None:
    answering = Answering("seed", relays=False)
    answering.asked(Request(known=0), known=4, now_ns=START_NS)
    answering.heard_answer(START_NS + S)
    assert answer_time(answering, 1.0) == math.inf


# -- on the air -----------------------------------------------------------------------------------------------


def requests_of(air: Air) -> Counter[str]:
    """How often each hub has asked."""
    opener, codec = Opener(NetKeys(GROUP_KEY, "squad", 8)), Codec(ORIGIN)
    found: Counter[str] = Counter()
    for time_ns, sender, _, data in air.log:
        opened = opener.open(data)
        if isinstance(codec.decode(opened.sender, opened.payload, time_ns).content, Request):
            found[sender] += 1
    return found


def test_hubs_that_start_together_do_not_ask() -> None:
    air = Air({name: hub(name, link("squad")) for name in ("a1", "a2", "a3")}, loss=0.2, seed=7)
    air.run(120.0, {name: Walk() for name in air.hubs})
    assert requests_of(air) == {}


@pytest.mark.parametrize("leader", [True, False], ids=["a leader answers", "a soldier answers"])
def test_a_late_joiner_has_everybody_within_fifteen_seconds_at_1200_bits_per_second(leader: bool) -> None:
    figure = late_joiner(Room(loss=0.0, leader=leader), seeds=[3], late_s=60.0)
    assert figure.worst_s is not None
    assert figure.worst_s <= 15.0


def test_after_five_minutes_without_a_link_the_picture_is_right_within_fifteen_seconds() -> None:
    room = Room(soldiers=3, loss=0.0)
    for who in ("", "a1"):
        figure = outage(room, seeds=[5], who=who)
        assert figure.worst_s is not None
        assert figure.worst_s <= 15.0


@pytest.mark.parametrize("gone_s", [300.0, 307.0, 314.0])
def test_who_stands_still_is_shown_again_soon_after_the_link_comes_back(gone_s: float) -> None:
    """The next heartbeat may be 30 s off; the end of the silence wakes both."""
    air = Air({name: hub(name, link("squad", 1200)) for name in ("a1", "a2")})
    still = {"a1": Walk(speed_m_s=0.0), "a2": Walk(east_m=9.0, speed_m_s=0.0)}
    air.run(60.0, still)
    air.loss = 1.0
    air.run(gone_s, still)
    assert air.tracks["a1", "a2"].state == air.tracks["a2", "a1"].state == "lost"
    back_ns, air.loss = air.now_ns, 0.0
    air.run(15.0, still)
    for names in (("a1", "a2"), ("a2", "a1")):
        assert air.tracks[names].state == "fresh"
        assert air.tracks[names].time_ns >= back_ns


def test_a_hub_that_restarts_with_another_epoch_is_heard_and_has_everybody_again() -> None:
    trial = Trial(Room(soldiers=4, loss=0.3), seed=2)
    trial.start(trial.room.names)
    trial.run(100.0)
    trial.start(["a1"])
    for name in trial.room.names:
        trial.tracks.pop(("a1", name), None)
    trial.run(130.0)
    assert all(trial.error_m("a1", name) <= 3 * RIGHT_M for name in trial.room.names)
    assert all(trial.error_m(name, "a1") <= 3 * RIGHT_M for name in trial.room.names)
