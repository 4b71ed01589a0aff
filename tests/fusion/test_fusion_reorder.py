"""The reorder buffer: sorted whatever the order of arrival, bounded in time and size, not fooled by one stamp."""

from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.messages import FootPose
from fusion.pulse import LivePulse, ReplayPulse
from fusion.reorder import Arrival, Promise, ReorderBuffer

WINDOW = 300
S = 1_000_000_000


def message(time_ns: int, sequence: int = 0) -> FootPose:
    return FootPose(
        time_ns=time_ns,
        sequence=sequence,
        step_sequence=0,
        displacement_m=(0.0, 0.0, 0.0),
        heading_change_rad=0.0,
        speed_m_s=0.0,
        in_stance=True,
    )


def buffer(
    expected: str = "", drivers: str = "ab", patience: int = 2000, capacity: int = 4096
) -> ReorderBuffer:
    pulse = LivePulse(frozenset(drivers), WINDOW, patience)
    return ReorderBuffer(pulse, frozenset(expected), capacity)


def released(buffer: ReorderBuffer) -> list[tuple[int, str, int]]:
    return [(waiting.time_ns, waiting.source, waiting.sequence) for waiting in buffer.release()]


@st.composite
def delayed_streams(draw: st.DrawFn) -> list[tuple[int, str, FootPose]]:
    """Messages of sources a, b and g, each delayed by less than the window: (arrival, source, message)."""
    arrivals = []
    for source in "abg":
        times = sorted(draw(st.lists(st.integers(0, 3000), max_size=25)))
        first = draw(st.integers(0, 3))
        for number, time_ns in enumerate(times):
            delay = draw(st.integers(0, WINDOW - 1))
            arrivals.append((time_ns + delay, source, message(time_ns, first + number)))
    return sorted(arrivals, key=lambda item: item[0])


@given(arrivals=delayed_streams(), expected=st.sampled_from(["", "abg"]))
@settings(max_examples=150)
def test_any_order_of_arrival_within_the_window_gives_the_same_order(
    arrivals: list[tuple[int, str, FootPose]], expected: str
) -> None:
    taken: list[tuple[int, str, int]] = []
    held = buffer(expected, drivers="abg", patience=10**6)
    for _, source, item in arrivals:
        verdict = held.push(source, item)
        assert verdict is not Arrival.LATE
        taken += released(held)
    held.flush()
    taken += released(held)
    assert taken == sorted({(item.time_ns, source, item.sequence) for _, source, item in arrivals})


@given(
    stamps=st.lists(
        st.tuples(st.sampled_from("abgx"), st.integers(-(10**12), 10**12), st.integers(0, 5)), max_size=80
    )
)
@settings(max_examples=200)
def test_any_garbage_of_stamps_is_released_in_order_at_most_once(stamps: list[tuple[str, int, int]]) -> None:
    held, taken, low = buffer("ab"), [], None
    for source, time_ns, sequence in stamps:
        held.push(source, message(time_ns, sequence))
        assert low is None or held.low_ns >= low
        low = held.low_ns
        taken += released(held)
    assert taken == sorted(taken)
    assert all(time_ns < held.low_ns for time_ns, _, _ in taken)


def test_nothing_is_waited_for_once_all_expected_sources_are_past_it() -> None:
    held = buffer("ab")
    held.push("a", message(1000, 0))
    held.push("b", message(1010, 0))
    assert released(held) == []  # a's next message may still be stamped 1000
    held.push("a", message(1020, 1))
    assert released(held) == [(1000, "a", 0)]
    assert held.low_ns == 1010


def test_a_hole_in_the_sequence_holds_the_watermark_until_the_window_passes() -> None:
    held = buffer("ab")
    for time_ns in (1000, 1010, 1020):
        held.push("b", message(time_ns, (time_ns - 1000) // 10))
    held.push("a", message(1000, 0))
    held.push("a", message(1020, 2))  # 1 is missing
    assert held.low_ns == 1000
    held.push("a", message(1010, 1))
    assert held.low_ns == 1020
    held.push("a", message(1030, 4))  # 3 never comes
    held.push("b", message(1020 + WINDOW + 20, 3))
    assert held.low_ns == 1040
    assert released(held)[-1] == (1030, "a", 4)


def test_a_promise_counts_once_the_promised_message_is_there() -> None:
    held = buffer("ab")
    held.push("b", message(2000, 0))
    held.push("b", message(2001, 1), Promise("a", 0, 1900))
    assert held.low_ns == 2001 - WINDOW
    held.push("a", message(1850, 0))
    assert held.low_ns == 1900
    assert released(held) == [(1850, "a", 0)]


def test_late_and_double_messages_are_told_apart() -> None:
    held = buffer("")
    assert held.push("a", message(1000, 0)) is Arrival.QUEUED
    assert held.push("a", message(1000, 0)) is Arrival.DUPLICATE
    held.push("a", message(2000, 1))
    assert held.push("b", message(2000 - WINDOW - 1, 0)) is Arrival.LATE
    assert held.push("b", message(2000 - WINDOW, 1)) is Arrival.QUEUED


def test_others_wait_for_the_drivers_but_not_for_ever() -> None:
    held = buffer("", drivers="a", patience=2000)
    held.push("a", message(1000, 0))
    for number in range(20):
        held.push("g", message(1000 + 100 * number, number))
    assert held.low_ns == 1000 - WINDOW  # a receiver ahead of the boots does not make them late
    held.advance(3000)
    assert held.low_ns == 1000 - WINDOW
    held.advance(3001)
    assert (
        held.low_ns == 3001 - WINDOW
    )  # silence for longer than the patience: no more doubt, and no more wait
    held.advance(3400)
    assert held.low_ns == 3400 - WINDOW
    assert held.push("a", message(3400 - WINDOW, 1)) is Arrival.QUEUED  # awake again
    held.push("a", message(3500, 2))
    held.advance(3500)
    held.advance(5500)
    assert held.low_ns == 3500 - WINDOW  # and worth a new patience


def test_before_the_drivers_were_ever_heard_the_patience_stands_for_the_doubt_about_clocks() -> None:
    held = buffer("", drivers="a", patience=2 * S)
    held.push("g", message(8 * S, 0))
    for second in range(10, 20):
        held.advance(second * S)
    assert held.low_ns == 17 * S
    assert held.push("g", message(17 * S, 1)) is Arrival.QUEUED  # a receiver two seconds behind the host


def test_one_stamp_from_the_future_carries_nobody_along() -> None:
    held = buffer("a", drivers="a")
    held.push("a", message(1 * S, 0))
    held.push("a", message(1_000_000 * S, 1))
    held.push("a", message(2 * S, 2))
    held.push("a", message(3 * S, 3))
    assert held.low_ns <= 3 * S
    assert [time_ns for time_ns, _, _ in released(held)] == [1 * S, 2 * S]
    held.flush()
    assert [time_ns for time_ns, _, _ in released(held)] == [3 * S]


def test_a_source_that_begins_anew_is_followed() -> None:
    held = buffer("a", drivers="a")
    for number in range(5):
        held.push("a", message(1000 + number, number))
    held.push("a", message(1100, 0))
    held.push("a", message(1110, 1))
    assert held.low_ns == 1110


def test_size_is_bounded() -> None:
    held = buffer("", capacity=10)
    verdicts = [held.push("a", message(number, number)) for number in range(12)]
    assert verdicts.count(Arrival.OVERFLOW) == 2
    assert len(held) == 10


def test_what_would_be_released_last_gives_way_when_there_is_no_room() -> None:
    held = buffer("", drivers="a", capacity=3)
    held.push("a", message(0, 0))
    for number in range(5):
        held.push("g", message(1000 + number, number))  # waits for the boots, and waits
    assert held.push("a", message(100, 1)) is Arrival.QUEUED
    assert held.evicted == 1
    held.push("a", message(500, 2))
    assert released(held) == [(0, "a", 0), (100, "a", 1)]


def test_a_receiver_far_ahead_of_boots_and_host_is_refused_however_often_it_says_so() -> None:
    held = buffer("", drivers="a", patience=2 * S)
    for second in range(1, 60):
        assert held.push("a", message(second * S, second)) is Arrival.QUEUED
        held.advance(second * S)
        assert held.push("g", message((second + 3600) * S, second)) is Arrival.IMPLAUSIBLE
    assert held.low_ns == 59 * S - WINDOW
    assert {source for _, source, _ in released(held)} == {"a"}
    assert len(held) == 1


def test_silence_is_measured_on_each_clock_by_itself() -> None:
    """A receiver five seconds ahead does not overrule boots that speak; once they are silent it counts seconds."""
    held = buffer("", drivers="a", patience=2 * S)
    for second in range(10):
        held.push("a", message(second * S, second))
        held.push("g", message((second + 5) * S, second))
        assert held.low_ns == second * S - WINDOW
    for second in range(10, 13):
        held.push("g", message((second + 5) * S, second))
    assert held.low_ns == 9 * S + 3 * S - WINDOW


def test_boots_that_leap_ahead_are_followed_once_they_insist_and_nothing_is_lost() -> None:
    held = buffer("a", drivers="a")
    for second in range(5):
        held.push("a", message(second * S, second))
    verdicts = [held.push("a", message((100 + second) * S, 5 + second)) for second in range(30)]
    assert verdicts == [Arrival.IMPLAUSIBLE] * 24 + [Arrival.QUEUED] * 6
    held.flush()
    assert [sequence for _, _, sequence in released(held)] == list(range(35))


def test_boots_that_leap_ahead_with_the_host_are_followed_at_once() -> None:
    held = buffer("", drivers="a", patience=2 * S)
    held.advance(0)
    held.push("a", message(0, 0))
    held.advance(3600 * S)
    assert held.push("a", message(3600 * S, 1)) is Arrival.QUEUED
    assert held.low_ns == 3600 * S - WINDOW


def test_boots_whose_clock_is_set_back_ask_for_a_restart_only_when_they_insist() -> None:
    held = buffer("a", drivers="a")
    for second in range(100, 105):
        held.push("a", message(second * S, second))
    for second in range(24):
        assert held.push("a", message(second * S, 200 + second)) is Arrival.LATE
        assert held.set_back_ns is None
    held.push("a", message(24 * S, 224))
    assert held.set_back_ns == 24 * S
    assert held.restart(24 * S) == (24 - 104) * S
    held.push("a", message(25 * S, 225))
    held.push("a", message(26 * S, 226))
    assert held.low_ns == 26 * S - WINDOW


def test_a_backlog_after_silence_is_late_and_no_set_back() -> None:
    held = buffer("a", drivers="a", patience=2 * S)
    held.push("a", message(0, 0))
    for second in range(1, 100):
        held.advance(second * S)
    assert held.low_ns == 99 * S - WINDOW
    verdicts = {held.push("a", message(second * S, second)) for second in range(1, 80)}
    assert verdicts == {Arrival.LATE}
    assert held.set_back_ns is None


def test_in_a_replay_sources_wait_for_one_another_whatever_they_are_apart() -> None:
    held = ReorderBuffer(ReplayPulse(frozenset("a")), frozenset("ag"), capacity=None)
    for number in range(5000):
        assert held.push("g", message(number * S, number)) is Arrival.QUEUED
        held.advance(number * S)
    assert released(held) == []
    for number in range(5):
        held.push("a", message(number * S, number))
    assert [time_ns for time_ns, _, _ in released(held)] == [0, 0, *sorted([S, 2 * S, 3 * S] * 2)]
    held.flush()
    assert len(released(held)) == 1 + 4996
