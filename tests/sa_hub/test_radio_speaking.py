"""When a net speaks: the scheduler's beliefs, the order of notices, the budget and the longest frame."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sa_hub.radio.content import AlertNotice, Notice, ObservationNotice, Report, Reports, StatusNotice
from sa_hub.radio.counters import MemoryCounters
from sa_hub.radio.frame import Codec
from sa_hub.radio.net import RadioNet
from sa_hub.radio.outbox import CAPACITY, Outbox
from sa_hub.radio.scheduler import Policy, Scheduler, predicted_error_m
from sa_hub.radio.seal import NetKeys, Opener, Sealer
from sa_hub.settings import LinkProfile
from support.hub_squad import GROUP_KEY, ORIGIN, START_NS, S

METRE_DEG = 1.0 / 111_405.0
NUMBERS = range(1, 200)


def at(number: int, seconds: float, north_m: float = 0.0, **options: object) -> Report:
    """A report from some metres north of the origin."""
    return Report(
        number=number,
        time_ns=START_NS + round(seconds * S),
        latitude_deg=ORIGIN.latitude_deg + north_m * METRE_DEG,
        longitude_deg=ORIGIN.longitude_deg,
        accuracy_m=1.0,
        **options,  # type: ignore[arg-type]
    )


def scheduler(gather_s: float = 1.0) -> Scheduler:
    """5 m or 30 s."""
    return Scheduler(Policy(threshold_m=5.0, heartbeat_s=30.0, confirm_s=30.0, gather_s=gather_s), own=1)


def test_predicted_error_is_the_distance_from_the_moved_on_belief() -> None:
    belief = at(1, 0.0, north_m=10.0, north_m_s=2.0, east_m_s=1.0)
    # After 3 s the belief has gone 6 m north and 3 m east; the soldier is 4 m north of that and 3 m west.
    assert predicted_error_m(belief, at(1, 3.0, north_m=20.0)) == pytest.approx(
        math.hypot(4.0, 3.0), rel=1e-3
    )


def test_who_was_never_told_is_due_at_once_when_alone() -> None:
    assert scheduler().due([at(1, 0.0)], START_NS) == [at(1, 0.0)]


def test_a_prediction_that_holds_is_not_repeated_before_the_heartbeat() -> None:
    plan = scheduler()
    plan.told(at(1, 0.0, north_m_s=1.0))
    assert plan.due([at(1, 29.9, north_m=29.9)], START_NS) == []
    assert plan.due([at(1, 30.0, north_m=30.0)], START_NS) != []


def test_an_error_beyond_the_threshold_is_due() -> None:
    plan = scheduler()
    plan.told(at(1, 0.0, north_m_s=1.0))
    assert plan.due([at(1, 10.0, north_m=14.9)], START_NS) == []
    assert plan.due([at(1, 10.0, north_m=15.1)], START_NS) != []


def test_news_is_confirmed_early_and_then_ever_later() -> None:
    plan = Scheduler(Policy(threshold_m=5.0, heartbeat_s=30.0, confirm_s=4.0, gather_s=0.0), own=1)
    plan.told(at(1, 0.0))
    times = []
    for tenth in range(1, 1300):
        # Stands still, jumps 50 m north after 80 s, stands still again.
        report = at(1, tenth / 10, north_m=0.0 if tenth < 800 else 50.0)
        if plan.due([report], report.time_ns):
            plan.told(report)
            times.append(tenth / 10)
    assert times == [4.0, 12.0, 28.0, 58.0, 80.0, 84.0, 92.0, 108.0]


def test_nothing_known_beyond_what_was_on_the_air_is_never_repeated() -> None:
    plan = scheduler()
    plan.told(at(2, 40.0))
    assert plan.due([at(2, 40.0, north_m=500.0), at(3, 1.0)], START_NS)[1:] == []
    assert plan.urgency(at(2, 39.0, north_m=500.0)) == 0.0


def test_the_first_due_waits_for_companions_and_takes_along_who_is_nearly_due() -> None:
    plan = scheduler(gather_s=2.0)
    for number in (1, 2, 3):
        plan.told(at(number, 0.0))
    squad = [at(1, 5.0, north_m=5.5), at(2, 5.0, north_m=3.1), at(3, 5.0, north_m=2.9)]
    assert plan.due(squad, START_NS) == []
    assert plan.due(squad, START_NS + 2 * S - 1) == []
    assert plan.due(squad, START_NS + 2 * S) == squad[:2]


def test_our_own_clock_set_back_does_not_silence_us() -> None:
    plan = scheduler()
    plan.told(at(1, 3600.0))
    plan.told(at(2, 3600.0))
    assert plan.urgency(at(1, 0.0)) == math.inf
    assert plan.urgency(at(2, 0.0)) == 0.0


def alert(seconds: float = 0.0, text: str = "") -> AlertNotice:
    return AlertNotice(1, START_NS + round(seconds * S), "contact", text)


def test_alerts_go_before_observations_before_status() -> None:
    box = Outbox()
    status, seen = StatusNotice(1, START_NS, "ok"), ObservationNotice(1, START_NS, 59.0, 18.0, 5.0)
    order: list[Notice] = []
    for notice in (status, seen, alert()):
        box.post(notice, START_NS)
    while notice_due := box.due(START_NS):
        order.append(notice_due)
        box.sent(notice_due, START_NS)
    assert order == [alert(), seen, status]


def test_an_alert_is_repeated_with_growing_pauses_and_then_forgotten() -> None:
    box = Outbox()
    box.post(alert(), START_NS)
    times = []
    for tenth in range(300):
        now_ns = START_NS + tenth * S // 10
        if notice := box.due(now_ns):
            box.sent(notice, now_ns)
            times.append(tenth / 10)
    assert times == [0.0, 2.0, 6.0]


def test_a_new_status_takes_the_place_of_one_still_waiting() -> None:
    box = Outbox()
    box.post(StatusNotice(1, START_NS, "ok"), START_NS)
    box.post(StatusNotice(1, START_NS + S, "wounded"), START_NS)
    box.post(StatusNotice(2, START_NS, "busy"), START_NS)
    taken = []
    while notice := box.due(START_NS):
        taken.append(notice)
        box.sent(notice, START_NS)
    assert [notice.number for notice in taken] == [1, 2]
    assert isinstance(taken[0], StatusNotice)
    assert taken[0].condition == "wounded"


def test_a_flood_drops_the_oldest_of_the_least_urgent() -> None:
    box = Outbox()
    for second in range(CAPACITY):
        box.post(ObservationNotice(1, START_NS + second * S, 59.0, 18.0, 5.0), START_NS)
    box.post(alert(), START_NS)
    assert box.dropped == 1
    assert box.due(START_NS) == alert()
    box.sent(alert(), START_NS)
    left = [
        waiting.notice.time_ns for waiting in box._waiting if isinstance(waiting.notice, ObservationNotice)
    ]
    assert left == [START_NS + second * S for second in range(1, CAPACITY)]


def radio_net(rate_bits_per_s: int = 9600, mtu_bytes: int = 250, header_bytes: int = 28) -> RadioNet:
    """The net of soldier 1."""
    profile = LinkProfile(
        name="squad", rate_bits_per_s=rate_bits_per_s, mtu_bytes=mtu_bytes, header_bytes=header_bytes
    )
    keys = NetKeys(GROUP_KEY, "squad", 8)
    policy = Policy(threshold_m=5.0, heartbeat_s=30.0, confirm_s=5.0, gather_s=0.0)
    return RadioNet(profile, policy, 1, Codec(ORIGIN), Sealer(keys, 1, MemoryCounters()), Opener(keys))


def receiver() -> RadioNet:
    """The net of soldier 2."""
    keys = NetKeys(GROUP_KEY, "squad", 8)
    profile = LinkProfile(name="squad", rate_bits_per_s=9600)
    return RadioNet(
        profile,
        Policy(5.0, 30.0, 5.0, 0.0),
        2,
        Codec(ORIGIN),
        Sealer(keys, 2, MemoryCounters()),
        Opener(keys),
    )


@given(
    st.sampled_from([300, 1200, 9600]),
    st.integers(40, 250),
    st.sampled_from([0, 28]),
    st.lists(st.tuples(st.integers(0, 60), st.integers(-400, 400), st.booleans()), min_size=1, max_size=40),
)
@settings(max_examples=40, deadline=None)
def test_no_frame_is_longer_than_the_link_takes_and_the_budget_holds(
    rate: int, mtu_bytes: int, header_bytes: int, events: list[tuple[int, int, bool]]
) -> None:
    net, hearing = radio_net(rate, mtu_bytes, header_bytes), receiver()
    now_ns = START_NS
    sent: list[tuple[int, int]] = []
    for tenths, north_m, alarm in events:
        now_ns += tenths * S // 10
        if alarm:
            net.post(AlertNotice(1, now_ns, "fire", "é" * 200), now_ns)
        squad = [
            replace(at(number, 0.0, north_m * number / 5, height_m=60.0 + number), time_ns=now_ns)
            for number in range(1, 31)
        ]
        for frame in net.speak(squad, now_ns):
            assert len(frame) <= mtu_bytes
            assert hearing.hear(frame, now_ns, NUMBERS, exercise=False) is not None
            sent.append((now_ns, 8 * (len(frame) + header_bytes)))
    for first, (begin_ns, _) in enumerate(sent):
        total = 0
        for end_ns, bits in sent[first:]:
            total += bits
            assert total * S <= rate * (end_ns - begin_ns) + max(4000, 2 * rate) * S


@pytest.mark.parametrize("header_bytes", [0, 28])
def test_a_flooded_link_carries_its_rate_header_bytes_included_and_no_more(header_bytes: int) -> None:
    net, bits = radio_net(1200, header_bytes=header_bytes), 0
    for tenth in range(2001):
        now_ns = START_NS + tenth * S // 10
        net.post(AlertNotice(1, now_ns, "fire", "x" * (tenth % 100)), now_ns)
        bits += sum(8 * (len(frame) + header_bytes) for frame in net.speak([], now_ns))
    assert 1200 * 198 < bits <= 1200 * 200


def test_while_an_alert_waits_for_its_bits_nothing_else_is_sent() -> None:
    net = radio_net(rate_bits_per_s=300)
    net.speak([], START_NS)
    net.post(alert(text="x" * 100), START_NS)
    assert net.speak([at(1, 0.0)], START_NS + 2 * S) == []  # 600 bits would pay for the report
    frames = net.speak([at(1, 0.0)], START_NS + 20 * S)
    kinds = [receiver_kind(frame) for frame in frames]
    assert kinds == ["AlertNotice", "Reports"]


def receiver_kind(frame: bytes) -> str:
    heard = receiver().hear(frame, START_NS, NUMBERS, exercise=False)
    assert heard is not None
    return type(heard[1]).__name__


def test_what_does_not_fit_one_frame_follows_in_the_next() -> None:
    net, hearing = radio_net(mtu_bytes=60), receiver()
    squad = [at(number, 0.0, north_m=7.0 * number) for number in range(1, 21)]
    told: set[int] = set()
    for step in range(100):
        for frame in net.speak(squad, START_NS + step * S):
            heard = hearing.hear(frame, START_NS, NUMBERS, exercise=False)
            assert heard is not None
            assert isinstance(heard[1], Reports)
            told |= {report.number for report in heard[1].reports}
    assert told == set(range(1, 21))


@pytest.mark.parametrize("spoil", ["sender", "exercise", "echo", "garbage"])
def test_what_is_not_for_us_is_counted_by_its_cause(spoil: str) -> None:
    net, hearing = radio_net(), receiver()
    net.speak([], START_NS)
    frame = net.speak([at(1, 0.0)], START_NS + 10 * S)[0]
    known = [5] if spoil == "sender" else NUMBERS
    ear = net if spoil == "echo" else hearing
    data = b"\xff" * 30 if spoil == "garbage" else frame
    assert ear.hear(data, START_NS, known, exercise=spoil == "exercise") is None
    causes = {"sender": "unknown_sender", "exercise": "exercise", "echo": "own_echo", "garbage": "version"}
    assert dict(ear.meter.rejected) == {causes[spoil]: 1}
    assert ear.report(START_NS).frames_rejected == (0 if spoil == "echo" else 1)
