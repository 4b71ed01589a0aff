"""Sites: walls are where no door is, ways are as short as geometry allows and cross walls only at doors."""

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString, Point

from bootprint.config import Origin, fit
from bootprint.config_errors import Misfit
from bootprint.errors import ConfigError
from bootprint.geodesy import LocalFrame
from proving_ground.scenario import load_scenario
from proving_ground.scenario.geojson import write_plan
from proving_ground.scenario.paths import Paths, Position
from proving_ground.scenario.routes import length_m
from proving_ground.scenario.schema.site import SiteTable
from proving_ground.scenario.site import CLEARANCE_M, OUTSIDE, Site
from proving_ground.scenario.site_builder import build_site
from support.scenarios import HEAD, HOUSE, UNITS, house, team, written


def site_of(**tables: object) -> Site:
    table = fit(dict(tables), SiteTable)
    assert not isinstance(table, Misfit), table
    return build_site(table)


ROOMS = [
    {"name": "a", "rectangle_m": [0, 0, 4, 4]},
    {"name": "b", "rectangle_m": [4, 0, 8, 4]},
    {"name": "c", "rectangle_m": [0, 4, 8, 8]},
]


def three_rooms(*doors: dict[str, object]) -> Site:
    return site_of(buildings=[{"name": "house", "rooms": ROOMS, "doors": list(doors)}])


def test_walls_are_the_outlines_less_the_doors() -> None:
    site = three_rooms(
        {"between": ["a", "b"], "width_m": 1.0},
        {"between": ["b", "outside"], "at_m": [8, 2], "width_m": 1.5},
    )
    # Outer walls 4·8 m, inner ones 8 m and 4 m, doors 1 m and 1.5 m.
    assert site.walls[0].length == pytest.approx(32 + 12 - 2.5, abs=1e-3)
    assert site.walls[0].distance(Point(4, 2)) == pytest.approx(0.5, abs=1e-3)
    assert site.walls[0].distance(Point(8, 2)) == pytest.approx(0.75, abs=1e-3)


def test_a_door_without_a_place_is_in_the_middle_of_the_longest_shared_wall() -> None:
    site = three_rooms({"between": ["a", "c"]}, {"between": ["c", "outside"]})
    assert site.doors[0].middle_m == pytest.approx((2, 4))
    assert site.doors[1].middle_m == pytest.approx((4, 8))


def test_around_a_block_the_way_is_the_taut_string() -> None:
    site = site_of(obstacles=[{"name": "block", "rectangle_m": [-5, -5, 5, 5]}])
    way = Paths(site).between(Position((-20.0, 0.0), OUTSIDE), Position((20.0, 0.0), OUTSIDE))
    assert way is not None
    # Taut around two corners that are the clearance off the block.
    corner = 5 + CLEARANCE_M
    expected = 2 * math.hypot(20 - corner, corner) + 2 * corner
    assert length_m(way) == pytest.approx(expected, abs=0.01)


def test_ways_lead_through_doors_only() -> None:
    site = three_rooms(
        {"between": ["a", "b"]}, {"between": ["b", "c"]}, {"between": ["c", "outside"], "at_m": [0, 6]}
    )
    paths = Paths(site)
    way = paths.between(Position((-3.0, 1.0), OUTSIDE), Position((1.0, 1.0), "a"))
    assert way is not None
    assert [door.name for door in paths.doors_along(way)] == ["c - outside", "b - c", "a - b"]
    assert not LineString(way[0].points_m).intersects(site.walls[0])


def test_no_door_no_way() -> None:
    site = three_rooms({"between": ["a", "outside"], "at_m": [0, 2]})
    paths = Paths(site)
    assert paths.between(Position((1.0, 1.0), "a"), Position((6.0, 2.0), "b")) is None


_AT = st.tuples(st.floats(-6, 14), st.floats(-6, 14))


@given(_AT, _AT)
def test_any_way_keeps_off_walls_and_obeys_the_triangle(
    first: tuple[float, float], second: tuple[float, float]
) -> None:
    start, goal = (_placed(SITE, at) for at in (first, second))
    way = PATHS.between(start, goal)
    assert way is not None
    length = length_m(way)
    assert length >= math.dist(start.at_m, goal.at_m) - 1e-9
    back = PATHS.between(goal, start)
    assert back is not None
    assert length_m(back) == pytest.approx(length, abs=0.05)
    if length > 0.0:
        line = LineString(way[0].points_m)
        assert not line.intersects(SITE.walls[0])
        away = line.difference(shapely.union_all([Point(door.middle_m).buffer(0.7) for door in SITE.doors]))
        assert away.is_empty or away.distance(SITE.walls[0]) > CLEARANCE_M - 0.05


SITE = three_rooms(
    {"between": ["a", "b"]},
    {"between": ["b", "c"]},
    {"between": ["c", "outside"], "at_m": [2, 8]},
    {"between": ["a", "outside"], "at_m": [0, 2]},
)
PATHS = Paths(SITE)


def _placed(site: Site, at_m: tuple[float, float]) -> Position:
    space = site.space_at(at_m, 0)
    assert space is not None
    return Position(space.settle(at_m), space.name)


def test_stairs_climb_evenly_over_their_flights_and_landings_are_level(tmp_path: Path) -> None:
    bent = HOUSE.replace("[[1, 1], [1, 5.5]]", "[[1, 3], [1, 5.4], [3, 5.4], [3, 3]]")
    scenario = load_scenario(
        written(tmp_path, HEAD + UNITS + bent + team('  { do = "walk", to = "upstairs" },'))
    )
    legs = [leg for leg in scenario.first_play.timetables["a1"].itinerary.legs if leg.gait == "stairs"]
    assert len(legs) == 1
    assert legs[0].points_m[:, 2].tolist() == pytest.approx([0, 1.5, 1.5, 3])


def test_hills_lift_the_ground_and_the_way_over_them(tmp_path: Path) -> None:
    hill = "[site]\nhills = [{ at_m = [50, 0], height_m = 10, radius_m = 30 }]\n"
    text = HEAD + UNITS + hill + team('  { do = "walk", to = [100, 0] },', at="[0, 0]", soldiers=1)
    legs = load_scenario(written(tmp_path, text)).first_play.timetables["a1"].itinerary.legs
    walk = next(leg for leg in legs if leg.travels)
    assert walk.points_m[:, 2].max() == pytest.approx(10.0, abs=0.2)
    assert walk.points_m[[0, -1], 2].tolist() == [0.0, 0.0]
    assert np.abs(np.diff(walk.points_m[:, 2])).max() < 2.5


def test_a_plan_survives_geojson(tmp_path: Path) -> None:
    scenario = house(tmp_path, '  { do = "walk", to = "upstairs" },')
    document = write_plan(scenario.site, scenario.file.site, scenario.file.origin)
    (tmp_path / "plan.geojson").write_text(json.dumps(document), encoding="utf-8")
    floors = "[site]\nplan = 'plan.geojson'\n"
    floors += "floors = [{ level = 0, height_m = 0.0 }, { level = 1, height_m = 3.0 }]\n"
    again = load_scenario(
        written(tmp_path, HEAD + UNITS + floors + team('  { do = "walk", to = "upstairs" },'))
    )
    assert again.site.spaces.keys() == scenario.site.spaces.keys()
    assert [door.name for door in again.site.doors] == [door.name for door in scenario.site.doors]
    for before, after in zip(scenario.site.doors, again.site.doors, strict=True):
        assert math.dist(before.middle_m, after.middle_m) < 0.002
    assert again.site.walls[0].length == pytest.approx(scenario.site.walls[0].length, abs=0.02)


def test_geojson_is_longitude_before_latitude_and_counter_clockwise(tmp_path: Path) -> None:
    scenario = house(tmp_path, '  { do = "walk", to = "room" },')
    origin = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=40.0)
    features = write_plan(scenario.site, scenario.file.site, origin)["features"]
    place = next(f for f in features if f["properties"]["kind"] == "place")
    longitude, latitude = place["geometry"]["coordinates"]
    assert LocalFrame(origin).to_enu(latitude, longitude, 40.0)[:2] == pytest.approx((3, -20), abs=1e-3)
    ring = next(f for f in features if f["properties"]["kind"] == "room")["geometry"]["coordinates"][0]
    assert ring[0] == ring[-1]
    assert sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in pairwise(ring)) > 0


BAD_PLANS = [
    ("{", "not valid JSON"),
    ("[]", "FeatureCollection"),
    ('{"features": [3]}', "features[0]: not a GeoJSON feature"),
    ('{"features": [{"properties": {"kind": "rom"}, "geometry": {}}]}', "expected one of room"),
    ('{"features": [{"properties": {"kind": "room"}, "geometry": {"type": "Point"}}]}', "must be a Polygon"),
    (
        '{"features": [{"properties": {"kind": "place", "name": "x"}, "geometry": '
        '{"type": "Point", "coordinates": [200, "y"]}}]}',
        "longitude before latitude",
    ),
    (
        '{"features": [{"properties": {"kind": "place", "nam": "x"}, "geometry": '
        '{"type": "Point", "coordinates": [18, 59]}}]}',
        "did you mean 'name'",
    ),
]


@pytest.mark.parametrize(("plan", "words"), BAD_PLANS)
def test_bad_plans(tmp_path: Path, plan: str, words: str) -> None:
    (tmp_path / "plan.geojson").write_text(plan, encoding="utf-8")
    text = HEAD + UNITS + "[site]\nplan = 'plan.geojson'\n" + team('  { do = "gather" },', at="[0, 0]")
    with pytest.raises(ConfigError) as caught:
        load_scenario(written(tmp_path, text))
    assert words in str(caught.value)
    assert "plan.geojson" in str(caught.value)
