"""When a net speaks: the order of notices, the budget and the longest frame."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sa_hub.radio.content import AlertNotice, Reports
from sa_hub.radio.counters import Block, MemoryCounters
from sa_hub.radio.frame import Codec
from sa_hub.radio.net import RadioNet
from sa_hub.radio.scheduler import Policy
from sa_hub.radio.seal import NetKeys, Opener, Sealer
from sa_hub.settings import LinkProfile
from support.hub_squad import GROUP_KEY, ORIGIN, START_NS, S
from support.radio_reports import at

NUMBERS = range(1, 200)


def alert(seconds: float = 0.0, text: str = "") -> AlertNotice:
    return AlertNotice(1, START_NS + round(seconds * S), "contact", text)


def radio_net(rate_bits_per_s: int = 9600, mtu_bytes: int = 250, header_bytes: int = 28) -> RadioNet:
    """The net of soldier 1."""
    profile = LinkProfile(
        name="squad", rate_bits_per_s=rate_bits_per_s, mtu_bytes=mtu_bytes, header_bytes=header_bytes
    )
    keys = NetKeys(GROUP_KEY, "squad", 8)
    return RadioNet(profile, Policy(), 1, Codec(ORIGIN), Sealer(keys, 1, MemoryCounters()), Opener(keys))


def receiver() -> RadioNet:
    """The net of soldier 2."""
    keys = NetKeys(GROUP_KEY, "squad", 8)
    profile = LinkProfile(name="squad", rate_bits_per_s=9600)
    return RadioNet(
        profile,
        Policy(),
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
    assert net.speak([at(1, 2.0)], START_NS + 2 * S) == []  # 600 bits would pay for the report
    frames = net.speak([at(1, 20.0)], START_NS + 20 * S)
    assert kinds_of(frames) == ["AlertNotice", "Reports"]


def kinds_of(frames: list[bytes]) -> list[str]:
    hearing = receiver()
    heard = [hearing.hear(frame, START_NS, NUMBERS, exercise=False) for frame in frames]
    return [type(each[1]).__name__ for each in heard if each is not None]


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
    frame = net.speak([at(1, 10.0)], START_NS + 10 * S)[0]
    known = [5] if spoil == "sender" else NUMBERS
    ear = net if spoil == "echo" else hearing
    data = bytes(30) if spoil == "garbage" else frame
    assert ear.hear(data, START_NS, known, exercise=spoil == "exercise") is None
    causes = {"sender": "unknown_sender", "exercise": "exercise", "echo": "own_echo", "garbage": "version"}
    assert dict(ear.meter.rejected) == {causes[spoil]: 1}
    assert ear.report(START_NS, {n: f"s{n}" for n in NUMBERS}).frames_rejected == (
        0 if spoil == "echo" else 1
    )


class _Rolling:
    """Counters that go over into the next epoch after a block of twenty."""

    def __init__(self) -> None:
        self._epoch = 0

    def reserve(self) -> Block:
        """Twenty numbers of the next epoch."""
        self._epoch += 1
        return Block(self._epoch, 0, 20)


def test_after_our_epoch_has_rolled_all_is_told_in_full() -> None:
    """Receivers resolve updates by frames of the same epoch alone; nothing that they missed would come again."""
    profile = LinkProfile(name="squad", rate_bits_per_s=60, header_bytes=0)
    keys = NetKeys(GROUP_KEY, "squad", 8)
    sealer = Sealer(keys, 1, _Rolling())
    net = RadioNet(profile, Policy(), 1, Codec(ORIGIN), sealer, Opener(keys))
    codec, opener = Codec(ORIGIN), Opener(keys)
    first: dict[int, str] = {}
    for tenth in range(12_000):
        now_ns = START_NS + tenth * S // 10
        for frame in net.speak([at(1, tenth / 10, 30.0 * math.sin(tenth / 60.0))], now_ns):
            opened = opener.open(frame)
            first.setdefault(opened.epoch, type(codec.decode(1, opened.payload, now_ns).content).__name__)
    assert len(first) > 2
    assert set(first.values()) == {"Reports"}
