"""When reports are told: worth against bits, a price that follows the budget, silence, relevance, and loss."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from sa_hub.radio.content import Feedback, Report, Reports, Update
from sa_hub.radio.counters import MemoryCounters
from sa_hub.radio.frame import Codec
from sa_hub.radio.grid import Grid
from sa_hub.radio.hearing import KEEPS_NS, Hearing
from sa_hub.radio.listeners import Listeners
from sa_hub.radio.net import RadioNet
from sa_hub.radio.pacing import CHEAPEST, Pacing, usual_level
from sa_hub.radio.picture import Spoken
from sa_hub.radio.relevance import LEADER, NEAR_OTHERS, NEAR_SEEN, Relevance
from sa_hub.radio.replay import Heard
from sa_hub.radio.room import Room
from sa_hub.radio.scheduler import Policy, Scheduler
from sa_hub.radio.seal import NetKeys, Opener, Sealer
from sa_hub.settings import LinkProfile
from support.hub_squad import GROUP_KEY, ORIGIN, START_NS, S
from support.radio_reports import METRE_DEG, at

GRID, CODEC = Grid(ORIGIN), Codec(ORIGIN)
WIDE = Room(2000.0, 4000.0, 1200.0, 1600.0, 80.0)
NARROW = replace(WIDE, rate_bits_per_s=5.0)


def scheduler(**policy: float) -> Scheduler:
    return Scheduler(Policy(**policy), own=1, grid=GRID)


def tell(plan: Scheduler, squad: list[Report], room: Room = WIDE, counter: int = 0) -> list[int]:
    """Let it decide at the time of the newest report, and put what it plans on the air; who was told."""
    now_ns = max(report.time_ns for report in squad)
    if not plan.is_due(now_ns):
        return []
    plan.pass_time(room, len(squad), now_ns)
    content = plan.plan(squad, room, now_ns)
    if content is None:
        return []
    plan.sent(counter, CODEC.decode(1, CODEC.encode(1, content, 3, 999), now_ns).content, now_ns)
    return [each.number for each in (content.reports if isinstance(content, Reports) else content.entries)]


def test_who_was_never_told_is_told_at_once_and_in_full() -> None:
    plan = scheduler().plan([at(1, 0.0), at(2, 0.0)], WIDE, START_NS)
    assert isinstance(plan, Reports)
    assert {report.number for report in plan.reports} == {1, 2}


def test_a_prediction_that_holds_is_not_told_and_one_that_fails_is() -> None:
    plan = scheduler()
    assert tell(plan, [at(1, 0.0, north_m_s=1.0)], room=NARROW) == [1]
    for tenths in range(2, 80, 2):
        # Damped by 60 s, the prediction is 0.5 m short after 8 s.
        assert (
            tell(plan, [at(1, tenths / 10, north_m=tenths / 10, north_m_s=1.0)], room=NARROW, counter=1) == []
        )
    assert tell(plan, [at(1, 9.0, north_m=30.0, north_m_s=1.0)], room=NARROW, counter=1) == [1]


def test_who_is_far_from_worth_his_bits_is_looked_at_half_as_often() -> None:
    """At this price 7 m off would be told: at 1 m there is time, at 6 m there is none to lose."""
    plan, room = scheduler(), replace(WIDE, rate_bits_per_s=5.0)
    assert tell(plan, [at(1, 0.0)], room) == [1]

    def pause_s(time_s: float, north_m: float) -> float:
        now_ns = START_NS + round(time_s * S)
        plan.pass_time(room, 1, now_ns)
        assert plan.plan([at(1, time_s, north_m=north_m)], room, now_ns) is None
        return next(tenths / 10 for tenths in range(10) if plan.is_due(now_ns + tenths * S // 10))

    assert pause_s(2.0, north_m=1.0) == 0.4
    assert pause_s(4.0, north_m=6.0) == 0.2


@pytest.mark.parametrize("rate_bits_per_s", [75.0, 300.0, 1200.0, 9600.0])
def test_at_ordinary_rates_who_is_where_he_was_told_is_only_told_in_full_again_ever_more_seldom(
    rate_bits_per_s: float,
) -> None:
    """Bits to spare go to who may have missed it all; news goes at once."""
    plan, room = scheduler(), replace(WIDE, rate_bits_per_s=rate_bits_per_s)
    assert tell(plan, [at(1, 0.0)], room) == [1]
    told_s = [0.0]
    for fifths in range(1, 150):
        now_ns = START_NS + fifths * S // 5
        plan.pass_time(room, 1, now_ns)
        content = plan.plan([at(1, fifths / 5)], room, now_ns)
        if content is not None:
            assert isinstance(content, Reports)
            plan.sent(1, content, now_ns)
            told_s.append(fifths / 5)
    pauses_s = [after - before for before, after in itertools.pairwise(told_s)]
    assert all(after > 1.5 * before for before, after in itertools.pairwise(pauses_s))
    assert 2 <= len(pauses_s) <= 4  # after 1, 2, 4 and 8 s, or after 3 times what it takes of the budget
    assert tell(plan, [at(1, 30.2, north_m=30.0)], room, counter=1) == [1]


def test_what_the_net_told_itself_is_never_repeated_to_it() -> None:
    plan = scheduler()
    plan.told(at(2, 40.0))
    assert plan.plan([at(2, 40.0, north_m=500.0)], WIDE, START_NS + 40 * S) is None
    assert plan.plan([at(2, 41.0, north_m=500.0)], WIDE, START_NS + 41 * S) is not None


def test_our_own_clock_set_back_does_not_silence_us() -> None:
    plan = scheduler()
    plan.told(at(1, 3600.0))
    plan.told(at(2, 3600.0))
    assert tell(plan, [at(1, 0.0), at(2, 0.0)]) == [1]


def test_an_old_report_of_ourselves_is_not_told() -> None:
    plan = scheduler()
    assert plan.plan([at(1, 0.0)], WIDE, START_NS + 3 * S) is None
    assert plan.plan([at(2, 0.0)], WIDE, START_NS + 3 * S) is not None


def test_after_the_clock_was_set_back_all_is_told_in_full() -> None:
    plan = scheduler()
    tell(plan, [at(1, 3600.0)])
    plan.set_back(3600 * S)
    content = plan.plan([at(1, 1.0)], WIDE, START_NS + S)
    assert isinstance(content, Reports)


def test_what_is_forgotten_is_told_in_full_again() -> None:
    plan = scheduler()
    tell(plan, [at(1, 0.0), at(2, 0.0)], NARROW)
    assert plan.plan([at(1, 1.0), at(2, 1.0)], NARROW, START_NS + S) is None
    plan.forget([2])
    content = plan.plan([at(1, 2.0), at(2, 2.0)], NARROW, START_NS + 2 * S)
    assert isinstance(content, Reports)
    assert [report.number for report in content.reports] == [2]


def test_what_the_net_told_itself_is_told_to_who_asked_for_the_picture() -> None:
    plan, leader = scheduler(), at(1, 40.0)
    plan.told(at(2, 40.0, north_m=9.0))
    assert tell(plan, [leader, at(2, 40.0, north_m=9.0)]) == [1]
    plan.forget([1, 2])
    assert set(tell(plan, [at(1, 40.5), at(2, 40.0, north_m=9.0)])) == {1, 2}


def test_later_news_go_as_an_update_and_only_what_has_changed() -> None:
    plan = scheduler()
    tell(plan, [at(1, 0.0), at(2, 0.0, floor=1)])
    content = plan.plan([at(1, 1.0, north_m=20.0), at(2, 1.0, north_m=20.0, floor=2)], WIDE, START_NS + S)
    assert isinstance(content, Update)
    assert [(entry.level is not None, entry.quality is not None) for entry in content.entries] == [
        (False, False),
        (True, False),
    ]


def test_the_price_rises_as_the_bucket_empties_and_settles_where_it_is_half_full() -> None:
    pacing = Pacing()
    pacing.passed(
        600.0, 0.5, -2.0
    )  # long after the start, when an empty bucket was as good as a half full one
    prices = []
    for fill in (1.0, 0.75, 0.5, 0.25, 0.0):
        pacing.passed(0.0, fill, -2.0)
        prices.append(pacing.price)
    ratios = [after / before for before, after in itertools.pairwise(prices)]
    assert ratios == pytest.approx([math.e] * 4)  # four e-folds from full to empty
    for _ in range(60):
        pacing.passed(1.0, 0.5, -2.0)
    # What was wanted was short of a half by 0.5 · e^-10 when these began, which is 9e-5 of the price.
    assert pacing.price == pytest.approx(prices[2], rel=2e-4)
    for _ in range(60):
        pacing.passed(1.0, 1.0, -2.0)
    assert pacing.price < prices[0]


def test_an_empty_bucket_makes_bits_dear_only_after_the_start() -> None:
    pacing = Pacing()
    pacing.passed(1.0, 0.0, -2.0)
    early = pacing.price
    for _ in range(59):
        pacing.passed(1.0, 0.0, -2.0)
    assert early == pytest.approx(math.exp(-2.0), rel=0.05)
    assert pacing.price > math.e * early


def test_the_price_begins_where_the_budget_is_just_spent() -> None:
    """Twelve at 34 bit/s: one frame takes 80 + 12 * 18 = 296 bits, 8.7 s, in which 1.2 m/s make 10.4 m."""
    narrow = Room(1000.0, 1360.0, 34.0, 1600.0, 80.0)
    assert usual_level(narrow, 12, 0.6) == pytest.approx(math.log(6 * 9.847**1.6 / 296.0), abs=1e-3)
    assert usual_level(replace(narrow, rate_bits_per_s=3400.0), 12, 0.6) == CHEAPEST
    assert usual_level(narrow, 0, 0.6) == CHEAPEST
    pacing = Pacing()
    pacing.passed(0.0, 0.0, usual_level(narrow, 1, 0.6))
    one = pacing.price
    pacing.passed(0.0, 0.0, usual_level(narrow, 12, 0.6))
    assert pacing.price > 5.0 * one  # at once when there are more to tell of


def squad_net(rate_bits_per_s: int, **options: object) -> RadioNet:
    profile = LinkProfile(name="squad", rate_bits_per_s=rate_bits_per_s, header_bytes=0, **options)  # type: ignore[arg-type]
    keys = NetKeys(GROUP_KEY, "squad", 8)
    return RadioNet(profile, Policy(), 1, Codec(ORIGIN), Sealer(keys, 1, MemoryCounters()), Opener(keys))


@pytest.mark.parametrize("rate", [75, 1200, 1_000_000])
def test_nobody_starves_and_the_budget_holds(rate: int) -> None:
    """Eleven who walk round in circles and one who stands: all are heard of, and no window is overdrawn."""
    net = squad_net(rate)
    ear = squad_net(rate)
    ear._number = 2
    heard: dict[int, list[float]] = {number: [] for number in range(1, 13)}
    sent: list[tuple[float, int]] = []
    for tenths in range(0, 2000, 2):
        turn = tenths / 10 * 0.08
        squad = [
            at(number, tenths / 10, 25.0 * math.sin(turn + number), north_m_s=2.0 * math.cos(turn + number))
            for number in range(1, 12)
        ]
        squad.append(at(12, tenths / 10))
        for frame in net.speak(squad, START_NS + tenths * S // 10):
            sent.append((tenths / 10, 8 * len(frame)))
            told = ear.hear(frame, START_NS + tenths * S // 10, range(1, 13), exercise=False)
            assert told is not None
            assert isinstance(told[1], Reports)
            for report in told[1].reports:
                heard[report.number].append(tenths / 10)
    for first, (begin_s, _) in enumerate(sent):
        sums = itertools.accumulate(bits for _, bits in sent[first:])
        for total, (end_s, _) in zip(sums, sent[first:], strict=True):
            assert total <= rate * (end_s - begin_s) + rate * min(max(4000 / rate, 2.0), 40.0) + 1e-6
    longest_s = max(
        after - before for times in heard.values() for before, after in itertools.pairwise([*times, 200.0])
    )
    assert longest_s < {75: 100.0, 1200: 45.0, 1_000_000: 30.0}[rate]
    spent = sum(bits for _, bits in sent) / 200.0
    assert spent <= min(rate, 20_000)  # with plenty to spend no more is sent than helps
    if rate == 75:
        assert spent > 0.8 * rate


def test_leaders_and_who_is_near_another_squad_or_something_seen_matter_more() -> None:
    relevance = Relevance({1: "a", 2: "a", 3: "b", 4: "a", 5: "a"}, leaders={4})
    relevance.saw(START_NS, ORIGIN.latitude_deg + 2000 * METRE_DEG, ORIGIN.longitude_deg)
    north_m = np.array([0.0, 300.0, 90.0, 700.0, 1900.0])
    latitude = ORIGIN.latitude_deg + north_m * METRE_DEG
    longitude = np.full(5, ORIGIN.longitude_deg)
    weights = relevance.weights([1, 2, 3, 4, 5], latitude, longitude, START_NS + S)
    assert weights.tolist() == [NEAR_OTHERS, 1.0, NEAR_OTHERS, LEADER, NEAR_SEEN]
    later = relevance.weights([5], latitude[4:], longitude[4:], START_NS + 601 * S)
    assert later.tolist() == [1.0]


def test_blue_on_blue_goes_first() -> None:
    """Two alike but for another squad's soldier beside one of them; room for one only."""
    plan = scheduler()
    plan.relevance = Relevance({2: "a", 3: "a", 4: "b"})
    squad = [at(2, 0.0), at(3, 0.0, 1000.0), at(4, 0.0, 1050.0)]
    for counter in range(3):
        tell(plan, [replace(each, time_ns=START_NS + counter * S) for each in squad], counter=counter)
    moved = [at(2, 4.0, 12.0), at(3, 4.0, 1012.0), at(4, 4.0, 1050.0)]
    content = plan.plan(moved, replace(WIDE, payload_bits=47.0), START_NS + 4 * S)
    assert isinstance(content, Update)
    assert [entry.number for entry in content.entries] == [3]


# -- who has heard what -------------------------------------------------------------------------------------------


def spoken(*slots: int, misses: int | None = None, second: float = 0.0) -> Spoken:
    place = np.full(len(slots), 59.0)
    still = np.zeros(len(slots))
    return Spoken(
        np.array(slots, dtype=np.int64), np.full(len(slots), second), place, still, still, still, misses
    )


def test_stand_ins_miss_about_as_much_as_assumed() -> None:
    listeners = Listeners(0.25, seed=1)
    listeners.widen(1)
    for counter in range(400):
        listeners.spoke(counter, spoken(0))
    assert listeners.pictures.missed.mean() == pytest.approx(100.0, rel=0.1)


def test_feedback_makes_certain_who_has_what() -> None:
    listeners = Listeners(0.5, seed=1)
    listeners.widen(2)
    for counter in range(8):
        listeners.spoke(counter, spoken(0 if counter < 6 else 1, second=float(counter)))
    # Heard up to counter 6, but neither 4 nor 5.
    listeners.told(9, Feedback(1, 6, 8, 0b0000_1100_1111_00 >> 2 & ~0b11), START_NS)
    pictures = listeners.pictures
    assert listeners.tell
    assert set(pictures.time_s[:, 0].tolist()) == {3.0}
    assert set(pictures.time_s[:, 1].tolist()) == {6.0, 7.0}  # of the last one nobody has told
    assert set(pictures.behind(np.array([0]))[:, 0].tolist()) <= {2, 3}


def test_feedback_lowers_or_raises_the_loss_that_is_assumed() -> None:
    listeners = Listeners(0.2, seed=1)
    listeners.widen(1)
    for counter in range(200):
        listeners.spoke(counter, spoken(0))
        if counter % 8 == 7:
            listeners.told(9, Feedback(1, counter % 256, 8, 0xFF), START_NS + counter * S)
    assert listeners.loss < 0.01


def test_a_listener_that_has_long_been_silent_is_dropped() -> None:
    listeners = Listeners(0.2, seed=1)
    listeners.widen(1)
    listeners.spoke(0, spoken(0))
    listeners.told(9, Feedback(1, 0, 4, 0), START_NS)
    listeners.told(8, Feedback(1, 0, 4, 0), START_NS + 400 * S)
    assert listeners._certain.rows == 1


def test_who_falls_silent_no_longer_tells_though_nobody_else_says_anything() -> None:
    """A net parts: from then on nobody is known to hear us, and what he has is left to chance again."""
    plan = scheduler(loss=0.2)
    tell(plan, [at(1, 0.0)])
    plan.listeners.heard_from(9, START_NS)
    plan.told_what_was_heard(9, Feedback(1, 0, 4, 0), START_NS)
    for second, tells in ((300, True), (301, False), (900, False)):
        plan.pass_time(WIDE, 1, START_NS + second * S)
        assert plan.listeners.all_tell is tells
        assert plan.listeners.tell is tells
    assert not list(plan.known_by_listeners())
    plan.sent(1, Reports((at(1, 901.0),)), START_NS + 901 * S)
    assert len(set(plan.listeners.pictures.time_s[:, 0].tolist())) > 1


def test_who_is_gone_and_told_nothing_no_longer_keeps_stand_ins() -> None:
    listeners = Listeners(0.5, seed=1)
    listeners.widen(1)
    listeners.heard_from(8, START_NS)
    listeners.spoke(0, spoken(0))
    listeners.heard_from(9, START_NS + 200 * S)
    listeners.told(9, Feedback(1, 0, 4, 0), START_NS + 200 * S)
    listeners.pass_time(START_NS + 300 * S)
    assert (listeners.all_tell, listeners.pictures.known.all()) == (False, False)
    listeners.pass_time(START_NS + 301 * S)
    assert (listeners.all_tell, listeners.pictures.known.all()) == (True, True)


def test_feedback_goes_to_who_was_missed_and_costs_nothing_otherwise() -> None:
    hearing = Hearing()
    hearing.heard_telling(5, epoch=1, counter=10, soldiers=[7])
    first = hearing.due({5: Heard(1, 19, mask=0b11_1111_1111)}.get, 1, START_NS)
    assert first == Feedback(5, 19, 32, 0b1_1111_1111)
    feedback = hearing.due({5: Heard(1, 20, mask=0b111_1110_0111)}.get, 1, START_NS)
    # The first goes back as far as feedback can, to what was told in full before the first update.
    assert feedback == Feedback(5, 20, 32, 0b0011_1111_0011)
    hearing.heard_telling(6, epoch=1, counter=15, soldiers=[8, 9, 10])
    memory = {5: Heard(1, 20, mask=0b111_1110_0111), 6: Heard(1, 20, mask=0b10_0001)}
    other = hearing.due(memory.get, 1, START_NS)
    assert other is not None
    assert other.about == 6  # fewer frames, but of more soldiers
    hearing.sent(feedback, START_NS)
    assert hearing.due({5: Heard(1, 20, mask=0b111_1110_0111)}.get, 1, START_NS) is None
    assert hearing.due(lambda _sender: None, 1, START_NS) is None
    feedback = hearing.due({5: Heard(1, 24, mask=0b111_1110_0111_0111)}.get, 1, START_NS)
    assert feedback is not None
    assert feedback.span == 16  # from the one before the last on


def test_feedback_is_kept_fresh_where_bits_are_cheap() -> None:
    hearing = Hearing()
    hearing.heard_telling(5, epoch=1, counter=10, soldiers=[7])
    hearing.sent(Feedback(5, 10, 32, 0), START_NS)
    memory = {5: Heard(1, 12, mask=0b111)}
    assert hearing.due(memory.get, 1, START_NS + KEEPS_NS - 1, cheap=True) is None
    assert hearing.due(memory.get, 1, START_NS + KEEPS_NS, cheap=True) is not None
    assert hearing.due(memory.get, 1, START_NS + KEEPS_NS, cheap=False) is None
    assert hearing.due({5: Heard(1, 10, mask=0b1)}.get, 1, START_NS + KEEPS_NS, cheap=True) is None
    hearing.set_back(KEEPS_NS)
    assert hearing.due(memory.get, 1, START_NS, cheap=True) is not None


def test_who_tells_of_many_spends_nothing_on_who_tells_of_few() -> None:
    hearing = Hearing()
    hearing.heard_telling(5, epoch=1, counter=10, soldiers=[7])
    memory = {5: Heard(1, 20, mask=0b111_1110_0111)}
    assert hearing.due(memory.get, 3, START_NS) is None
    assert hearing.due(memory.get, 2, START_NS) is not None


def test_a_listener_has_only_what_it_said_to_have_heard() -> None:
    """Stand-ins that lose next to nothing have all of it; the real one heard only counter 2 of three."""
    listeners = Listeners(0.01, seed=1)
    listeners.widen(3)
    for counter in range(3):
        listeners.spoke(counter, spoken(counter, second=float(counter)))
    listeners.told(9, Feedback(1, 2, 4, 0), START_NS)
    assert listeners.pictures.known.all(axis=0).tolist() == [False, False, True]
    assert listeners.pictures.known.any(axis=0).tolist() == [False, False, True]


def test_who_was_heard_but_tells_nothing_keeps_his_stand_ins() -> None:
    listeners = Listeners(0.5, seed=1)
    listeners.widen(1)
    listeners.heard_from(8, START_NS)
    listeners.heard_from(9, START_NS)
    listeners.spoke(0, spoken(0))
    listeners.told(9, Feedback(1, 0, 4, 0), START_NS)
    assert not listeners.all_tell
    assert 0 < (~listeners.pictures.known[:, 0]).sum() <= listeners.pictures.rows // 2
    listeners.spoke(1, spoken(0, second=1.0))
    told = listeners.pictures.rows - listeners._strangers
    ours, stand_ins = listeners.pictures.time_s[told:], listeners._stand_ins.time_s[: listeners._strangers]
    assert (ours == stand_ins).all()
    listeners.told(8, Feedback(1, 1, 4, 0b1), START_NS)
    assert listeners.all_tell
    assert listeners.pictures.known.all()
