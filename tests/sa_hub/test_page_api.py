"""The page's interface: the real application over real hubs; what it tells, lets people say, and refuses."""

import json
import math
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from xml.etree import ElementTree

import pytest
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

from bootprint.geodesy import ground_offset
from bootprint.messages import Alert, Fix, Observation
from sa_hub.history.archive import Archive
from sa_hub.page import past
from sa_hub.page.access import new_token
from sa_hub.page.app import MOST_BYTES
from sa_hub.page.openapi import openapi
from support.hub_squad import START_NS, S
from support.page_post import LOCAL, PostAir, browser, walked

API = "/api/v1"


@pytest.fixture
def air(tmp_path: Path) -> PostAir:
    return walked(PostAir(tmp_path))


def test_picture_tells_of_the_soldier_what_the_hub_knows(air: PostAir) -> None:
    with browser(air) as client:
        picture = client.get(f"{API}/picture").json()
    track = air.tracks["cp", "a1"]
    assert picture["tracks"]["a1"]["latitude_deg"] == track.latitude_deg
    assert picture["tracks"]["a1"]["time_s"] == pytest.approx(track.time_ns / S, abs=1e-6)
    assert picture["links"]["hq"]["frames_received"] > 0
    assert picture["now_s"] == pytest.approx(air.now_ns / S, abs=1e-6)


def test_soldiers_geojson_says_where_somebody_is_now_and_how_long_ago_lost(air: PostAir) -> None:
    air.cut_off.add("a1")
    air.run(220.0, {})
    with browser(air) as client:
        (feature,) = client.get(f"{API}/soldiers.geojson").json()["features"]
    age_s = (air.now_ns - air.tracks["cp", "a1"].time_ns) / S
    minutes, seconds = divmod(math.floor(age_s), 60)
    assert feature["properties"]["state"] == "lost"
    assert feature["properties"]["age"] == f"lost for {minutes}:{seconds:02d}"
    assert feature["properties"]["radius_95_m"] > 100.0


def test_live_line_sends_everything_then_only_what_is_new(air: PostAir) -> None:
    with browser(air) as client, live(client, LOCAL) as line:
        whole = line.receive_json()
        assert list(whole["tracks"]) == ["a1"]
        client.post(f"{API}/alerts", json={"kind": "help", "text": "stairs"})
        news = next_with(line, "alerts")
    assert news["tracks"] == {}
    (alert,) = news["alerts"].values()
    assert (alert["kind"], alert["text"], alert["acknowledged_by"]) == ("help", "stairs", None)


def live(client: TestClient, origin: str) -> WebSocketTestSession:
    """The live line, as a page of this origin asks for it."""
    return client.websocket_connect(f"{API}/live", headers={"origin": origin, "host": urlsplit(LOCAL).netloc})


def next_with(line: Any, kind: str) -> dict[str, Any]:
    """The next telling with news of a kind; the test's own timeout ends the waiting."""
    while True:
        news: dict[str, Any] = line.receive_json()
        if news[kind]:
            return news


def test_alert_reaches_the_soldier_over_the_radio(air: PostAir) -> None:
    with browser(air) as client:
        assert client.post(f"{API}/alerts", json={"kind": "withdraw", "text": "now"}).status_code == 200
    air.run(10.0, {})
    heard = [envelope.message for name, envelope in air.outputs if name == "a1"]
    assert [each.text for each in heard if isinstance(each, Alert)] == ["now"]


def test_acknowledgement_keeps_the_first_who_saw_it(air: PostAir) -> None:
    with browser(air) as client:
        alert = client.post(f"{API}/alerts", json={"kind": "fire"}).json()
        seen = client.post(f"{API}/alerts/{alert['id']}/acknowledgement")
        assert seen.json() == {"id": alert["id"], "acknowledged_by": "local"}
        assert client.get(f"{API}/picture").json()["alerts"][alert["id"]]["acknowledged_by"] == "local"
        assert client.post(f"{API}/alerts/nobody-1/acknowledgement").status_code == 404


def test_sighting_lies_in_the_bearing_and_range_from_where_the_soldier_is_now(air: PostAir) -> None:
    with browser(air) as client:
        soldier = client.get(f"{API}/soldiers.geojson").json()["features"][0]
        body = {"soldier": "a1", "azimuth_deg": 90.0, "range_m": 200.0, "code": "vehicle"}
        seen = client.post(f"{API}/sightings", json=body).json()
    longitude, latitude = soldier["geometry"]["coordinates"]
    east, north = ground_offset((latitude, longitude), (seen["latitude_deg"], seen["longitude_deg"]))
    assert (east, north) == (pytest.approx(200.0, abs=0.05), pytest.approx(0.0, abs=0.05))
    assert seen["accuracy_m"] >= 200.0 * math.radians(5.0)
    (told,) = [each.message for each in air.own]
    assert isinstance(told, Observation)
    assert told.soldier == "cp"


def test_fix_goes_to_the_soldiers_own_computer_if_it_is_on_this_bus(air: PostAir) -> None:
    air.reachable.add("a1")
    body = {"soldier": "a1", "latitude_deg": 59.351, "longitude_deg": 18.071, "azimuth_deg": 270.0}
    with browser(air) as client:
        assert client.post(f"{API}/fixes", json=body).json() == {"soldier": "a1", "told": True}
    (envelope,) = air.own
    assert envelope.address.key == "bp/@v1/alpha/a1/fix/page"
    assert isinstance(envelope.message, Fix)
    assert envelope.message.azimuth_rad == pytest.approx(1.5 * math.pi)


def test_fix_of_a_soldier_behind_the_radio_is_shown_and_told_on(air: PostAir) -> None:
    body = {"soldier": "a2", "latitude_deg": 59.351, "longitude_deg": 18.071, "accuracy_m": 7.0}
    with browser(air) as client:
        assert client.post(f"{API}/fixes", json=body).json() == {"soldier": "a2", "told": False}
        track = client.get(f"{API}/picture").json()["tracks"]["a2"]
    assert (track["latitude_deg"], track["mode"], track["via"]) == (59.351, "coasting", "person")
    air.run(40.0, {})
    assert air.tracks["a1", "a2"].latitude_deg == pytest.approx(59.351, abs=1e-3)


@pytest.mark.parametrize(
    ("path", "body", "status"),
    [
        ("alerts", {"kind": "boredom"}, 422),
        ("alerts", {"kind": "help", "volume": 11}, 422),
        ("alerts", {"kind": "help", "text": "x" * 201}, 422),
        ("observations", {"latitude_deg": 91.0, "longitude_deg": 0.0, "text": "?"}, 422),
        ("observations", {"latitude_deg": 59.0, "longitude_deg": 18.0}, 422),
        ("sightings", {"soldier": "a7", "azimuth_deg": 1.0, "range_m": 9.0, "code": "ied"}, 404),
        ("fixes", {"soldier": "z9", "latitude_deg": 59.0, "longitude_deg": 18.0}, 404),
    ],
)
def test_what_makes_no_sense_is_refused_with_a_reason(
    air: PostAir, path: str, body: dict[str, Any], status: int
) -> None:
    with browser(air) as client:
        answer = client.post(f"{API}/{path}", json=body)
    assert answer.status_code == status
    assert answer.json()["error"]
    assert air.own == []


def test_bodies_that_are_too_large_or_no_json_are_refused(air: PostAir) -> None:
    header = {"content-type": "application/json"}
    with browser(air) as client:
        assert (
            client.post(f"{API}/alerts", content=b"{" * (MOST_BYTES + 1), headers=header).status_code == 413
        )
        assert client.post(f"{API}/alerts", content=b"\xff{", headers=header).status_code == 400
        assert client.post(f"{API}/alerts", data={"kind": "help"}).status_code == 415


def test_other_sites_and_foreign_names_are_refused_on_loopback(air: PostAir) -> None:
    body = {"kind": "help"}
    with browser(air) as client:
        assert client.post(f"{API}/alerts", json=body, headers={"origin": "http://evil"}).status_code == 403
        assert client.get(f"{API}/picture", headers={"host": "evil.example"}).status_code == 403
        with (
            pytest.raises(WebSocketDisconnect) as refused,
            live(client, "http://evil"),
        ):
            pass
    assert refused.value.code == 4403
    assert air.own == []


def test_roles_hold_and_every_change_is_audited_refused_ones_too(air: PostAir) -> None:
    (view, viewer), (operate, operator) = new_token("eye", "view"), new_token("hand", "operate")
    with browser(air, tokens=(viewer, operator)) as client:
        assert client.get(f"{API}/picture").status_code == 401
        assert client.get(f"{API}/picture", headers=bearer(view)).status_code == 200
        assert client.post(f"{API}/alerts", json={"kind": "help"}, headers=bearer(view)).status_code == 403
        assert client.post(f"{API}/alerts", json={"kind": "help"}, headers=bearer(operate)).status_code == 200
        assert client.get(f"{API}/audit", headers=bearer(operate)).status_code == 403
    rows = [json.loads(line) for line in air.desk.audit.path.read_text().splitlines()]
    assert [(row["who"], row["change"], row["outcome"]) for row in rows] == [
        ("nobody", f"{API}/alerts", 403),
        ("hand", f"{API}/alerts", 200),
    ]
    assert rows[1]["asked"] == {"kind": "help", "text": ""}


def bearer(token: str) -> dict[str, str]:
    return {"authorization": f"Bearer {token}"}


def test_session_by_cookie_lets_a_browser_in_until_it_leaves(air: PostAir) -> None:
    token, known = new_token("hand", "operate")
    with browser(air, tokens=(known,)) as client:
        assert client.post(f"{API}/session", json={"token": "guess"}).status_code == 401
        assert client.post(f"{API}/session", json={"token": token}).json()["role"] == "operate"
        assert client.get(f"{API}/post").json()["who"] == "hand"
        client.delete(f"{API}/session")
        assert client.get(f"{API}/post").status_code == 401


def test_floods_of_changes_are_held_to_the_rate(air: PostAir) -> None:
    with browser(air, changes_per_s=0.5) as client:
        found = [client.post(f"{API}/alerts", json={"kind": "other"}).status_code for _ in range(4)]
    assert found == [200, 200, 429, 429]
    assert len(air.own) == 2


def test_the_past_is_the_picture_as_it_was(tmp_path: Path) -> None:
    air = walked(PostAir(tmp_path, Archive(f"sqlite:///{tmp_path / 'history.db'}")), 10.0)
    then_ns, then = air.now_ns, air.tracks["cp", "a1"]
    walked(air, 30.0)
    moment_s = then_ns / S
    with browser(air) as client:
        client.post(f"{API}/alerts", json={"kind": "help"})
        then_told = client.get(f"{API}/history/picture", params={"time_s": moment_s}).json()
        span = client.get(f"{API}/history").json()
        whole = {"begin_s": span["begin_s"], "end_s": span["end_s"] + 1.0}
        trails = client.get(f"{API}/history/trails.geojson", params=whole).json()
        backwards = client.get(f"{API}/history/trails.geojson", params={"begin_s": 9.0, "end_s": 1.0})
    assert then_told["tracks"]["a1"]["time_s"] == pytest.approx(then.time_ns / S, abs=1e-6)
    assert span["begin_s"] == pytest.approx(START_NS / S, abs=2.0)
    (trail,) = trails["features"]
    assert len(trail["properties"]["times_s"]) == len(trail["geometry"]["coordinates"]) > 2
    assert backwards.status_code == 422


def test_trails_that_are_too_long_for_an_answer_say_where_they_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    air = walked(PostAir(tmp_path, Archive(f"sqlite:///{tmp_path / 'history.db'}")), 30.0)
    asked = {"begin_s": START_NS / S, "end_s": air.now_ns / S + 1.0}
    with browser(air) as client:
        whole = client.get(f"{API}/history/trails.geojson", params=asked).json()
        monkeypatch.setattr(past, "MOST_POINTS", 2)
        cut = client.get(f"{API}/history/trails.geojson", params=asked).json()
    times_s, first_s = (each["features"][0]["properties"]["times_s"] for each in (whole, cut))
    assert len(times_s) > 3
    assert whole["until_s"] == pytest.approx(asked["end_s"], abs=1e-6)
    assert (first_s, cut["until_s"]) == (times_s[:2], times_s[2])


def test_a_time_is_exported_as_a_file(tmp_path: Path) -> None:
    air = walked(PostAir(tmp_path, Archive(f"sqlite:///{tmp_path / 'history.db'}")))
    asked = {"begin_s": START_NS / S, "end_s": air.now_ns / S + 1.0}
    with browser(air) as client:
        gpx = client.get(f"{API}/history/export", params=asked | {"format": "gpx"})
        unknown = client.get(f"{API}/history/export", params=asked | {"format": "doc"})
    points = ElementTree.fromstring(gpx.content).iter("{http://www.topografix.com/GPX/1/1}trkpt")
    assert [point.get("lat") for point in points][-1] == f"{air.tracks['cp', 'a1'].latitude_deg:.7f}"
    assert gpx.headers["content-disposition"].endswith('.gpx"')
    assert unknown.status_code == 422


def test_without_an_archive_the_past_says_how_to_have_one(air: PostAir) -> None:
    with browser(air) as client:
        assert client.get(f"{API}/history").json() == {"kept": False, "begin_s": None, "end_s": None}
        refused = client.get(f"{API}/history/picture", params={"time_s": 1.0})
    assert refused.status_code == 404
    assert "[hub.history]" in refused.json()["error"]


def test_openapi_describes_what_is_answered(air: PostAir) -> None:
    document = json.loads(json.dumps(openapi()))
    schemas = document["components"]["schemas"]
    with browser(air) as client:
        assert client.get(f"{API}/openapi.json").json() == document
        client.post(f"{API}/alerts", json={"kind": "help"})
        for path, operations in document["paths"].items():
            if "get" not in operations or operations["get"]["parameters"]:
                continue
            schema = operations["get"]["responses"]["200"]["content"]["application/json"]["schema"]
            check(client.get(path).json(), schema, schemas)


def check(value: Any, schema: dict[str, Any], schemas: dict[str, Any]) -> None:
    """Hold an answer to its description: known keys only, required ones there, all the way down."""
    if "$ref" in schema:
        schema = schemas[schema["$ref"].rpartition("/")[2]]
    if isinstance(value, list):
        for each in () if "prefixItems" in schema else value:
            check(each, schema["items"], schemas)
    elif isinstance(value, dict) and "properties" in schema:
        properties, rest = schema.get("properties", {}), schema.get("additionalProperties")
        assert set(schema.get("required", ())) <= set(value)
        for key, inner in value.items():
            assert key in properties or rest is not None, key
            found = properties.get(key, rest)
            if isinstance(found, dict) and "anyOf" not in found:
                check(inner, found, schemas)
