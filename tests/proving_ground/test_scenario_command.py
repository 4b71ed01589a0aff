"""`bootprint exercise list|show|new` as a person types them, and the manual's tables and examples."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from bootprint.errors import ConfigError
from proving_ground.exercises.commands.group import register
from proving_ground.scenario import library, load_scenario
from proving_ground.scenario.canvas import Canvas
from proving_ground.scenario.keys_page import BEGIN, END, page_with
from proving_ground.scenario.timeline import clock_text, ruler
from support.scenarios import HEAD, HOUSE, UNITS, team, written

MANUAL = Path(__file__).parents[2] / "docs" / "scenarios.md"


def exercise(*arguments: object) -> str:
    app = typer.Typer()
    app.callback()(lambda: None)
    register(app)
    words = ["exercise", *(str(argument) for argument in arguments)]
    result = CliRunner().invoke(app, words, env={"COLUMNS": "120"})
    if result.exception is not None:
        raise result.exception
    return result.output


def test_list_has_a_line_for_every_scenario() -> None:
    output = exercise("list")
    for name in library():
        assert re.search(rf"^{name} +\d+:\d\d +\d+ ", output, re.MULTILINE), name


def test_honesty_has_a_row_for_the_scenario_and_one_for_all(tmp_path: Path) -> None:
    file = written(tmp_path, HEAD + UNITS + team('{ do = "walk", to = [2, 9] }', at="[2, 0]", soldiers=3))
    rows = tmp_path / "rows.json"
    output = exercise("honesty", file, "--seed", 2, "--soldiers", 2, "--json", rows)
    one, total = json.loads(rows.read_text(encoding="utf-8"))
    assert (one["scenario"], total["scenario"]) == ("test", "all")
    assert one["soldiers"] == total["soldiers"] == 2
    assert 0.0 < one["error_p95_m"] < 3.0
    assert total["least_inside_95_pct"] <= total["inside_95_pct"] <= 100.0
    assert re.search(r"all +│ +2 │", output)


def test_list_as_json() -> None:
    rows = json.loads(exercise("list", "--json", "-"))
    by_name = {row["scenario"]: row for row in rows}
    assert by_name["building-clearing"]["soldiers"] == 8
    assert by_name["building-clearing"]["floors"] == 2
    assert 190 < by_name["building-clearing"]["duration_s"] < 230


def test_show_tells_plan_soldiers_and_times(tmp_path: Path) -> None:
    output = exercise("show", "building-clearing", "--plot", tmp_path / "plan.png")
    assert "floor 1, 2.8 m" in output
    assert "living room A" in output
    assert re.search(r"^a5 +rifleman +·+r+k+w", output, re.MULTILINE)
    assert "0:08 run to [10, -3]" in output
    assert (tmp_path / "plan.png").read_bytes().startswith(b"\x89PNG")


def test_show_one_of_many() -> None:
    output = exercise("show", "platoon-raid", "--soldier", "s2-5")
    assert re.search(r"^s2-5 ", output, re.MULTILINE)
    assert not re.search(r"^s2-4 ", output, re.MULTILINE)
    with pytest.raises(ConfigError, match="--soldier x: not in platoon-raid"):
        exercise("show", "platoon-raid", "--soldier", "x")


def test_show_writes_geojson(tmp_path: Path) -> None:
    document = json.loads(exercise("show", "stairs-and-lift", "--geojson", "-"))
    kinds = {feature["properties"]["kind"] for feature in document["features"]}
    assert kinds == {"room", "door", "stairs", "lift", "place", "wall"}
    exercise("show", "stairs-and-lift", "--geojson", tmp_path / "plan.geojson")
    assert json.loads((tmp_path / "plan.geojson").read_text(encoding="utf-8")) == document


def test_new_is_a_scenario_and_never_overwrites(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    assert "written" in exercise("new", path)
    assert len(load_scenario(path).cast.soldiers) == 5
    assert exercise("show", path)
    with pytest.raises(ConfigError, match="is there already"):
        exercise("new", path)
    exercise("new", tmp_path / "copy.toml", "--like", "forest-march")
    assert load_scenario(tmp_path / "copy.toml").file.title == load_scenario("forest-march").file.title


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["show", "nothing"], "no scenario 'nothing'"),
        (["show", "none.toml"], "no such file"),
        (["show", "closed-loops", "--plot", "no/such/place.png"], "cannot be written"),
        (["show", "closed-loops", "--plot", "plan.xyz"], "cannot be written"),
        (["show", "closed-loops", "--geojson", "no/such/place"], "cannot be written"),
        (["new", "no/such/place.toml"], "cannot be written"),
    ],
)
def test_errors_are_one_line(
    arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError) as caught:
        exercise(*arguments)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_scenario_that_takes_longer_than_it_may(tmp_path: Path) -> None:
    text = "duration_s = 20\n" + HEAD + UNITS + HOUSE + team('  { do = "stand", for_s = 30 },')
    with pytest.raises(ConfigError, match=r"test\.toml:1: duration_s: 20 s is too short"):
        exercise("show", written(tmp_path, text))


def test_the_manual_has_every_key() -> None:
    text = MANUAL.read_text(encoding="utf-8")
    assert BEGIN in text
    assert END in text
    assert page_with(text) == text, "make figures writes docs/scenarios.md anew"


def test_the_manual_s_example_is_one(tmp_path: Path) -> None:
    example = re.search(r"```toml\n(.*?)```", MANUAL.read_text(encoding="utf-8"), re.DOTALL)
    assert example is not None
    assert len(load_scenario(written(tmp_path, example[1])).cast.soldiers) == 3


def test_a_canvas_draws_lines_where_they_are() -> None:
    canvas = Canvas((0.0, 0.0, 59.0, 39.0), columns=30, rows=10, styles=("red", "blue"))
    canvas.line([(0.0, 0.0), (59.0, 0.0)], 1)  # along the lower edge
    canvas.line([(0.0, 0.0), (0.0, 39.0)], 2)  # along the left edge
    lines = canvas.render().plain.split("\n")[:-1]
    assert len(lines) == 10
    assert all(len(line) == 30 for line in lines)
    assert lines[-1][1:] == "\u28c0" * 29  # the lowest two dots
    assert {line[0] for line in lines[:-1]} == {"\u2847"}  # the left four dots


def test_times_on_a_ruler() -> None:
    assert clock_text(125.9) == "2:05"
    marks = ruler(120.0, 60)
    assert [marks.index(mark) for mark in ("0:00", "0:30", "1:00", "2:00")] == [0, 15, 30, 60]


def test_help_does_not_wait_for_what_it_does_not_need() -> None:
    code = (
        "import sys, proving_ground.exercises.commands.group as c; "
        "sys.exit(bool({'shapely', 'scipy', 'matplotlib'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
