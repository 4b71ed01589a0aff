"""Notices on their way: priority, repetition until acknowledged, acknowledgements gathered, long texts in parts."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.bus import Envelope
from bootprint.messages import Alert, Message, Observation
from proving_ground.radio_trials.delivery import Room, Trial, alerts
from sa_hub.radio.answers import Answers
from sa_hub.radio.content import AlertNotice, ObservationNotice, StatusNotice
from sa_hub.radio.control import MOST_ACKNOWLEDGED, Acknowledgement, Asked, Fragment
from sa_hub.radio.fragments import CAPACITY as MOST_COLLECTED
from sa_hub.radio.fragments import HEAD_BYTES, KEEP_NS, Collector, Cutter
from sa_hub.radio.outbox import CAPACITY, Outbox, Sending
from support.hub_squad import GROUP_KEY, ORIGIN, START_NS, Air, S, Walk, hub, link, own_identity
from support.radio_ear import RadioEar


def alert(seconds: float = 0.0, text: str = "") -> AlertNotice:
    return AlertNotice(1, START_NS + round(seconds * S), "contact", text)


def observation(seconds: float = 0.0) -> ObservationNotice:
    return ObservationNotice(1, START_NS + round(seconds * S), 59.0, 18.0, 5.0)


def sent_times(box: Outbox, members: list[int], until_s: int) -> list[float]:
    """When what is in the box goes out, counted 0, 1, 2, …"""
    times = []
    for tenth in range(10 * until_s):
        now_ns = START_NS + tenth * S // 10
        if sending := box.due(now_ns, members):
            sending.sent(now_ns, len(times))
            times.append(tenth / 10)
    return times


def test_alerts_go_before_observations_before_status() -> None:
    box = Outbox("seed")
    order = []
    for notice in (StatusNotice(1, START_NS, "ok"), observation(), alert()):
        box.post(notice, START_NS)
    while sending := box.due(START_NS, []):
        order.append(type(sending.content))
        sending.sent(START_NS, len(order))
    assert order == [AlertNotice, ObservationNotice, StatusNotice]


def test_an_alert_is_repeated_with_growing_pauses_and_given_up_after_a_minute() -> None:
    box = Outbox("seed")
    box.post(alert(), START_NS)
    times = sent_times(box, [2], 200)
    pauses = [late - early for early, late in pairwise(times)]
    # 0.5 s · 1.25^k, each a fifth more or less, seen on a grid of 0.1 s.
    for index, pause in enumerate(pauses):
        assert 0.8 * 0.5 * 1.25**index <= pause + 1e-9
        assert pause <= 1.2 * 0.5 * 1.25**index + 0.1
    assert sum(time <= 9.1 for time in times) >= 8
    assert times[-1] <= 60.0 <= times[-1] + 1.2 * pauses[-1] * 1.25
    assert box.given_up == 1


def test_a_status_is_said_once_and_a_new_one_takes_the_place_of_one_still_waiting() -> None:
    box = Outbox("seed")
    box.post(StatusNotice(1, START_NS, "ok"), START_NS)
    box.post(StatusNotice(1, START_NS + S, "wounded"), START_NS)
    box.post(StatusNotice(2, START_NS, "busy"), START_NS)
    taken: list[object] = []
    while sending := box.due(START_NS, [5]):
        taken.append(sending.content)
        sending.sent(START_NS, len(taken))
    assert taken == [StatusNotice(1, START_NS + S, "wounded"), StatusNotice(2, START_NS, "busy")]
    assert box.given_up == 0


def test_an_alert_rests_once_everybody_heard_lately_has_acknowledged_any_of_its_frames() -> None:
    box = Outbox("seed")
    box.post(alert(), START_NS)
    for counter in (300, 301):
        sending = box.due(START_NS + (counter - 300) * 5 * S, [2, 3])
        assert sending is not None
        sending.sent(START_NS, counter)
    box.acknowledged(2, 300 % 256)
    box.acknowledged(3, 99)  # another frame
    assert box.due(START_NS + 30 * S, [2, 3]) is not None
    box.acknowledged(3, 301 % 256)
    assert box.due(START_NS + 30 * S, [2, 3]) is None
    assert box.given_up == 0
    assert box.due(START_NS + 40 * S, [2, 3]) is None


def send_all(box: Outbox, after_s: int, counter: int) -> None:
    """Send what is due, in frames that count on from ``counter``."""
    while sending := box.due(START_NS + after_s * S, []):
        sending.sent(START_NS + after_s * S, counter)
        counter += 1


def test_an_acknowledgement_is_not_of_an_older_frame_with_the_same_low_bits() -> None:
    """On a fast net 256 frames are ten seconds, and an alert that nobody has heard is still being repeated."""
    box = Outbox("seed")
    box.post(alert(0), START_NS)
    send_all(box, 0, 300)
    box.post(alert(5), START_NS)
    send_all(box, 5, 300 + 255)
    box.acknowledged(2, (300 + 256) % 256)
    sending = box.due(START_NS + 30 * S, [2])
    assert sending is not None


@pytest.mark.parametrize("counters", [(3,), (3, 301)])
def test_an_acknowledgement_is_not_of_an_earlier_epochs_frame_with_the_same_low_bits(
    counters: tuple[int, ...],
) -> None:
    box = Outbox("seed")
    box.post(alert(0), START_NS)
    send_all(box, 0, 300)
    for counter in counters:  # of the next epoch
        box.post(alert(counter), START_NS)
        send_all(box, 0, counter)
    box.acknowledged(2, 300 % 256)
    sending = box.due(START_NS + 30 * S, [2])
    assert sending is not None
    assert sending.content == alert(0)
    assert sending.content == alert(0)


def test_an_alert_that_nobody_was_there_to_hear_waits_for_the_first_who_comes() -> None:
    box = Outbox("seed")
    box.post(alert(), START_NS)
    assert len(sent_times(box, [], 20)) > 5
    box.acknowledged(7, 3)
    assert box.due(START_NS + 20 * S, [7]) is None
    assert box.given_up == 0


def test_those_who_are_missing_are_asked_by_name_when_they_are_few() -> None:
    box = Outbox("seed")
    members = list(range(2, 12))
    box.post(alert(), START_NS)
    asked = []
    for turn in range(4):
        sending = box.due(START_NS + 10 * turn * S, members)
        assert sending is not None
        asked.append(sending.asked)
        sending.sent(START_NS, turn)
        for number in members[3 * turn : 3 * turn + 3]:
            box.acknowledged(number, turn)
    assert asked == [Asked(), Asked(), Asked((8, 9, 10, 11)), Asked((11,))]


def test_a_flood_drops_the_oldest_of_the_least_urgent() -> None:
    box = Outbox("seed")
    for second in range(CAPACITY):
        box.post(observation(second), START_NS)
    box.post(alert(), START_NS)
    assert box.dropped == 1
    left = []
    while sending := box.due(START_NS, []):
        left.append(sending.content)
        sending.sent(START_NS, len(left))
    assert left == [alert(), *(observation(second) for second in range(1, CAPACITY))]


# -- acknowledgements -----------------------------------------------------------------------------------------


def told(sending: Sending | None) -> tuple[tuple[int, int], ...]:
    """What an acknowledgement tells."""
    assert sending is not None
    assert isinstance(sending.content, Acknowledgement)
    return sending.content.heard


def test_acknowledgements_wait_a_moment_and_then_go_in_one_frame() -> None:
    answers = Answers("seed")
    answers.owe(5, "alert", 1000, START_NS, by_name=False)
    answers.owe(5, "alert", 1003, START_NS + S // 20, by_name=False)
    answers.owe(6, "observation", 7, START_NS + S // 20, by_name=False)
    assert answers.due(START_NS + S // 20) is None
    sending = answers.due(START_NS + 2 * S)
    assert told(sending) == ((5, 1003 % 256), (6, 7))
    assert sending is not None
    sending.sent(START_NS + 2 * S, 1)
    assert answers.due(START_NS + 9 * S) is None


def test_who_has_just_acknowledged_does_so_again_only_when_asked_by_name_or_later() -> None:
    answers = Answers("seed")
    answers.owe(5, "alert", 1, START_NS, by_name=False)
    sending = answers.due(START_NS + 2 * S)
    assert sending is not None
    sending.sent(START_NS + 2 * S, 1)
    answers.owe(5, "alert", 2, START_NS + 3 * S, by_name=False)
    assert answers.due(START_NS + 9 * S) is None
    answers.owe(5, "alert", 3, START_NS + 3 * S, by_name=True)
    assert told(answers.due(START_NS + 9 * S)) == ((5, 3),)
    answers.owe(5, "alert", 4, START_NS + 5 * S, by_name=False)
    assert told(answers.due(START_NS + 9 * S)) == ((5, 4),)


def test_many_acknowledgements_go_in_several_frames_and_a_flood_is_bounded() -> None:
    answers = Answers("seed")
    for sender in range(1000):
        answers.owe(sender, "alert", 1, START_NS, by_name=False)
    frames = []
    while sending := answers.due(START_NS + 2 * S):
        frames.append(told(sending))
        sending.sent(START_NS, 1)
    assert [len(frame) for frame in frames] == [MOST_ACKNOWLEDGED] * 8
    assert frames[-1][-1] == (999, 1)


# -- long texts -----------------------------------------------------------------------------------------------


def unheeded(_now_ns: int) -> None:
    """Nobody waits for this acknowledgement."""


@given(st.binary(min_size=1, max_size=400), st.integers(24, 250), st.randoms(use_true_random=False))
@settings(deadline=None)
def test_a_payload_in_parts_is_put_together_in_any_order_with_repeats(data: bytes, limit: int, rng) -> None:  # type: ignore[no-untyped-def]
    size = limit - HEAD_BYTES
    data = data[: 16 * size]
    parts = Cutter().cut(data, limit)
    arriving = parts + parts[: len(parts) // 2]
    rng.shuffle(arriving)
    collector, whole = Collector(), []
    for part in arriving:
        payload = collector.add(7, part, START_NS, unheeded)
        if payload is not None:
            whole.append(payload)
    assert all(len(part.data) <= size for part in parts)
    assert whole[0] == data


def test_parts_are_kept_neither_long_nor_in_great_number() -> None:
    collector = Collector()
    assert collector.add(7, Fragment(1, 0, 1, b"a"), START_NS, unheeded) is None
    assert collector.add(7, Fragment(1, 1, 1, b"b"), START_NS + KEEP_NS + 1, unheeded) is None
    for sender in range(1000):
        collector.add(sender, Fragment(1, 0, 15, bytes(255)), START_NS + KEEP_NS + 1, unheeded)
    assert len(collector) <= MOST_COLLECTED


def test_parts_are_acknowledged_when_all_are_there_and_again_when_one_is_repeated() -> None:
    collector, acknowledged = Collector(), list[tuple[str, int]]()

    def hear(index: int, name: str, now_ns: int, source: int = 7) -> bytes | None:
        part = Fragment(1, index, 1, b"ab"[index : index + 1])
        return collector.add(source, part, now_ns, lambda at_ns: acknowledged.append((name, at_ns)))

    assert hear(0, "first", START_NS) is None
    assert hear(0, "first, repeated", START_NS + S) is None
    assert acknowledged == []
    assert hear(1, "last", START_NS + 2 * S) == b"ab"
    assert acknowledged == [("first, repeated", START_NS + 2 * S), ("last", START_NS + 2 * S)]
    assert hear(0, "ours got lost", START_NS + 3 * S) is None
    assert acknowledged[2:] == [("ours got lost", START_NS + 3 * S)]
    assert hear(0, "of another payload", START_NS + 3 * S, source=8) is None
    assert len(acknowledged) == 3


def said(soldier: str, subject: str, message: Message) -> Envelope:
    return Envelope(own_identity(soldier).address(subject, "people"), message)


def test_an_observation_too_long_for_the_link_arrives_whole_under_loss_and_once() -> None:
    narrow = link("squad", mtu_bytes=60)
    air = Air({name: hub(name, narrow) for name in ("a1", "a2", "a3")}, loss=0.3, seed=4)
    walks = {name: Walk(east_m=9.0) for name in air.hubs}
    air.run(20.0, walks)
    text = "två fordon och en tiltad skåpvagn bakom ladan, fyra man, " * 3
    air.say(
        said(
            "a1",
            "observation",
            Observation(
                time_ns=air.now_ns,
                soldier="a1",
                latitude_deg=59.36,
                longitude_deg=18.05,
                accuracy_m=7.0,
                text=text,
                code="vehicle",
            ),
        )
    )
    air.run(60.0, walks)
    assert max(len(data) for _, _, _, data in air.log) <= 60
    for name in ("a2", "a3"):
        seen = [
            e.message
            for hub_name, e in air.outputs
            if hub_name == name and isinstance(e.message, Observation)
        ]
        assert [(each.text, each.code) for each in seen] == [(text, "vehicle")]


# -- all of it on the air -------------------------------------------------------------------------------------


def test_alerts_reach_everybody_in_time_at_thirty_percent_loss_while_positions_flow() -> None:
    figure = alerts(Room(soldiers=6), seeds=[1], count=12)
    assert figure.n == 72
    assert figure.never == 0
    # One in 15,000 misses all eight frames of the first 7.5 s.
    assert figure.within_pct == 100.0


def test_an_alert_stamped_ahead_of_time_goes_at_once_though_it_comes_before_the_first_tick() -> None:
    core, ear = hub("a1", link("squad")), RadioEar("squad", GROUP_KEY, ORIGIN)
    core.handle(said("a1", "alert", Alert(time_ns=START_NS + 300 * S, soldier="a1", kind="help")))
    heard = []
    for tenth in range(1, 51):
        now_ns = START_NS + tenth * S // 10
        core.tick(now_ns)
        frames = [ear.content(frame.data, now_ns) for frame in core.take_frames()]
        heard += [tenth for frame in frames if frame is not None and isinstance(frame[1], AlertNotice)]
    assert heard[0] <= 2, "the budget begins with the first tick"
    assert len(heard) > 3, "and is repeated"


def test_an_alert_goes_at_once_though_all_else_uses_up_the_budget() -> None:
    """At 100 bit/s observations take all but the 576 bits that are kept; the alert takes 448, in full 496."""
    core = hub("a1", link("squad", 100, header_bytes=0))
    help_wanted = Alert(time_ns=START_NS + 110 * S, soldier="a1", kind="help", text="x" * 40)
    for tenth in range(1101):
        now_ns = START_NS + tenth * S // 10
        if tenth % 10 == 0:
            core.handle(said("a1", "observation", drone(now_ns)))
        if tenth == 1100:
            assert len(core.take_frames()) > 30
            core.handle(said("a1", "alert", help_wanted))
        core.tick(now_ns)
    assert [len(frame.data) for frame in core.take_frames()] in ([56], [62])


def test_answers_to_others_leave_room_for_an_alert_of_our_own() -> None:
    """At 100 bit/s somebody has something to acknowledge every half second; of 576 bits 288 are kept from that."""
    core = hub("a1", link("squad", 100, header_bytes=0))
    answers = core._nets["squad"].correspondence._answers
    for tenth in range(1101):
        now_ns = START_NS + tenth * S // 10
        if tenth % 5 == 0:
            answers.owe(2, tenth, tenth, now_ns, by_name=True)
        if tenth == 1100:
            assert len(core.take_frames()) > 60
            core.handle(said("a1", "alert", Alert(time_ns=now_ns, soldier="a1", kind="help", text="x" * 14)))
        core.tick(now_ns)
    assert [len(frame.data) for frame in core.take_frames()] in ([30], [36])


def drone(time_ns: int) -> Observation:
    """Somebody of a1 saw one."""
    return Observation(
        time_ns=time_ns, soldier="a1", latitude_deg=59.0, longitude_deg=18.0, accuracy_m=3.0, code="drone"
    )


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_once_acknowledged_an_alert_costs_nothing_more(seed: int) -> None:
    alerted, quiet = (Trial(Room(soldiers=4, loss=0.0), seed=seed) for _ in range(2))
    for trial in (alerted, quiet):
        trial.start(trial.room.names)
        trial.run(60.0)
    alerted.say("a1", Alert(time_ns=alerted.now_ns, soldier="a1", kind="fire"))

    def spent_more() -> int:
        return sum(alerted.bits.values()) - sum(quiet.bits.values())

    for trial in (alerted, quiet):
        trial.run(90.0)
    # Three frames of 22 bytes at most before all four have answered, each with 20 bytes, and once more if the third
    # frame named him while his answer waited (headers in full, for bits are plenty), and what chance adds.
    during = spent_more()
    assert during <= 8 * (3 * 22 + 2 * 4 * 20) + 400
    for trial in (alerted, quiet):
        trial.run(90.0)
    assert (
        spent_more() - during <= 400
    )  # chance alone: one more frame of the alert with its answers would be 800
