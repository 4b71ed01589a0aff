"""Tasks: who does what where and when, with the times that waiting for each other makes."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from proving_ground.people import Leg, leg_duration_s
from proving_ground.scenario import Play, Scenario, load_scenario
from support.scenarios import HEAD, HOUSE, UNITS, house, team, written

OPEN = HEAD + UNITS


def legs(play: Play, soldier: str) -> list[tuple[float, float, Leg]]:
    """A soldier's legs with their starts and ends."""
    rows, time_s = [], 0.0
    for leg in play.timetables[soldier].itinerary.legs:
        end_s = time_s + leg_duration_s(play.persons[soldier], leg)
        rows.append((time_s, end_s, leg))
        time_s = end_s
    return rows


def moves(play: Play, soldier: str, gait: str = "") -> list[tuple[float, float, Leg]]:
    return [row for row in legs(play, soldier) if row[2].travels and gait in (row[2].gait, "")]


def place_at(play: Play, soldier: str, time_s: float) -> np.ndarray:
    """Where a soldier is, at an even pace along each leg."""
    for start_s, end_s, leg in legs(play, soldier):
        if time_s <= end_s:
            share = (time_s - start_s) / (end_s - start_s)
            steps = np.linalg.norm(np.diff(leg.points_m, axis=0), axis=1)
            arc = np.concatenate([[0.0], np.cumsum(steps)])
            return np.array([np.interp(share * arc[-1], arc, column) for column in leg.points_m.T])
    return legs(play, soldier)[-1][2].points_m[-1]


def in_the_open(folder: Path, *teams: str) -> Scenario:
    return load_scenario(written(folder, OPEN + "".join(teams)))


def test_a_file_keeps_its_spacing(tmp_path: Path) -> None:
    file = team(
        '  { do = "walk", via = [[0, 60]], to = [60, 60] },', "formation = { spacing_m = 4 }", at="[0, 0]"
    )
    play = in_the_open(tmp_path, file).first_play
    start_s, end_s, _ = moves(play, "a1")[0]
    for time_s in np.linspace(start_s + 3, end_s - 3, 9):
        places = [place_at(play, f"a{n}", float(time_s)) for n in (1, 2, 3, 4)]
        # Along the way, which has one corner: distances are 4 m or a little less across it.
        gaps = [float(np.linalg.norm(a - b)) for a, b in pairwise(places)]
        assert max(gaps) < 5.0
        assert min(gaps) > 2.5
    ends = [moves(play, f"a{n}")[-1][2].points_m[-1, 0] for n in (1, 2, 3, 4)]
    assert ends == pytest.approx([60, 56, 52, 48])


def test_a_line_keeps_its_places(tmp_path: Path) -> None:
    line = team(
        '  { do = "walk", to = [0, 50] },', 'formation = { kind = "line", spacing_m = 5 }', at="[0, 0]"
    )
    play = in_the_open(tmp_path, line).first_play
    ends = [moves(play, f"a{n}")[-1][2].points_m[-1, :2].tolist() for n in (1, 2, 3, 4)]
    # Left and right of the first in turn, facing north: left is west.
    assert np.array(ends) == pytest.approx(np.array([[0, 50], [-5, 50], [5, 50], [-10, 50]]))


def test_waiting_for_a_task_and_for_a_time(tmp_path: Path) -> None:
    first = team(
        '  { do = "walk", to = [0, 40], name = "there" },\n  { do = "stand", for_s = 1 },',
        at="[0, 0]",
        soldiers=2,
    )
    second = team(
        '  { do = "wait", until = "there", after_s = 3, posture = "kneel" },\n  { do = "run", to = [20, 40] },\n'
        '  { do = "stand", until_s = 90 },\n  { do = "walk", to = [20, 50] },',
        at="[20, 0]",
        soldiers=1,
    )
    play = in_the_open(tmp_path, first, second).first_play
    there_s = max(moves(play, soldier)[-1][1] for soldier in ("a1", "a2"))
    run, walk = moves(play, "a3")
    assert run[0] == pytest.approx(there_s + 3.0)
    assert [leg.gait for _, end_s, leg in legs(play, "a3") if end_s <= run[0]] == ["stand", "kneel"]
    assert walk[0] == pytest.approx(90.0)


def test_stack_and_clear(tmp_path: Path) -> None:
    tasks = '  { do = "stack_up", door = "front door", hold_s = 2 },\n'
    tasks += '  { do = "clear", room = "hall", interval_s = 1 },'
    play = house(tmp_path, tasks).first_play
    walks = {soldier: moves(play, soldier) for soldier in ("a1", "a2", "a3", "a4")}
    stacked = [rows[0][2].points_m[-1] for rows in walks.values()]
    # Along the wall, outside, on one side of the door, the first nearest to it.
    assert all(-0.6 < place[1] < -0.3 for place in stacked)
    beside = [place[0] - 3.0 for place in stacked]
    assert sorted(beside, key=abs) == beside
    assert len({np.sign(x) for x in beside}) == 1
    # They enter in order, an interval apart, when the last is there and has held for two seconds.
    entries = [rows[1][0] for rows in walks.values()]
    assert np.diff(entries) == pytest.approx([1, 1, 1])
    assert entries[0] >= max(rows[0][1] for rows in walks.values()) + 2.0 - 1e-9
    # Each ends at a corner of its own, first and second at the far ones.
    corners = [rows[1][2].points_m[-1, :2] for rows in walks.values()]
    assert {tuple(np.round(corner, 1)) for corner in corners} == {
        (0.6, 5.4),
        (5.4, 5.4),
        (0.6, 0.6),
        (5.4, 0.6),
    }
    assert all(corner[1] > 5 for corner in corners[:2])
    # The first goes left of the door, which, inwards, is west.
    assert corners[0][0] < 1 < 5 < corners[1][0]


def test_bounds_alternate_and_pass_each_other(tmp_path: Path) -> None:
    bound = team('  { do = "bound", to = [0, 60], length_m = 10 },', at="[0, 0]", soldiers=2)
    play = in_the_open(tmp_path, bound).first_play
    first, second = (moves(play, soldier, "sprint") for soldier in ("a1", "a2"))
    spans = sorted((start_s, end_s) for start_s, end_s, _ in [*first, *second])
    assert all(before[1] <= after[0] + 1e-9 for before, after in pairwise(spans))  # never both at once
    order = [soldier for _, soldier in sorted([(r[0], 1) for r in first] + [(r[0], 2) for r in second])]
    assert all(before != after for before, after in pairwise(order))
    lengths = [float(np.linalg.norm(leg.points_m[-1] - leg.points_m[0])) for _, _, leg in first]
    assert lengths == pytest.approx([10, 20, 20, 10])
    assert "prone" in {leg.gait for _, _, leg in legs(play, "a2")}


def test_following_somebody_through_a_task(tmp_path: Path) -> None:
    ahead = team('  { do = "run", via = [[0, 50]], to = [50, 50], name = "dash" },', at="[0, 0]", soldiers=1)
    behind = team(
        '  { do = "follow", soldier = "a1", task = "dash", spacing_m = 6 },', at="[0, -6]", soldiers=1
    )
    play = in_the_open(tmp_path, ahead, behind).first_play
    way = moves(play, "a2")[-1][2]
    assert way.gait == "run"
    assert way.points_m[-1, :2].tolist() == pytest.approx([44, 50])
    assert way.points_m[-2, :2].tolist() == pytest.approx([0, 50])
    assert moves(play, "a2")[0][0] > moves(play, "a1")[0][0]


def test_side_steps_and_backward_walks_face_across_and_against_the_way(tmp_path: Path) -> None:
    tasks = (
        '  { do = "side_step", leading = "left", to = [0, 8] },\n'
        '  { do = "backward", to = [8, 8] },\n  { do = "turn", by_deg = 180 },'
    )
    scenario = in_the_open(tmp_path, team(tasks, "facing_deg = 90", at="[0, 0]", soldiers=1))
    side, back = moves(scenario.first_play, "a1")
    assert side[2].facing_rad == pytest.approx(0.0)  # north, led by the left foot: facing east
    assert back[2].facing_rad is not None
    assert np.cos(back[2].facing_rad) == pytest.approx(-1.0)  # going east: facing west
    turns = [leg for _, _, leg in legs(scenario.first_play, "a1") if leg.gait == "turn"]
    assert len(turns) == 2  # one before walking backward, one at the end
    assert np.cos(turns[-1].facing_rad or 0.0) == pytest.approx(1.0)


LIFT = HOUSE.replace(
    "stairs = [",
    'lifts = [{ name = "lift", at_m = [4, 4], rooms = ["hall", "upstairs"], speed_m_s = 1.5 }]\nstairs = [',
)


def test_a_lift_is_taken_together_by_those_who_ask_for_it(tmp_path: Path) -> None:
    tasks = '  { do = "walk", to = "upstairs", by = "lift" },\n  { do = "lift", by = "lift", to_floor = 0 },'
    scenario = load_scenario(written(tmp_path, HEAD + UNITS + LIFT + team(tasks)))
    play = scenario.first_play
    rides = {s: [row for row in legs(play, s) if row[2].gait == "lift"] for s in ("a1", "a2", "a3", "a4")}
    for number in (0, 1):
        assert len({round(rows[number][0], 6) for rows in rides.values()}) == 1
        places = [rows[number][2].points_m[0, :2] for rows in rides.values()]
        assert min(np.linalg.norm(a - b) for i, a in enumerate(places) for b in places[:i]) > 0.5
    up = rides["a1"][0][2]
    assert up.points_m[:, 2].tolist() == [0.0, 3.0]
    assert up.duration_s == pytest.approx(3.0 / 1.5 + 2.0)


def test_copies_for_several_units_are_shifted_and_numbered(tmp_path: Path) -> None:
    units = 'units = [{ id = "p", kind = "platoon" }, { id = "s1", kind = "squad", parent = "p" }, '
    units += (
        '{ id = "s2", kind = "squad", parent = "p" }]\nnets = [{ each = "platoon" }, { each = "squad" }]\n'
    )
    places = '[site]\nplaces = [{ name = "goal 1", at_m = [0, 30] }, { name = "goal 2", at_m = [50, 40] }]\n'
    teams = (
        '[[teams]]\nunits = ["s1", "s2"]\nsoldiers = 2\nroles = ["squad_leader"]\nat = [0, 0]\nshift_m = [50, 0]\n'
        'tasks = [{ do = "walk", to = "goal {k}" }, { do = "run", to = [5, 5] }]\n'
    )
    scenario = load_scenario(written(tmp_path, HEAD + units + places + teams))
    play = scenario.first_play
    assert list(play.timetables) == ["s1-1", "s1-2", "s2-1", "s2-2"]
    assert moves(play, "s2-1")[0][2].points_m[-1, :2].tolist() == pytest.approx([50, 40])
    assert moves(play, "s2-1")[1][2].points_m[-1, :2].tolist() == pytest.approx([55, 5])
    nets = {name: members for name, _, members in scenario.cast.nets}
    assert nets == {"p": ("s1-1", "s2-1"), "s1": ("s1-1", "s1-2"), "s2": ("s2-1", "s2-2")}


def test_repeating_and_parts_for_some(tmp_path: Path) -> None:
    tasks = (
        '  { do = "repeat", times = 3, tasks = [{ do = "walk", to = [0, 20], who = [1] }, '
        '{ do = "walk", to = [0, 0], who = [1] }] },\n'
        '  { do = "gather" },\n  { do = "walk", to = [9, 0], who = [2] },'
    )
    play = in_the_open(tmp_path, team(tasks, at="[0, 0]", soldiers=2)).first_play
    assert len(moves(play, "a1")) == 6
    assert len(moves(play, "a2")) == 1
    assert moves(play, "a2")[0][0] == pytest.approx(moves(play, "a1")[-1][1], abs=0.06)


def test_everybody_returns_to_their_own_start(tmp_path: Path) -> None:
    scenario = house(tmp_path, '  { do = "walk", to = "upstairs" },\n  { do = "run", to = "own start" },')
    for soldier, table in scenario.first_play.timetables.items():
        assert table.itinerary.legs[-1].points_m[-1] == pytest.approx(scenario.starts[soldier][0][0])


def test_who_has_to_go_back_turns_first_and_takes_time_for_it(tmp_path: Path) -> None:
    tasks = '  { do = "walk", to = [0, 30] },\n  { do = "walk", to = [0, 0] },'
    play = in_the_open(tmp_path, team(tasks, at="[0, 0]", soldiers=1)).first_play
    turns = [(end_s - start_s, leg) for start_s, end_s, leg in legs(play, "a1") if leg.gait == "turn"]
    assert len(turns) == 1
    assert turns[0][0] == pytest.approx(0.4 + np.pi / 2.2)
    assert np.sin(turns[0][1].facing_rad or 0.0) == pytest.approx(-1.0)  # north was ahead, south is now
