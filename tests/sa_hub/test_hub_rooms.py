"""Maps of rooms between hubs: sealed by the net's own key, the newest only; and on the page."""

from pathlib import Path

import msgspec
import pytest

from bootprint.bus import Envelope
from bootprint.rooms import RoomMap
from bootprint.topics import Identity
from sa_hub.radio.link_profile import LinkProfile
from sa_hub.rooms.companion import broadband
from sa_hub.rooms.parcel import ParcelError, open_parcel, seal
from sa_hub.rooms.sharing import AGAIN_NS, RoomExchange, RoomLinks
from support.hub_squad import REALM
from support.page_post import PostAir, browser
from support.routers import running_router
from support.waiting import wait_until

KEY, OTHER_KEY = bytes(range(32)), bytes(32)
ROOMS = RoomMap(time_ns=7, soldier="a1", cell_m=0.5, levels=((0, 0.0),), runs=((0, 4, -2, 9, "walked", 0.5),))
NUMBER = REALM.member("a1").number


def exchange(soldier: str) -> RoomExchange:
    member = REALM.member(soldier)
    identity = Identity(REALM.id, member.unit, member.id)
    return RoomExchange(identity, member.number, REALM.by_number(), KEY)


def parcel(rooms: RoomMap = ROOMS, sender: int = NUMBER) -> bytes:
    return seal(rooms, KEY, sender, "broad")


def test_a_parcel_opens_with_its_key_on_its_net() -> None:
    assert open_parcel(parcel(), [OTHER_KEY, KEY], "broad") == (NUMBER, ROOMS)


@pytest.mark.parametrize(
    ("data", "keys", "net", "cause"),
    [
        (parcel(), [OTHER_KEY], "broad", "forged"),
        (parcel(), [KEY], "another", "forged"),
        (parcel()[:-1], [KEY], "broad", "forged"),
        (b"R2" + parcel()[2:], [KEY], "broad", "version"),
        (b"R1\x00\x07" + parcel()[4:], [KEY], "broad", "forged"),
        (b"R1", [KEY], "broad", "size"),
        (bytes(300_000), [KEY], "broad", "size"),
    ],
)
def test_what_is_not_authentic_is_refused(data: bytes, keys: list[bytes], net: str, cause: str) -> None:
    with pytest.raises(ParcelError) as caught:
        open_parcel(data, keys, net)
    assert caught.value.cause == cause


def test_a_map_goes_from_hub_to_hub_once_and_again_after_a_while() -> None:
    sender, receiver = exchange("a1"), exchange("cp")
    assert sender.due("broad", 0) is None
    sender.note_own(ROOMS)
    first = sender.due("broad", 0)
    assert first is not None
    assert sender.due("broad", AGAIN_NS - 1) is None
    assert sender.due("broad", AGAIN_NS) is not None
    told = receiver.take("broad", first, 0)
    assert told is not None
    assert told.message == ROOMS
    assert (told.address.soldier, told.address.source) == ("cp", "a1")
    assert receiver.take("broad", first, 0) is None  # heard before


def test_an_older_map_and_one_in_anothers_name_change_nothing() -> None:
    receiver = exchange("cp")
    newer = msgspec.structs.replace(ROOMS, time_ns=9)
    assert receiver.take("broad", parcel(newer), 0) is not None
    assert receiver.take("broad", parcel(), 0) is None
    assert receiver.take("broad", parcel(ROOMS, sender=REALM.member("cp").number), 0) is None
    assert receiver.counters["rooms_forged"] == 1


def test_the_page_shows_maps_and_says_when_they_grow(tmp_path: Path) -> None:
    air = PostAir(tmp_path)
    air.desk.tell([Envelope(Identity(REALM.id, "hq", "cp").address("rooms", "a1"), ROOMS)])
    with browser(air) as client:
        told = client.get("/api/v1/picture").json()["rooms"]
        features = client.get("/api/v1/rooms.geojson").json()["features"]
    assert told["a1"]["floors"] == [0]
    assert [feature["properties"]["kind"] for feature in features] == ["walked"]


def test_a_map_crosses_a_real_router_and_is_told_on_the_other_side() -> None:
    told: list[Envelope] = []
    with running_router() as router:
        hubs = [
            RoomLinks(
                exchange(who), {"broad": router}, REALM.id, REALM.member(who).number, lambda: 0, told.append
            )
            for who in ("a1", "cp")
        ]
        for each in hubs:
            each.start()
        own = Envelope(Identity(REALM.id, "alpha", "a1").address("rooms", "fusion"), ROOMS)

        def arrived() -> bool:
            hubs[0].tell([own])  # again, until the other has found the router
            return bool(told)

        try:
            wait_until(arrived, 60.0, "the map at the other hub")
        finally:
            for each in hubs:
                each.close()
    assert [(one.address.soldier, one.address.source, one.message) for one in told[:1]] == [
        ("cp", "a1", ROOMS)
    ]


def test_only_broadband_links_carry_maps() -> None:
    narrow = LinkProfile(name="squad", kind="udp", rate_bits_per_s=9600)
    broad = LinkProfile(name="broad", kind="zenoh", rate_bits_per_s=1_000_000, router="tcp/127.0.0.1:7447")
    assert broadband([narrow]) == {}
    assert broadband([narrow, broad]) == {"broad": "tcp/127.0.0.1:7447"}
