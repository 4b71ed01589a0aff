"""Friends from TAK told on by radio: the nearest first, few, marked, and no longer when they are stale."""

from bootprint.bus import Envelope
from bootprint.foreign import Affiliation, ForeignTrack
from bootprint.geodesy import moved_place
from bootprint.messages import HARMLESS_CODES, Observation, Track
from bootprint.topics import Identity
from sa_hub.radio.content import OBSERVATION_CODES
from sa_hub.tak.friends import Friends
from sa_hub.tak.settings import TakSettings
from support.hub_squad import START_NS, Air, S, hub, link, own_identity

CP = Identity("bp", "hq", "cp")
HERE = (59.35, 18.07)


def friends(within_m: float = 1000.0, every_s: float = 30.0) -> Friends:
    found = Friends(CP, TakSettings(friends_within_m=within_m, friends_every_s=every_s))
    found.hear(
        Track(
            time_ns=START_NS,
            soldier="a1",
            number=1,
            state="fresh",
            latitude_deg=HERE[0],
            longitude_deg=HERE[1],
            height_m=None,
            accuracy_m=2.0,
        )
    )
    return found


def unit(name: str, east_m: float, affiliation: Affiliation = "friend", stale_s: int = 300) -> ForeignTrack:
    latitude_deg, longitude_deg = moved_place(HERE, east_m, 0.0)
    return ForeignTrack(
        time_ns=START_NS,
        uid=f"uid-{name}",
        affiliation=affiliation,
        cot_type="a-f-G-U-C",
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        stale_ns=START_NS + stale_s * S,
        callsign=name,
    )


def told(found: Friends, after_s: float) -> str | None:
    """Whom it tells of so many seconds after the start."""
    envelope = found.due(START_NS + round(after_s * S))
    if envelope is None:
        return None
    assert isinstance(envelope.message, Observation)
    return envelope.message.text


def test_the_nearest_is_told_first_and_one_at_a_time() -> None:
    found = friends()
    for each in (
        unit("far", 800.0),
        unit("near", 50.0),
        unit("beyond", 1500.0),
        unit("foe", 10.0, "hostile"),
    ):
        found.hear(each)
    assert [told(found, after_s) for after_s in (0, 1, 29, 30, 60, 90)] == [
        "near",
        None,
        None,
        "far",
        None,
        None,
    ]


def test_one_that_was_told_is_told_again_when_it_has_moved_by_much_of_its_distance() -> None:
    found = friends(every_s=1.0)
    found.hear(unit("bravo", 500.0))
    assert told(found, 0) == "bravo"
    found.hear(unit("bravo", 580.0))
    assert told(found, 10) is None
    found.hear(unit("bravo", 650.0))
    assert told(found, 20) == "bravo"


def test_nobody_is_told_of_one_that_may_be_gone() -> None:
    found = friends()
    found.hear(unit("bravo", 50.0, stale_s=10))
    assert told(found, 10) is None


def test_without_our_own_people_on_the_map_nobody_is_near() -> None:
    found = Friends(CP, TakSettings())
    found.hear(unit("bravo", 50.0))
    assert found.due(START_NS) is None


def test_the_squad_hears_of_a_friend_and_nobody_takes_it_for_a_target() -> None:
    assert "friendly" in HARMLESS_CODES
    assert OBSERVATION_CODES[:18][-1] == "route", "codes on the air keep their numbers"
    found = friends()
    found.hear(unit("bravo", 50.0))
    air = Air({"cp": hub("cp", link("hq"), role="command_post"), "a1": hub("a1", link("hq"))})
    air.run(3.0, {})
    observation = found.due(air.now_ns)
    assert observation is not None
    air.say(Envelope(own_identity("cp").address("observation", "tak"), observation.message))
    air.run(20.0, {})
    heard = [each.message for name, each in air.outputs if name == "a1"]
    (seen,) = (each for each in heard if isinstance(each, Observation))
    assert (seen.code, seen.text, seen.soldier) == ("friendly", "bravo", "cp")
