"""Maps of rooms: runs and cells, GeoJSON there and back, and files that are none."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from bootprint.rooms import SIGMAS_M, Cell, Place, RoomMap, cells_of, rounded_sigma_m, runs_of
from bootprint.rooms_geojson import geojson, read_geojson

ORIGIN = Origin(latitude_deg=58.4, longitude_deg=15.6, height_m=80.0)
places = st.builds(Place, st.integers(-1, 2), st.integers(-40, 40), st.integers(-40, 40))
cells = st.builds(Cell, st.sampled_from(("walked", "seen", "wall")), st.sampled_from(SIGMAS_M))
maps = st.dictionaries(places, cells, max_size=60)


@given(maps)
def test_runs_hold_the_same_cells(drawn: dict[Place, Cell]) -> None:
    assert cells_of(runs_of(drawn)) == drawn


def test_a_row_of_equal_cells_is_one_run() -> None:
    row = {Place(0, 3, column): Cell("walked", 0.5) for column in range(-2, 5)}
    assert runs_of(row) == [(0, 3, -2, 7, "walked", 0.5)]


@settings(max_examples=30, deadline=None)
@given(maps)
def test_geojson_leads_back_to_the_same_map(drawn: dict[Place, Cell]) -> None:
    levels = tuple((floor, 2.8 * floor) for floor in sorted({place.floor for place in drawn}))
    rooms = RoomMap(time_ns=5, soldier="a1", cell_m=0.5, levels=levels, runs=tuple(runs_of(drawn)))
    back = read_geojson(json.dumps(geojson(rooms, ORIGIN)).encode(), ORIGIN)
    assert cells_of(back.runs) == drawn
    assert (back.levels, back.soldier, back.time_ns) == (levels, "a1", 5)


def test_a_rectangle_lies_where_its_cells_lie_on_earth() -> None:
    """Two rows of four cells of half a metre: one rectangle from (10, −3) to (12, −2) m."""
    runs = tuple((1, row, 20, 4, "walked", 0.3) for row in (-6, -5))
    rooms = RoomMap(time_ns=0, soldier="a1", cell_m=0.5, levels=((1, 2.8),), runs=runs)
    (feature,) = geojson(rooms, ORIGIN)["features"]
    ((ring,),) = feature["geometry"]["coordinates"]
    frame = LocalFrame(ORIGIN)
    corners = [frame.to_enu(latitude, longitude, 82.8)[:2] for longitude, latitude in ring]
    expected = [(10.0, -3.0), (12.0, -3.0), (12.0, -2.0), (10.0, -2.0), (10.0, -3.0)]
    assert [pytest.approx(corner, abs=1e-3) for corner in corners] == expected
    assert feature["properties"]["floor"] == 1


@pytest.mark.parametrize("data", [b"", b"{}", b'{"type": "FeatureCollection", "features": []}', b"[1]"])
def test_a_file_that_is_no_map_is_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match="no map of rooms"):
        read_geojson(data, ORIGIN)


def test_sigmas_are_rounded_up() -> None:
    assert [rounded_sigma_m(value) for value in (0.0, 0.1, 0.11, 4.0, 40.0)] == [0.1, 0.1, 0.2, 5.0, 5.0]
