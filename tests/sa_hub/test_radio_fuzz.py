"""A small fuzz of the hub's ear (`make fuzz` is the long one), and a flood of garbage at link rate."""

import pickle
import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.messages import Track
from sa_hub.radio.content import Content, Entry, Report, Reports, Update
from sa_hub.radio.control import Acknowledgement, Asked, Control, Fragment, Request
from sa_hub.radio.frame import Codec
from sa_hub.radio.grid import Grid
from sa_hub.radio.layout import VERSION
from sa_hub.radio.net_keys import TagBytes
from sa_hub.radio.references import References
from support.hub_squad import ORIGIN, START_NS, Air, S, Walk, hub, link
from support.radio_fuzz import Fuzz, FuzzError, decode_nonsense, resolve_nonsense

numbers = st.integers(0, 1023)
acknowledgements = st.builds(
    Acknowledgement, st.lists(st.tuples(numbers, st.integers(0, 255)), min_size=1, max_size=8).map(tuple)
)
requests = st.builds(
    Request, st.integers(0, 63), st.none() | st.lists(numbers, max_size=14, unique=True).map(tuple)
)
fragments = st.integers(0, 15).flatmap(
    lambda last: st.builds(
        Fragment, st.integers(0, 63), st.integers(0, last), st.just(last), st.binary(max_size=255)
    )
)


@settings(deadline=None)
@given(
    acknowledgements | requests | fragments, st.none() | st.lists(numbers, max_size=7).map(tuple).map(Asked)
)
def test_control_frames_come_back(content: Control, asked: Asked | None) -> None:
    codec = Codec(ORIGIN, exercise=True)
    frame = codec.decode(5, codec.encode(5, content, 0, 400, asked), START_NS)
    assert frame.exercise
    assert frame.content == content
    assert frame.asked == (asked if isinstance(content, Fragment) else None)


@pytest.mark.parametrize("tag_bytes", [8, 4])
def test_nothing_but_good_frames_is_taken_also_after_restarts(tmp_path: Path, tag_bytes: TagBytes) -> None:
    fuzz = Fuzz(11, tmp_path, tag_bytes, restart_every=2000)
    fuzz.run(10_000)
    assert fuzz.counts["good"] > 300
    assert fuzz.counts["restarts"] == 5
    assert fuzz.counts["replayed"] > 500
    assert fuzz.counts["forged"] > 2000
    assert fuzz.counts["reports"] > 100
    assert fuzz.counts["unresolved"] > 50
    assert fuzz.counts["spoken"] > 10


def test_the_fuzz_finds_a_listener_that_forgets(tmp_path: Path) -> None:
    fuzz = Fuzz(11, tmp_path)
    fuzz.run(500)
    fuzz.net.opener.memory.clear()
    with pytest.raises(FuzzError):
        fuzz.run(500)


def test_decoders_take_nonsense_or_refuse_it(tmp_path: Path) -> None:
    found = decode_nonsense(Fuzz(5, tmp_path), 10_000)
    assert sum(found.values()) == 10_000
    assert {"Reports", "Update", "Request", "Fragment"} <= set(found)
    assert {"short", "long", "text", "range", "kind"} <= set(found)


def test_updates_are_resolved_against_nonsense_or_left_out(tmp_path: Path) -> None:
    found = resolve_nonsense(Fuzz(5, tmp_path), References(Grid(ORIGIN)), 10_000)
    assert found["told"] > 1000
    assert found["resolved"] > 500
    assert found["unresolved"] > 500


def test_what_senders_told_takes_no_more_room_in_the_long_run() -> None:
    """A sender that tells of all numbers there are, again and again, in full and in updates, clean or not."""
    codec, references, rng = Codec(ORIGIN), References(Grid(ORIGIN)), random.Random(8)
    sizes = []
    for counter in range(10_000, 10_800):
        numbers = sorted(rng.sample(range(1024), 64))
        if counter % 2:
            told: Content = Reports(
                tuple(Report(number, START_NS, 59.35, 18.07, 1.0, 0.5, height_m=50.0) for number in numbers)
            )
        else:
            cells = [rng.randrange(512) for _ in numbers]
            entries = (Entry(*each, each[1], (1, 2)) for each in zip(numbers, cells, strict=True))
            told = Update(START_NS // 10**8, 3, 9, 14, tuple(entries))
        content = codec.decode(5, codec.encode(5, told, 3, 9999), START_NS).content
        frame = 5, 1, counter + rng.randrange(2) * (counter % 7)
        now_ns = START_NS + S + rng.randrange(S)
        references.heard(*frame)
        if isinstance(content, Reports):
            references.told(*frame, content, now_ns)
        else:
            assert isinstance(content, Update)
            references.resolve(*frame, content, now_ns)
        if counter % 200 == 199:
            sizes.append(len(pickle.dumps(references)))
    assert sizes[0] > 100_000
    assert sizes[-1] < 1.02 * sizes[0]


def test_a_flood_of_garbage_at_link_rate_delays_no_good_frame() -> None:
    """9,600 bit/s of frames as short as can be that claim to be a squad mate's, between the good ones.

    (It makes the listener ask for full headers now and then, so the mate does not send the same as without it.)
    """
    rng = random.Random(3)
    air = Air({name: hub(name, link("squad")) for name in ("a1", "a2")})
    for _ in range(600):
        air.run(0.1, {"a1": Walk()})
        for _ in range(11):
            garbage = bytes([VERSION << 6, 0x10 | rng.randrange(8)]) + rng.randbytes(9)
            air.hubs["a2"].receive("squad", garbage, air.now_ns)
    air.run(0.1, {})
    refused = air.hubs["a2"].figures().counters
    assert refused["radio_forged"] + refused["radio_unknown_epoch"] == 6600
    sent_ns = [time_ns for time_ns, sender, *_ in air.log if sender == "a1"]
    taken_ns = [
        e.message.received_ns
        for name, e in air.outputs
        if name == "a2" and e.address.source == "a1" and isinstance(e.message, Track)
    ]
    assert len(sent_ns) > 6
    assert taken_ns == [time_ns + S // 20 for time_ns in sent_ns]
