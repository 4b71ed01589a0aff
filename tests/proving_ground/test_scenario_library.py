"""The scenarios that come with the project: nobody walks through walls, and they are as long as they say."""

from itertools import pairwise

import numpy as np
import pytest
from shapely import LineString

from proving_ground.people import Leg
from proving_ground.scenario import Scenario, library, load_scenario
from proving_ground.scenario.timeline import distance_m, longest_m

SCENARIOS = {name: load_scenario(name) for name in library()}


@pytest.mark.parametrize("name", library())
def test_legs_join_and_last_as_long_as_the_exercise(name: str) -> None:
    play = SCENARIOS[name].first_play
    for table in play.timetables.values():
        for before, after in pairwise(table.itinerary.legs):
            assert np.linalg.norm(after.points_m[0] - before.points_m[-1]) < 0.2
        assert table.end_s == pytest.approx(play.duration_s, abs=0.06)


@pytest.mark.parametrize("name", library())
def test_nobody_walks_through_walls_or_obstacles(name: str) -> None:
    scenario = SCENARIOS[name]
    for table in scenario.first_play.timetables.values():
        for leg in table.itinerary.legs:
            if leg.travels:
                assert not _hits(scenario, leg), (name, leg)


def _hits(scenario: Scenario, leg: Leg) -> bool:
    """Whether a way crosses a wall of any storey that it touches, or on the ground an obstacle."""
    site, way = scenario.site, LineString(leg.points_m[:, :2])
    low, high = leg.points_m[:, 2].min(), leg.points_m[:, 2].max()
    levels = [level for level, height in site.heights_m.items() if low - 0.1 <= height <= high + 0.1]
    walls = any(way.intersects(site.walls[level]) for level in levels)
    return walls or any(way.intersects(obstacle) for obstacle in site.obstacles.values())


def test_the_check_for_walls_can_fail() -> None:
    through = Leg("walk", np.array([[2.0, 1.0, 0.0], [10.0, 1.0, 0.0]]))
    assert _hits(SCENARIOS["building-clearing"], through)


@pytest.mark.parametrize("name", library())
def test_speeds_are_human(name: str) -> None:
    """Between the start and the end of each walk or run, and not only as asked for."""
    play = SCENARIOS[name].first_play
    for soldier, table in play.timetables.items():
        assert 0.0 < distance_m(table) < 4.0 * play.duration_s, soldier


def soldiers(name: str) -> int:
    return len(SCENARIOS[name].cast.soldiers)


def test_building_clearing_is_foi_s() -> None:
    scenario = SCENARIOS["building-clearing"]
    assert soldiers("building-clearing") == 8
    assert len(scenario.site.heights_m) == 2
    assert scenario.first_play.duration_s == pytest.approx(210, abs=15)
    for soldier, table in scenario.first_play.timetables.items():
        climbed = [leg for leg in table.itinerary.legs if leg.gait == "stairs"]
        assert len(climbed) == 2, soldier  # up and down again
        start, end = table.itinerary.legs[0].points_m[0], table.itinerary.legs[-1].points_m[-1]
        assert np.linalg.norm(end - start) < 0.01  # returned to the same position


def test_every_room_of_the_house_is_entered() -> None:
    scenario = SCENARIOS["building-clearing"]
    seen = set()
    for table in scenario.first_play.timetables.values():
        for leg in table.itinerary.legs:
            for east, north, up in leg.points_m.tolist():
                level = 1 if up > 2.7 else 0
                space = scenario.site.space_at((east, north), level)
                seen.add(space.name if space else "")
    assert {space.name for space in scenario.site.rooms()} <= seen


def test_lengths_of_the_sources() -> None:
    assert longest_m(SCENARIOS["urban-patrol"].first_play) == pytest.approx(4000, abs=200)
    assert longest_m(SCENARIOS["forest-march"].first_play) == pytest.approx(2430, abs=50)
    for table in SCENARIOS["straight-49m"].first_play.timetables.values():
        walks = [leg for leg in table.itinerary.legs if leg.travels]
        assert len(walks) == 11
        assert all(leg.points_m[[0, -1], 1].tolist() in ([0.0, 49.0], [49.0, 0.0]) for leg in walks)


def test_every_way_of_moving_is_in_the_library() -> None:
    gaits = {
        leg.gait
        for scenario in SCENARIOS.values()
        for table in scenario.first_play.timetables.values()
        for leg in table.itinerary.legs
    }
    assert gaits >= {
        "stand",
        "kneel",
        "prone",
        "walk",
        "run",
        "sprint",
        "crawl",
        "backward",
        "stairs",
        "lift",
        "turn",
    }
    assert gaits >= {"side_step_left", "side_step_right"}


def test_sizes_and_nets_of_platoon_and_company() -> None:
    assert soldiers("platoon-raid") == 40
    assert soldiers("company-exercise") >= 120
    nets = {name: members for name, _, members in SCENARIOS["company-exercise"].cast.nets}
    assert len(nets) == 12 + 3 + 1
    assert nets["p1s2"] == tuple(f"p1s2-{n}" for n in range(1, 11))
    assert nets["p1"] == ("p1-1", "p1-2", "p1-3", "p1s1-1", "p1s2-1", "p1s3-1", "p1s4-1")
    assert nets["coy"] == ("coy-1", "coy-2", "coy-3", "coy-4", "cp", "p1-1", "p2-1", "p3-1")


def test_another_seed_is_other_persons() -> None:
    scenario = SCENARIOS["building-clearing"]
    assert scenario.play(1).duration_s == scenario.play(1).duration_s
    assert scenario.play(1).duration_s != scenario.play(2).duration_s
