"""Maps of rooms in the fusion: drawn under the walk, laid on another's walk, and what they may not do."""

import itertools
import math
from pathlib import Path

import msgspec
import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.messages import CameraMotion, Position
from bootprint.rooms import Place, RoomMap, cells_of
from fusion.config import FusionConfig
from fusion.engine import FusionCore
from fusion.filter import StateFilter
from fusion.rooms.field import RoomField
from fusion.rooms.matching import look
from fusion.rooms.memory import load_rooms, save_rooms
from fusion.rooms.settings import RoomsConfig
from fusion.rooms.sight import sight_of
from fusion.rooms.survey import Stood, Survey
from fusion.state import Layout
from support.foot_walks import (
    EAST,
    NS,
    ORIGIN,
    T0,
    WHO,
    SimulatedFoot,
    SimulatedWalk,
    rectangle,
)

CONFIG = RoomsConfig()


def surveyed(*points: tuple[float, float], floor: int = 0) -> RoomMap:
    """The map of somebody who walked along these."""
    survey = Survey(CONFIG, "other")
    for (e0, n0), (e1, n1) in itertools.pairwise(points):
        for share in np.linspace(0.0, 1.0, 1 + math.ceil(math.dist((e0, n0), (e1, n1)))):
            survey.walk(Stood(floor, e0 + share * (e1 - e0), n0 + share * (n1 - n0), 2.8 * floor, 0.3))
    return survey.map(T0)


def walked(*points: tuple[float, float]) -> np.ndarray:
    """Points half a metre apart along a way."""
    parts = [
        np.linspace(start, end, max(2, int(2 * math.dist(start, end))), endpoint=False)
        for start, end in itertools.pairwise(points)
    ]
    return np.vstack([*parts, [points[-1]]])


def test_the_map_is_the_cells_under_the_walk() -> None:
    rooms = surveyed((0.1, 0.1), (2.9, 0.1), (2.9, 1.9))
    along = {Place(0, 0, column) for column in range(6)}
    assert set(cells_of(rooms.runs)) == along | {Place(0, row, 5) for row in range(4)}
    assert {cell.sigma_m for cell in cells_of(rooms.runs).values()} == {0.3}


def test_the_unsure_and_leaps_draw_nothing() -> None:
    survey = Survey(CONFIG, "a1")
    survey.walk(Stood(0, 0.1, 0.1, 0.0, 5.0))
    assert survey.map(T0).runs == ()
    survey.walk(Stood(0, 0.1, 0.1, 0.0, 0.5))
    survey.walk(Stood(0, 9.1, 0.1, 0.0, 0.5))
    assert len(cells_of(survey.map(T0).runs)) == 2


def test_a_map_is_told_when_it_has_grown_and_not_too_often() -> None:
    survey = Survey(CONFIG, "a1")
    survey.walk(Stood(0, 0.1, 0.1, 0.0, 0.5))
    assert survey.due(T0) is not None
    assert survey.due(T0 + 60 * NS) is None
    survey.walk(Stood(0, 1.1, 0.1, 0.0, 0.5))
    assert survey.due(T0 + 5 * NS) is None
    assert survey.due(T0 + 10 * NS) is not None


def test_a_corner_shows_the_shift_in_both_directions() -> None:
    field = RoomField(surveyed((0.0, 0.0), (12.0, 0.0), (12.0, 10.0)), 0, CONFIG)
    seen = look(walked((5.0, 0.0), (12.0, 0.0), (12.0, 8.0)) - (1.2, -0.8), np.eye(2), field, CONFIG)
    shift, covariance = seen.shift()
    assert shift == pytest.approx((1.2, -0.8), abs=0.5)
    assert np.sqrt(np.diag(covariance)).max() < 1.0
    assert seen.evidence > CONFIG.least_evidence


def test_a_corridor_tells_nothing_along_itself() -> None:
    field = RoomField(surveyed((-20.0, 0.0), (40.0, 0.0)), 0, CONFIG)
    seen = look(walked((3.0, 0.7), (18.0, 0.7)), np.eye(2), field, CONFIG)
    assert len(seen.values) == 1
    assert abs(seen.rows[0] / np.linalg.norm(seen.rows[0])) == pytest.approx((0.0, 1.0), abs=0.05)
    assert seen.values[0] * np.sign(seen.rows[0, 1]) == pytest.approx(-0.7, abs=0.35)


def test_ground_that_was_walked_all_over_or_elsewhere_is_no_evidence() -> None:
    lines = [
        (float(x), y)
        for number, y in enumerate(np.arange(-6, 7, 0.5))
        for x in ((-20, 20)[:: 1 - 2 * (number % 2)])
    ]
    everywhere = RoomField(surveyed(*lines), 0, CONFIG)
    walk = walked((-5.0, 0.0), (5.0, 0.0), (5.0, 3.0))
    assert abs(look(walk, 0.5 * np.eye(2), everywhere, CONFIG).evidence) < 1.0
    elsewhere = RoomField(surveyed((-5.0, 4.0), (3.0, 4.0), (3.0, -6.0)), 0, CONFIG)
    assert look(walk, 0.2 * np.eye(2), elsewhere, CONFIG).evidence < 0.0


def test_an_attached_offset_errs_as_it_is_told_and_its_place_is_used_again() -> None:
    """b = D − δ with D exact: position and offset are told by their sum, which is as sure as D."""
    layout = Layout.of(("left_foot",))
    state_filter = StateFilter(layout, (np.zeros(layout.size), np.eye(layout.size)))
    response = np.zeros((3, layout.size))
    response[0, 0] = response[1, 1] = -1.0
    state_filter.attach("other", np.array([2.0, 3.0, 0.0]), response, np.diag([0.01, 0.01, 0.04]))
    block = state_filter.layout.attached_of("other")
    assert block == slice(layout.size, layout.size + 3)
    summed = np.zeros((1, state_filter.layout.size))
    summed[0, [0, block.start]] = 1.0
    assert float((summed @ state_filter.covariance @ summed.T)[0, 0]) == pytest.approx(0.01)
    size = state_filter.layout.size
    state_filter.detach("other")
    state_filter.attach("third", np.zeros(3), np.zeros((3, size)), np.eye(3))
    assert state_filter.layout.attached_of("third") == block
    assert state_filter.covariance[block, : layout.size] == pytest.approx(0.0)


def test_a_saved_map_is_gone_on_from(tmp_path: Path) -> None:
    rooms = surveyed((0.0, 0.0), (4.0, 0.0))
    save_rooms(tmp_path / "rooms.geojson", rooms, ORIGIN)
    known = load_rooms(tmp_path / "rooms.geojson", ORIGIN)
    assert known is not None
    survey = Survey(CONFIG, "other", known)
    assert cells_of(survey.map(T0).runs) == cells_of(rooms.runs)


WALK = SimulatedWalk(rectangle(18, 11), 400.0, stated=(0.02, 0.02, 0.02, 0.02))
DRIFTING = SimulatedFoot("left_foot", mounting_rad=1.0, drift_rad_s=math.radians(0.12))


def ends(*told: RoomMap) -> tuple[list[float], FusionCore]:
    """Errors, m, of a foot that drifts by seven degrees a minute around a block, given maps."""
    rooms = RoomsConfig(use=True)
    core = FusionCore(
        FusionConfig(feet=("left_foot",), gnss_sources=(), start=EAST, rooms=rooms), WHO, ORIGIN
    )
    for one in told:
        core.handle(Envelope(WHO.address("rooms", one.soldier), one))
    said = [one for message in WALK.messages(DRIFTING) for one in core.handle(message)]
    positions = [
        one.message for one in said if isinstance(one.message, Position) and one.message.mode == "boots"
    ]
    return [error_m(position) for position in positions], core


def error_m(position: Position) -> float:
    truth = WALK.foot_at(DRIFTING, (position.time_ns - T0) / NS)
    return math.hypot(position.east_m - truth[0], position.north_m - truth[1])


BLOCK = ((0.0, 0.0), (18.0, 0.0), (18.0, 11.0), (0.0, 11.0), (0.0, 0.0))


@pytest.fixture(scope="module")
def alone() -> list[float]:
    return ends()[0]


def test_anothers_map_holds_a_walk_that_drifts(alone: list[float]) -> None:
    held, core = ends(surveyed(*BLOCK))
    assert core.counters["rooms_laid"] >= 1
    assert core.counters["rooms_corrections"] >= 5
    assert max(alone) > 5.0
    assert max(held) < 0.5 * max(alone)


def test_ones_own_map_and_one_of_another_place_change_nothing(alone: list[float]) -> None:
    far = surveyed(*((east + 300.0, north) for east, north in BLOCK))
    own = msgspec.structs.replace(surveyed(*BLOCK), soldier=WHO.soldier)
    for told in (far, own):
        held, core = ends(told)
        assert core.counters["rooms_laid"] == 0
        assert held == alone


def test_a_camera_sees_a_wall_and_the_space_before_it() -> None:
    """Looking west from (5, 1): a wall 3.2 m ahead is at east 1.8; a lamp and the floor are no walls."""
    motion = CameraMotion(
        time_ns=T0 + 1,
        start_time_ns=T0,
        translation_m=(0.0, 0.0, 0.0),
        rotation_rad=(0.0, 0.0, 0.0),
        landmarks_m=((3.2, 0.1, -0.2), (3.2, 2.1, 1.5), (3.2, -2.1, -1.6)),
    )
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # its level is a quarter off
    sight = sight_of(motion, turned, np.array([5.0, 1.0, 1.6, math.pi]))
    assert sight is not None
    assert sight.points_m[0] == pytest.approx((1.8, 0.9, 1.4))
    survey = Survey(CONFIG, "a1")
    survey.walk(Stood(0, 5.0, 1.0, 0.0, 0.3))
    for _ in range(CONFIG.wall_hits):
        survey.see(sight)
    kinds = {place[1:]: cell.kind for place, cell in cells_of(survey.map(T0).runs).items()}
    assert [place for place, kind in kinds.items() if kind == "wall"] == [(1, 3)]
    assert kinds[2, 10] == "walked"
    assert {kinds[1, column] for column in (6, 7, 8)} == {"seen"}
