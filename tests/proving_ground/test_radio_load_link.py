"""The shared link of a load test, the budget told from frames alone, and the picture's error, by hand."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bootprint.errors import ConfigError
from proving_ground.radio_load.budget_check import allowed_depth_bits, exceeds_budget
from proving_ground.radio_load.load import Load
from proving_ground.radio_load.picture_error import Errors, Seen, stay, straight_on
from proving_ground.radio_load.shared_link import QUEUE_FRAMES, SharedLink, air_bytes
from proving_ground.radio_load.squad_tracks import SquadTracks

NS_PER_S = 1_000_000_000


def test_a_frame_takes_its_airtime_and_the_latency() -> None:
    link = SharedLink(Load(), ["a", "b"])  # raw: 9600 bit/s, 50 ms
    link.send("a", 1, bytes(120), 1.0)
    (heard,) = link.arrived(10.0)
    assert heard.at_s == pytest.approx(1.0 + 120 * 8 / 9600 + 0.05)
    assert (heard.member, heard.sender, heard.message) == ("b", 1, bytes(120))


def test_senders_wait_for_each_other() -> None:
    link = SharedLink(Load(), ["r"])
    link.send("a", 1, b"x" * 120, 1.0)
    link.send("b", 2, b"y" * 120, 1.0)
    assert [heard.at_s for heard in link.arrived(10.0)] == pytest.approx([1.15, 1.25])


def test_a_full_queue_loses_the_newest() -> None:
    link = SharedLink(Load(), ["r"], rate_bits_per_s=8.0)  # a byte a second
    sent = [link.send("a", 1, bytes([index]) * 10, 0.0) for index in range(QUEUE_FRAMES + 2)]
    assert sent == [True] * QUEUE_FRAMES + [False] * 2
    assert link.dropped == 2
    assert link.send("b", 2, b"z", 0.0)  # another sender's queue is its own
    # The first is out after 10 s: then there is room again.
    assert link.send("a", 1, b"w", 10.5)


def test_long_messages_go_in_fragments() -> None:
    load = Load(link="udp", bitrate=1000)  # 28 bytes of header, MTU 250
    message = bytes(range(256)) * 3  # 768 bytes: 250 + 250 + 250 + 18
    assert air_bytes(load.medium, message) == 768 + 4 * 28
    link = SharedLink(load, ["r"])
    link.send("a", 1, message, 0.0)
    (heard,) = link.arrived(10.0)
    assert heard.message == message
    assert heard.at_s == pytest.approx((768 + 4 * 28) * 8 / 9600 + load.latency_s)


def test_a_lost_fragment_loses_the_message() -> None:
    link = SharedLink(Load(loss=0.3, link="udp", bitrate=1000), ["r"])
    for index in range(400):
        link.send("a", 1, bytes(700), 10.0 * index)  # three fragments: 0.7³ = 34 %
    share = len(link.arrived(1e6)) / 400
    assert 0.25 < share < 0.44


def test_loss_is_the_same_for_the_same_seed() -> None:
    def run(seed: int) -> list[tuple[str, int]]:
        link = SharedLink(Load(loss=0.5, seed=seed), ["r", "q"])
        for index in range(50):
            link.send("a", index, b"m", float(index))
        return [(heard.member, heard.sender) for heard in link.arrived(100.0)]

    assert run(1) == run(1)
    assert run(1) != run(2)


@pytest.mark.parametrize(
    ("load", "rate"),
    [
        (Load(), 34),  # the radio has 9600 bit/s: as much as the sender
        (Load(link="vhf-1200", bitrate=900, loss=0.1), 20),  # (0.8 · 1200 − 900) / 3
        (Load(link="hf-75", bitrate=75), None),  # nothing is left
        (Load(feedback=False), None),
    ],
)
def test_receivers_get_what_the_radio_has_left(load: Load, rate: int | None) -> None:
    link = load.receivers_link
    assert (link and link.rate_bits_per_s) == rate


def test_depth_is_the_contracts() -> None:
    assert allowed_depth_bits(34) == 34 * 40  # 4000/34 s is more than 40 s
    assert allowed_depth_bits(1200) == 4000
    assert allowed_depth_bits(9600) == 2 * 9600


# Gaps and sizes around what the rates earn, so that windows are broken now and then, not always.
frames_of = st.lists(st.tuples(st.integers(0, 4), st.integers(10, 120)), min_size=4, max_size=25).map(
    lambda gaps: [
        (at * NS_PER_S, size)
        for at, (_, size) in zip(itertools.accumulate(gap for gap, _ in gaps), gaps, strict=True)
    ]
)


@given(frames=frames_of, rate=st.integers(150, 600))
def test_the_budget_holds_in_every_window(frames: list[tuple[int, int]], rate: int) -> None:
    """Beside trying every window from one frame to a later one."""
    broken = any(
        8 * NS_PER_S * sum(size for _, size in frames[first : last + 1])
        > rate * (frames[last][0] - frames[first][0]) + allowed_depth_bits(rate) * NS_PER_S
        for first in range(len(frames))
        for last in range(first, len(frames))
    )
    assert exceeds_budget(frames, rate, 0) == broken


def test_a_budget_may_be_spent_for_ever_but_not_saved_up() -> None:
    steady = [(second * NS_PER_S, 25) for second in range(1000)]  # 200 bit/s; depth 4000 bits
    assert not exceeds_budget(steady, 200, 0)
    # After an hour's silence no more than the depth: 500 bytes, and not one more.
    late = steady[-1][0] + 3600 * NS_PER_S
    assert not exceeds_budget([*steady, (late, 500)], 200, 0)
    assert exceeds_budget([*steady, (late, 501)], 200, 0)


def test_an_empty_bucket_may_not_burst() -> None:
    frame = [(NS_PER_S, 100)]  # 800 bits after one second
    assert not exceeds_budget(frame, 700, 0)
    assert exceeds_budget(frame, 700, 0, empty_at_start=True)
    assert not exceeds_budget(frame, 800, 0, empty_at_start=True)


def walker(velocity_m_s: tuple[float, float], duration_s: float = 60.0) -> SquadTracks:
    time_s = np.arange(0.0, duration_s + 0.1, 0.2)
    place = np.zeros((1, len(time_s), 3))
    place[0, :, :2] = time_s[:, None] * np.array(velocity_m_s)
    return SquadTracks("straight", 0, time_s, place, np.broadcast_to(velocity_m_s, (1, len(time_s), 2)))


def test_error_is_what_the_receiver_shows_less_what_the_sender_knew() -> None:
    tracks, seen = walker((1.0, 0.0)), Seen()
    seen.add(10.5, 10.0, (10.0, 3.0), (1.0, 0.0))  # 3 m off to the side from the start
    straight, standing = Errors(), Errors()
    straight.take(seen, tracks, 0, straight_on)
    standing.take(seen, tracks, 0, stay)
    # Seconds 11 … 59 of 1 … 59 are known.
    assert straight.missing_pct == pytest.approx(100.0 * 10 / 59)
    np.testing.assert_allclose(straight.added_m[0], 3.0, atol=1e-9)
    # Fusion tells five places a second, half a second late: at 11 s the newest is of 10.4 s.
    np.testing.assert_allclose(standing.added_m[0], np.hypot(np.arange(0.4, 49.0), 3.0), atol=1e-9)
    assert standing.age_s[0][0] == pytest.approx(1.0)


def test_an_older_report_changes_nothing() -> None:
    seen = Seen()
    seen.add(5.0, 4.0, (1.0, 1.0), (0.0, 0.0))
    seen.add(6.0, 3.0, (9.0, 9.0), (0.0, 0.0))
    assert len(seen.rows()) == 1


def test_nobody_heard_is_all_missing() -> None:
    errors = Errors()
    errors.take(Seen(), walker((1.0, 0.0)), 0, stay)
    assert errors.missing_pct == 100.0
    assert errors.percentile_m(95.0) is None


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"soldiers": 0}, "--soldiers"),
        ({"loss": 1.0}, "--loss"),
        ({"bitrate": 0}, "--bitrate"),
        ({"duration_s": float("nan")}, "--duration"),
        ({"link": "vhf-120"}, "vhf-1200"),
        ({"link": "vhf-1200", "bitrate": 2400}, "sends at 1200"),
    ],
)
def test_what_cannot_be_is_said(wrong: dict[str, float], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        Load(**wrong)  # type: ignore[arg-type]
