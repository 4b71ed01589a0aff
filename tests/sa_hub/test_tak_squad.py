"""The squad as CoT and others' CoT as messages: what is due, what it says, what becomes of what was heard."""

from dataclasses import replace

import pytest

from bootprint.config import Member, Origin, Realm
from bootprint.display import Ages, shown
from bootprint.foreign import ForeignTrack
from bootprint.messages import Mode, Observation, Status, Track
from bootprint.topics import Identity
from sa_hub.tak.event import CotEvent, to_xml
from sa_hub.tak.foreign import Foreigners
from sa_hub.tak.link import Documents
from sa_hub.tak.protobuf import to_protobuf
from sa_hub.tak.settings import TakSettings
from sa_hub.tak.squad import Squad

S = 1_000_000_000
T0 = 1_760_000_000 * S
AGES = Ages(75 * S, 180 * S)
REALM = Realm(
    id="bp",
    origin=Origin(latitude_deg=59.35, longitude_deg=18.07),
    roster=(
        Member(id="a1", number=1, unit="alpha", callsign="Alpha 1", role="medic"),
        Member(id="cp", number=100, unit="hq", role="command_post"),
    ),
)


def track(soldier: str, time_ns: int, mode: Mode = "boots", **more: object) -> Track:
    fields = {"latitude_deg": 59.35, "longitude_deg": 18.07, "height_m": 50.0, "accuracy_m": 2.0, **more}
    return Track(time_ns=time_ns, soldier=soldier, number=1, state="fresh", mode=mode, **fields)  # type: ignore[arg-type]


def squad(*, exercise: bool = False) -> Squad:
    return Squad(REALM, TakSettings(), AGES, exercise=exercise)


def events(of: Squad, at_s: float) -> list[CotEvent]:
    return list(of.due(T0 + round(at_s * S)))


def test_a_soldier_has_the_right_type_name_role_accuracy_and_stale_time() -> None:
    alpha = squad()
    alpha.tell(track("a1", T0, east_velocity_m_s=1.5))
    alpha.tell(Status(time_ns=T0, soldier="a1", battery_pct=61.4))
    [event] = events(alpha, 1)
    assert (event.uid, event.type, event.how) == ("bootprint-bp-a1", "a-f-G-U-C-I", "m-f")
    assert (event.time_ns, event.start_ns, event.stale_ns) == (T0 + S, T0, T0 + 75 * S)
    assert event.detail("contact", "callsign") == "Alpha 1"
    assert event.detail("__group", "role") == "Medic"
    assert event.detail("status", "battery") == "61"
    assert event.detail("track", "course") == "90.0"
    assert event.ce_m == shown(track("a1", T0, east_velocity_m_s=1.5), T0 + S, AGES).sigma_m
    assert event.opex == ""


@pytest.mark.parametrize(("mode", "how"), [("gnss", "m-g"), ("boots", "m-f"), ("coasting", "m-p")])
def test_how_tells_where_the_place_comes_from(mode: Mode, how: str) -> None:
    alpha = squad()
    alpha.tell(track("a1", T0, mode))
    assert [event.how for event in events(alpha, 1)] == [how]


def test_a_new_report_goes_out_but_not_too_often_and_an_old_one_again() -> None:
    alpha = squad()
    alpha.tell(track("a1", T0))
    assert len(events(alpha, 0)) == 1
    alpha.tell(track("a1", T0 + S))
    assert events(alpha, 1) == []
    assert len(events(alpha, 2)) == 1
    assert events(alpha, 16.9) == []
    [again] = events(alpha, 17)
    assert again.how == "m-p"


def test_the_silent_and_lost_are_told_at_once_as_stale_and_in_words() -> None:
    alpha = squad()
    alpha.tell(track("a1", T0))
    assert len(events(alpha, 0)) == 1
    [silent] = events(alpha, 80)
    assert silent.stale_ns == T0 + 81 * S
    assert silent.remarks == "silent for 1:20, by boots"
    [lost] = events(alpha, 181)
    assert lost.stale_ns == T0 + 182 * S
    assert lost.remarks.startswith("lost for 3:01")
    assert events(alpha, 200) == []
    assert lost.ce_m is not None
    assert silent.ce_m is not None
    assert lost.ce_m > silent.ce_m > 10.0


def test_an_exercise_is_marked_as_one() -> None:
    alpha = squad(exercise=True)
    alpha.tell(track("cp", T0))
    [event] = events(alpha, 0)
    assert (event.type, event.opex) == ("a-f-G-U-C", "e-bp")
    assert event.remarks.startswith("EXERCISE")


# -- in --------------------------------------------------------------------------------------------------------

MARKER = CotEvent("marker 1", "a-h-G-E-V-A-T", "h-g-i-g-o", T0, T0, T0 + 60 * S, 59.0, 18.0, None, None)
FRIEND = CotEvent(
    "ANDROID-1",
    "a-f-G-U-C",
    "m-g",
    T0,
    T0,
    T0 + 60 * S,
    59.0,
    18.0,
    40.0,
    5.0,
    details={"contact": {"callsign": "Bravo"}, "track": {"course": "180", "speed": "nonsense"}},
)


def foreigners() -> Foreigners:
    return Foreigners(Identity("bp", "hq", "cp"), "tak")


@pytest.mark.parametrize("encode", [to_xml, to_protobuf])
def test_a_friend_becomes_a_foreign_track(encode: object) -> None:
    heard = foreigners().hear(encode(replace(FRIEND, details={"contact": {"callsign": "Bravo"}})), T0)  # type: ignore[operator]
    assert heard is not None
    assert heard.address.key == "bp/@v1/hq/cp/foreign_track/ANDROID-1"
    friend = heard.message
    assert isinstance(friend, ForeignTrack)
    assert (friend.affiliation, friend.callsign, friend.accuracy_m) == ("friend", "Bravo", 5.0)
    assert (friend.time_ns, friend.stale_ns, friend.height_m) == (T0, T0 + 60 * S, 40.0)


def test_what_is_no_number_in_a_detail_is_unknown() -> None:
    heard = foreigners().hear(to_xml(FRIEND), T0)
    assert heard is not None
    assert isinstance(heard.message, ForeignTrack)
    assert heard.message.speed_m_s is None
    assert heard.message.course_rad == pytest.approx(3.14159265)


@pytest.mark.parametrize(
    ("type_", "how", "code"),
    [
        ("a-h-G-E-V-A-T", "h-e", "armour"),
        ("a-s-G-U-C-I", "h-e", "infantry"),
        ("a-h-G", "h-e", None),
        ("a-n-G", "h-e", "civilian"),
        ("b-m-p-s-m", "h-g-i-g-o", "route"),
        ("b-m-p-w-GOTO", "h-g-i-g-o", "rally_point"),
        ("b-a-o-tbl", "h-e", "casualty"),
    ],
)
def test_markers_become_observations(type_: str, how: str, code: str | None) -> None:
    heard = foreigners().hear(to_xml(replace(MARKER, type=type_, how=how)), T0)
    assert heard is not None
    assert isinstance(heard.message, Observation)
    assert (heard.message.soldier, heard.message.code) == ("tak", code)


def test_a_friend_placed_by_hand_is_never_a_target() -> None:
    heard = foreigners().hear(to_xml(replace(MARKER, type="a-f-G-U-C")), T0)
    assert heard is not None
    assert isinstance(heard.message, ForeignTrack)


def test_what_is_refused_repeated_own_or_of_no_use_is_counted() -> None:
    ears = foreigners()
    assert ears.hear(b"<event", T0) is None
    assert ears.hear(to_xml(replace(FRIEND, uid="bootprint-bp-a1")), T0) is None
    assert ears.hear(to_xml(replace(FRIEND, type="t-x-c-t")), T0) is None
    assert ears.hear(to_xml(MARKER), T0) is not None
    assert ears.hear(to_xml(MARKER), T0 + 60 * S) is None
    assert ears.hear(to_xml(FRIEND), T0) is not None
    assert ears.hear(to_xml(FRIEND), T0 + S // 2) is None
    assert ears.hear(to_xml(FRIEND), T0 + 2 * S) is not None
    assert ears.hear(to_xml(replace(MARKER, latitude_deg=58.0)), T0 + 90 * S) is not None
    assert ears.counters == {
        "refused": 1,
        "own": 1,
        "no_use": 1,
        "too_often": 2,
        "tracks": 2,
        "observations": 2,
    }


def test_a_stream_is_cut_into_events_wherever_it_is_torn() -> None:
    one, two = to_xml(FRIEND), to_xml(MARKER)
    whole = b"\n" + one + b"  " + two
    for at in range(0, len(whole), 37):
        documents = Documents()
        cut = [*documents.feed(whole[:at]), *documents.feed(whole[at:])]
        assert [each.strip()[:6] for each in cut] == [b"<event", b"<event"]
        assert [foreigners().hear(each, T0) is not None for each in cut] == [True, True]


def test_a_stream_without_an_end_is_given_up() -> None:
    documents = Documents()
    given_up = [each for _ in range(100) for each in documents.feed(b"<event " * 200)]
    assert given_up
    assert all(foreigners().hear(each, T0) is None for each in given_up)
