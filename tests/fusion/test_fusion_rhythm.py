"""Steady sources: expected at their next turn, not between, and not once they have fallen silent."""

from bootprint.messages import FootPose
from fusion.pulse import LivePulse
from fusion.reorder import Arrival, ReorderBuffer
from fusion.rhythm import Rhythm

S = 1_000_000_000
WINDOW = 3 * S // 10


def message(time_ns: int, sequence: int) -> FootPose:
    return FootPose(
        time_ns=time_ns,
        sequence=sequence,
        step_sequence=0,
        displacement_m=(0.0, 0.0, 0.0),
        heading_change_rad=0.0,
        speed_m_s=0.0,
        in_stance=True,
    )


class Walk:
    """A boot's ten messages a second, and a steady receiver ``g``."""

    def __init__(self, expected: str) -> None:
        pulse = LivePulse(frozenset("a"), WINDOW, 2 * S)
        self.buffer = ReorderBuffer(pulse, frozenset(expected), is_steady=lambda name: name == "g")
        self._sent = {"a": 0, "g": 0}

    def say(self, source: str, time_s: float) -> Arrival:
        self._sent[source] += 1
        return self.buffer.push(source, message(round(time_s * S), self._sent[source] - 1))

    def boot(self, from_s: int, to_s: int) -> None:
        for tenth in range(10 * from_s + 1, 10 * to_s + 1):
            self.say("a", tenth / 10)

    def walk(self, from_s: int, to_s: int) -> None:
        """With a fix at every full second."""
        for second in range(from_s, to_s):
            self.boot(second, second + 1)
            self.say("g", second + 1)

    @property
    def sure_s(self) -> float:
        return self.buffer.low_ns / S


def test_a_rhythm_is_the_shortest_of_the_last_intervals() -> None:
    rhythm = Rhythm()
    for time_ns in (0, 1000, 3000, 4000):
        rhythm.hear(time_ns)
    assert (rhythm.is_kept, rhythm.rest_ns) == (False, 0)
    rhythm.hear(3500)  # behind: tells nothing
    rhythm.hear(5000)
    assert (rhythm.is_kept, rhythm.rest_ns) == (True, 800)
    for time_ns in (7000, 9000, 11_000, 13_000):
        rhythm.hear(time_ns)
    assert rhythm.rest_ns == 1600


def test_one_fix_between_two_turns_does_not_make_the_next_one_missed() -> None:
    rhythm = Rhythm()
    for tenths in (0, 10, 20, 30, 32):
        rhythm.hear(tenths * S // 10)
    assert rhythm.rest_ns == 16 * S // 100
    assert not rhythm.is_over(2 * S)
    assert rhythm.is_over(3 * S + 1)


def test_a_receiver_is_waited_for_at_its_turn_alone() -> None:
    walk = Walk("ag")
    walk.walk(0, 5)
    walk.say("a", 5.5)
    assert walk.sure_s == 5.5
    walk.say("a", 5.9)
    assert walk.sure_s == 5.8  # the fix of 6.0 might be stamped so
    walk.say("a", 6.05)
    assert walk.sure_s == 5.8
    assert walk.say("g", 5.85) is Arrival.QUEUED
    assert walk.sure_s == 6.05


def test_the_wait_at_its_turn_is_the_window_at_most() -> None:
    walk = Walk("ag")
    walk.walk(0, 5)
    walk.boot(5, 7)
    assert walk.sure_s == 7.0 - WINDOW / S


def test_who_has_missed_two_turns_is_waited_for_no_more_until_he_speaks_again() -> None:
    walk = Walk("ag")
    walk.walk(0, 5)
    walk.boot(5, 8)
    assert walk.sure_s == 8.0 - WINDOW / S
    walk.say("a", 8.1)
    assert walk.sure_s == 8.1
    assert walk.say("g", 8.0) is Arrival.LATE
    walk.boot(9, 10)
    assert walk.sure_s == 10.0 - WINDOW / S


def test_who_was_never_heard_is_waited_for_at_the_beginning() -> None:
    walk = Walk("ag")
    walk.boot(0, 3)
    assert walk.sure_s == 3.0 - WINDOW / S
    walk.boot(3, 4)
    assert walk.sure_s == 4.0


def test_a_steady_source_that_nobody_named_is_expected_once_it_keeps_its_rhythm() -> None:
    walk = Walk("a")
    walk.walk(0, 4)
    walk.say("a", 4.95)
    assert walk.sure_s == 4.95
    assert walk.say("g", 4.9) is Arrival.LATE
    walk.say("a", 5.8)
    assert walk.sure_s == 4.9 + 0.72  # the shortest interval was 0.9 s
    assert walk.say("g", 5.7) is Arrival.QUEUED
