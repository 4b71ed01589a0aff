"""Feedback in frames of its own: from who hears updates and has nothing to tell, for a share of the rate."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sa_hub.radio.content import Feedback, Report
from sa_hub.radio.counters import MemoryCounters
from sa_hub.radio.frame import Codec
from sa_hub.radio.lone_feedback import LEAST_PAUSE_S, PATIENCE_S, SHARE, LoneFeedback
from sa_hub.radio.net import RadioNet
from sa_hub.radio.scheduler import Policy
from sa_hub.radio.seal import NetKeys, Opener, Sealer
from sa_hub.settings import LinkProfile
from support.hub_squad import GROUP_KEY, ORIGIN, START_NS, S
from support.radio_reports import METRE_DEG

SENDER, POST = 1, 9
NUMBERS = range(1, 20)
RATE_BITS_PER_S = 60


def net(number: int, *, relays: bool) -> RadioNet:
    """A narrow net of this member; nobody has said what is lost on it."""
    profile = LinkProfile(name="squad", rate_bits_per_s=RATE_BITS_PER_S, header_bytes=0)
    keys = NetKeys(GROUP_KEY, "squad", 8)
    sealer = Sealer(keys, number, MemoryCounters())
    return RadioNet(profile, Policy(), number, Codec(ORIGIN), sealer, Opener(keys), relays=relays)


def squad(now_ns: int) -> list[Report]:
    """Six who walk to and fro, each for 20 s in turn."""
    walked_s = (now_ns - START_NS) / S
    return [
        Report(
            number=number,
            time_ns=now_ns,
            latitude_deg=ORIGIN.latitude_deg + 1.3 * METRE_DEG * abs((walked_s + 7 * number) % 40 - 20),
            longitude_deg=ORIGIN.longitude_deg + number * 1e-4,
            accuracy_m=1.0,
        )
        for number in range(SENDER, 7)
    ]


class Listened:
    """A sender and a post that misses every fifth frame or so, for some minutes; the post's frames all arrive."""

    def __init__(self, minutes: float, *, loss: float = 0.2) -> None:
        self.sender, self.post = net(SENDER, relays=True), net(POST, relays=True)
        self.fed_back: list[tuple[int, int]] = []
        rng, heard = random.Random(3), list[Report]()
        for tenth in range(round(600 * minutes)):
            now_ns = START_NS + tenth * S // 10
            for frame in self.sender.speak(squad(now_ns), now_ns):
                if rng.random() >= loss:
                    self.post.hear(frame, now_ns, NUMBERS, exercise=False)
            for frame in self.post.speak(heard, now_ns):
                self.fed_back.append((now_ns, 8 * len(frame)))
                self.sender.hear(frame, now_ns, NUMBERS, exercise=False)


@pytest.fixture(scope="module")
def listened() -> Listened:
    """Ten minutes of it."""
    return Listened(minutes=10.0)


@given(
    st.integers(0, 1023),
    st.integers(0, 255),
    st.integers(1, 8).flatmap(lambda n: st.tuples(st.just(4 * n), st.integers(0, 2 ** (4 * n) - 1))),
    st.booleans(),
)
def test_feedback_comes_back_alone(about: int, newest: int, heard: tuple[int, int], exercise: bool) -> None:
    codec, feedback = Codec(ORIGIN, exercise=exercise), Feedback(about, newest, *heard)
    payload = codec.encode(POST, feedback, 3, 99)
    # kind, exercise, about, newest and span are 26 bits
    assert len(payload) == -(-(26 + heard[0]) // 8)
    frame = codec.decode(POST, payload, START_NS)
    assert (frame.exercise, frame.content, frame.asked) == (exercise, feedback, None)


def test_a_sender_learns_from_a_post_without_a_place_what_is_lost(listened: Listened) -> None:
    listeners = listened.sender.scheduler.listeners
    assert listeners.all_tell
    assert 0.1 < listeners.loss < 0.3
    proven = {soldier for listener, soldier, _ in listened.sender.scheduler.known_by_listeners()}
    assert proven == set(range(SENDER, 7))


def test_nobody_is_left_behind_for_long_though_no_loss_was_foreseen(listened: Listened) -> None:
    """Updates allow for what was missed; else a frame missed would leave it behind until the next in full."""
    told = listened.post.meter.frames_received
    assert told > 60
    assert listened.post.unresolved < told / 5


def test_lone_feedback_takes_no_more_than_its_share(listened: Listened) -> None:
    fed_back = listened.fed_back
    for first, (begin_ns, _) in enumerate(fed_back):
        total = 0
        for end_ns, bits in fed_back[first:]:
            total += bits
            # A header in full and a request now and then are beyond the frame that the pause is reckoned by.
            assert total * S <= 1.5 * SHARE * RATE_BITS_PER_S * (end_ns - begin_ns) + 400 * S
    assert len(fed_back) > 10


def test_where_nothing_is_lost_it_is_rare() -> None:
    lossless = Listened(minutes=10.0, loss=0.0)
    assert len(lossless.fed_back) <= 2 + lossless.post.meter.frames_received / 24
    assert lossless.sender.scheduler.listeners.all_tell


@pytest.mark.parametrize("telling", [False, True])
def test_it_waits_for_a_report_to_take_it_along(telling: bool) -> None:
    lone = LoneFeedback("squad|9", frame_s=0.1)
    waits_s = next(
        step / 10
        for step in range(1000)
        if lone.looks(step * S // 10) and lone.is_due(step * S // 10, waiting=True, telling=telling)
    )
    assert PATIENCE_S[telling] <= waits_s < PATIENCE_S[telling] + 0.6


def test_what_a_report_took_along_does_not_go_alone() -> None:
    lone = LoneFeedback("squad|9", frame_s=0.1)
    assert not lone.is_due(0, waiting=True, telling=True)
    lone.sent(9 * S, alone=False)
    assert not lone.is_due(12 * S, waiting=True, telling=True)
    assert lone.is_due(22 * S, waiting=True, telling=True)
    lone.sent(22 * S, alone=True)
    assert not lone.looks(22 * S + round(LEAST_PAUSE_S * S) - 1)
