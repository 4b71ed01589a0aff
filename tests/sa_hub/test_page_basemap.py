"""The basemap's tiles as browsers ask for them: MBTiles by tile, PMTiles by ranges, garbage refused."""

import gzip
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from bootprint.errors import ConfigError
from sa_hub.page.access import new_token
from sa_hub.page.app import build_app
from sa_hub.page.basemap import kind_of, tile, tile_json
from sa_hub.page.desk import Desk
from sa_hub.page.settings import PageSettings, check_page
from support.page_post import LOCAL, PostAir
from support.tiles import vector_tile, write_mbtiles, write_pmtiles

TILE = vector_tile("water", ((0, 0), (9, 0), (9, 9)), kind="lake")


def client(tmp_path: Path, basemap: Path, **settings: object) -> TestClient:
    post = PostAir(tmp_path).desk.post
    desk = Desk(post, PostAir(tmp_path).desk.audit, basemap=basemap)
    return TestClient(build_app(desk, PageSettings(**settings)), base_url=LOCAL)  # type: ignore[arg-type]


def test_tiles_are_unzipped_and_their_rows_counted_from_the_north(tmp_path: Path) -> None:
    path = tmp_path / "area.mbtiles"
    write_mbtiles(path, TILE, "pbf", ["water"])
    with closing(sqlite3.connect(path)) as file, file:
        file.execute("INSERT INTO tiles VALUES (2, 1, 3, ?)", (gzip.compress(b"north"),))
    with client(tmp_path, path) as browser:
        assert browser.get("/api/v1/post").json()["basemap"] == "mbtiles"
        said = browser.get("/basemap/tiles.json").json()
        assert (said["format"], said["minzoom"], said["maxzoom"]) == ("vector", 0, 2)
        assert [each["id"] for each in said["vector_layers"]] == ["water"]
        whole = browser.get("/basemap/0/0/0")
        assert (whole.content, whole.headers["content-type"]) == (TILE, "application/x-protobuf")
        assert browser.get("/basemap/2/1/0").content == b"north"
        assert [browser.get(f"/basemap/{each}").status_code for each in ("2/1/3", "99/0/0", "0/7/0")] == [
            204
        ] * 3


def test_a_pmtiles_file_is_given_by_ranges(tmp_path: Path) -> None:
    path = tmp_path / "area.pmtiles"
    write_pmtiles(path, TILE, "pbf", ["water"])
    with client(tmp_path, path) as browser:
        assert browser.get("/api/v1/post").json()["basemap"] == "pmtiles"
        part = browser.get("/basemap", headers={"range": "bytes=0-6"})
        assert (part.status_code, part.content) == (206, b"PMTiles")
        assert browser.get("/basemap/tiles.json").status_code == 503


@pytest.mark.parametrize("way", ["/basemap", "/basemap/tiles.json", "/basemap/0/0/0"])
def test_a_basemap_takes_a_token_where_the_page_does(tmp_path: Path, way: str) -> None:
    path = tmp_path / "area.mbtiles"
    write_mbtiles(path, TILE, "pbf", ["water"])
    token, known = new_token("eye", "view")
    with client(tmp_path, path, tokens=(known,)) as browser:
        assert browser.get(way).status_code == 401
        assert browser.get(way, headers={"authorization": f"Bearer {token}"}).status_code == 200


@pytest.mark.parametrize("data", [b"", b"PMTiles\x02", b"a picture", b"SQLite format 3"])
def test_what_is_no_basemap_is_refused_at_the_start(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "area").write_bytes(data)
    with pytest.raises(ConfigError, match="neither PMTiles"):
        check_page(PageSettings(basemap="area"), tmp_path, "here")


def test_a_damaged_mbtiles_file_is_said_to_be_one(tmp_path: Path) -> None:
    path = tmp_path / "area.mbtiles"
    path.write_bytes(b"SQLite format 3\0" + bytes(500))
    assert kind_of(path) == "mbtiles"
    for ask in (lambda: tile(path, 0, 0, 0), lambda: tile_json(path)):
        with pytest.raises(ConfigError, match="MBTiles"):
            ask()
