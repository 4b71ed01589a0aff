"""Cursor on Target events: written as others read them, read back as they were, garbage refused."""

import contextlib
import re
from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from lxml import etree
from takproto import TAKProtoVer, parse_proto, xml2proto

from sa_hub.tak.event import MAX_EVENT_BYTES, CotError, CotEvent, from_xml, to_xml
from sa_hub.tak.protobuf import from_protobuf, to_protobuf
from support.messages import quick

T0 = 1_760_000_000_123_000_000
EVENT = CotEvent(
    uid="bootprint-bp-a1",
    type="a-f-G-U-C-I",
    how="m-f",
    time_ns=T0,
    start_ns=T0,
    stale_ns=T0 + 75_000_000_000,
    latitude_deg=59.35,
    longitude_deg=18.07,
    hae_m=None,
    ce_m=2.5,
    details={"contact": {"callsign": "Alpha 1"}, "track": {"course": "90.0", "speed": "1.2"}},
    remarks="floor 2 & <up>",
    opex="e-bp",
)

millis = st.integers(0, 4_000_000_000_000).map(lambda ms: ms * 1_000_000)
words = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), min_size=1, max_size=12)
events = st.builds(
    lambda times, **fields: CotEvent(time_ns=times[0], start_ns=times[1], stale_ns=times[2], **fields),
    st.lists(millis, min_size=3, max_size=3).map(sorted),
    uid=words,
    type=st.from_regex(r"a-[fhnu]-G(-U)?(-C)?", fullmatch=True),
    how=st.sampled_from(["m-g", "h-e", "m-p"]),
    latitude_deg=st.integers(-900_000_000, 900_000_000).map(lambda n: n / 1e7),
    longitude_deg=st.integers(-1_800_000_000, 1_800_000_000).map(lambda n: n / 1e7),
    hae_m=st.none() | st.integers(-500_000, 9_000_000).map(lambda n: n / 1e3),
    ce_m=st.none() | st.integers(0, 10_000).map(lambda n: n / 10),
    details=st.dictionaries(st.sampled_from(["contact", "__group"]), st.just({"callsign": "x"}), max_size=1),
    remarks=words | st.just(""),
)


def test_the_xml_is_what_an_independent_reader_expects() -> None:
    root = etree.fromstring(to_xml(EVENT))
    point = root.find("point")
    assert root.get("version") == "2.0"
    assert root.get("time") == "2025-10-09T08:53:20.123Z"
    assert root.get("stale") == "2025-10-09T08:54:35.123Z"
    assert (root.get("type"), root.get("how"), root.get("opex")) == ("a-f-G-U-C-I", "m-f", "e-bp")
    assert (point.get("lat"), point.get("ce")) == ("59.3500000", "2.5")
    assert {point.get("hae"), point.get("le")} == {"9999999.0"}
    assert root.find("detail/contact").get("callsign") == "Alpha 1"
    assert root.findtext("detail/remarks") == "floor 2 & <up>"


def test_the_protobuf_is_what_an_independent_reader_expects() -> None:
    message = parse_proto(bytearray(to_protobuf(EVENT))).cotEvent
    assert (message.uid, message.type, message.sendTime) == (EVENT.uid, EVENT.type, T0 // 1_000_000)
    assert message.detail.contact.callsign == "Alpha 1"
    assert message.detail.track.course == 90.0


def test_protobuf_times_are_right_to_the_millisecond() -> None:
    odd = replace(EVENT, time_ns=0, start_ns=0, stale_ns=65_225_000_000)
    assert parse_proto(bytearray(to_protobuf(odd))).cotEvent.staleTime == 65_225


def test_protobuf_in_a_streams_framing_is_read_too() -> None:
    framed = bytes(xml2proto(to_xml(EVENT).decode(), TAKProtoVer.STREAM))
    assert from_protobuf(framed).uid == EVENT.uid
    for broken in (framed[:-1], framed + b"x", b"\xbf", b"\xbf\xff\xff\xff\xff"):
        with pytest.raises(CotError, match="no message of TAK protocol"):
            from_protobuf(broken)


@quick
@given(event=events)
def test_xml_comes_back_as_it_was(event: CotEvent) -> None:
    assert from_xml(to_xml(event)) == event


@quick
@given(event=events)
def test_protobuf_comes_back_as_it_was(event: CotEvent) -> None:
    back = from_protobuf(to_protobuf(event))
    assert {
        name: getattr(back, name) for name in ("uid", "type", "how", "time_ns", "stale_ns", "remarks")
    } == {name: getattr(event, name) for name in ("uid", "type", "how", "time_ns", "stale_ns", "remarks")}
    assert (back.latitude_deg, back.hae_m, back.ce_m) == (event.latitude_deg, event.hae_m, event.ce_m)


def changed(pattern: str, by: str) -> bytes:
    text, count = re.subn(pattern, by, to_xml(EVENT).decode())
    assert count
    return text.encode()


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "no XML"),
        (b"<event/>", "without a point"),
        (changed("event", "evil"), "without a point"),
        (changed('lat="[^"]*"', 'lat="91"'), "impossible lat"),
        (changed('lon="[^"]*"', 'lon="nan"'), "not finite"),
        (changed('ce="[^"]*"', 'ce="-1"'), "impossible ce"),
        (changed('hae="[^"]*"', 'hae="1e9x"'), "cannot be read"),
        (changed('hae="[^"]*"', ""), "cannot be read"),
        (changed('uid="[^"]*"', 'uid=""'), "impossible uid"),
        (changed('type="[^"]*"', 'type="a b"'), "impossible type"),
        (changed('stale="[^"]*"', 'stale="2020-01-01T00:00:00Z"'), "impossible stale"),
        (changed('time="[^"]*"', 'time="9999-01-01T00:00:00Z"'), "impossible time"),
        (changed('time="[^"]*"', 'time="yesterday"'), "cannot be read"),
        (b'<!DOCTYPE x [<!ENTITY a "aa">]>' + to_xml(EVENT), "document type"),
        (b" " * (MAX_EVENT_BYTES + 1), "more than"),
    ],
)
def test_what_is_no_event_is_refused_with_a_reason(data: bytes, reason: str) -> None:
    with pytest.raises(CotError, match=reason):
        from_xml(data)


@quick
@given(data=st.binary(max_size=200), at=st.integers(0, 900), flip=st.integers(1, 255))
@example(data=b"\xbf\x01\xbf", at=0, flip=1)
def test_garbage_and_damaged_events_are_events_or_refused(data: bytes, at: int, flip: int) -> None:
    for read, sound in ((from_xml, to_xml(EVENT)), (from_protobuf, to_protobuf(EVENT))):
        damaged = bytearray(sound)
        damaged[at % len(sound)] ^= flip
        for each in (data, bytes(damaged), sound[: at % len(sound)], b"\xbf\x01\xbf" + data):
            with contextlib.suppress(CotError):
                assert isinstance(read(each), CotEvent)
