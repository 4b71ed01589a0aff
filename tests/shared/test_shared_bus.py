"""The memory bus is deterministic, and its selectors mean what zenoh's mean."""

from collections.abc import Iterable

import pytest
import zenoh
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint import wire
from bootprint.bus import Envelope, MemoryBus, matches
from bootprint.messages import Pressure
from bootprint.topics import Identity
from support.messages import envelopes, quick

A3 = Identity("bp", "alpha", "a3")
words = st.sampled_from(["a", "b", "a3", "@v1", "@v2"])
keys = st.lists(words, min_size=1, max_size=6).map("/".join)
selectors = st.lists(words | st.sampled_from(["*", "**"]), min_size=1, max_size=6).map("/".join)


@settings(max_examples=300, deadline=None)
@given(selector=selectors, key=keys)
def test_selectors_match_what_zenoh_matches(selector: str, key: str) -> None:
    expression = zenoh.KeyExpr.autocanonize(selector)
    assert matches(selector, key) == expression.intersects(zenoh.KeyExpr(key))
    assert matches(selector, key) == expression.includes(zenoh.KeyExpr(key))


@pytest.mark.parametrize(
    ("selector", "matched"),
    [
        ("bp/@v1/**", True),
        ("bp/@v1/*/*/imu/*", True),
        ("*/@v1/**/left_foot", True),
        ("bp/@v1/alpha/a3/imu/left_foot/**", True),
        ("**", False),
        ("bp/**", False),
        ("bp/*/alpha/a3/imu/left_foot", False),
        ("bp/@v2/**", False),
        ("bp/@v1/*", False),
        ("bp/@v1/alpha/a3/im*/left_foot", False),
    ],
)
def test_no_wildcard_crosses_the_version(selector: str, matched: bool) -> None:
    assert matches(selector, "bp/@v1/alpha/a3/imu/left_foot") is matched


def pressure(source: str, sequence: int) -> Envelope:
    message = Pressure(time_ns=sequence, sequence=sequence, pressure_pa=101_325.0)
    return Envelope(A3.address("pressure", source), message)


class Echo:
    """Answers every message with two on another source, as long as their sequence is small."""

    def __init__(self, source: str) -> None:
        self.source = source

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        sequence = envelope.message.sequence
        return [pressure(self.source, sequence + step) for step in (1, 2)] if sequence < 3 else []

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        return ()


def heard_by_two_cores() -> tuple[list[tuple[str, bytes]], list[tuple[str, int]]]:
    bus = MemoryBus()
    heard: list[tuple[str, int]] = []
    bus.attach(Echo("b"), [A3.selector("pressure", "a")])
    bus.attach(Echo("a"), [A3.selector("pressure", "b")])
    bus.subscribe("bp/@v1/**", lambda e: heard.append((e.address.source, e.message.sequence)))
    bus.publish(pressure("a", 0))
    return bus.journal, heard


def test_delivery_is_first_in_first_out_and_breadth_first() -> None:
    _, heard = heard_by_two_cores()
    assert heard[:7] == [("a", 0), ("b", 1), ("b", 2), ("a", 2), ("a", 3), ("a", 3), ("a", 4)]


def test_the_same_input_gives_the_same_bytes() -> None:
    assert heard_by_two_cores()[0] == heard_by_two_cores()[0]


@quick
@given(sent=st.lists(envelopes, max_size=5))
def test_everything_arrives_in_order_and_in_the_journal(sent: list[Envelope]) -> None:
    bus = MemoryBus()
    heard: list[Envelope] = []
    bus.subscribe("*/@v1/**", heard.append)
    for envelope in sent:
        bus.publish(envelope)
    assert heard == sent
    assert bus.journal == [(e.address.key, wire.encode(e.message)) for e in sent]


def test_a_closed_bus_delivers_nothing() -> None:
    bus = MemoryBus()
    heard: list[Envelope] = []
    bus.subscribe("bp/@v1/**", heard.append)
    bus.close()
    bus.close()
    bus.publish(pressure("a", 0))
    assert heard == []


def test_a_handler_that_fails_does_not_block_the_bus() -> None:
    bus = MemoryBus()
    heard: list[int] = []

    def handler(envelope: Envelope) -> None:
        heard.append(envelope.message.sequence)
        if envelope.message.sequence == 1:
            raise RuntimeError("broken handler")

    bus.subscribe("bp/@v1/**", handler)
    with pytest.raises(RuntimeError, match="broken handler"):
        bus.publish(pressure("a", 1))
    bus.publish(pressure("a", 2))
    assert heard == [1, 2]
