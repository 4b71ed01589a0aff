"""Whatever is wrong in a scenario: one line that names the file, the line at fault and what would be right."""

import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bootprint.errors import ConfigError
from proving_ground.scenario import library, load_scenario
from proving_ground.scenario.loading import STARTER
from support.scenarios import HEAD, HOUSE, UNITS, team, written

GOOD = HEAD + UNITS + HOUSE + team('  { do = "walk", to = "room" },\n  { do = "stand", for_s = 2 },')
NET = '\n[[nets]]\neach = "squad"\n'


def line_of(text: str, needle: str) -> int:
    return text[: text.index(needle)].count("\n") + 1


def refused(folder: Path, text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        load_scenario(written(folder, text))
    message = str(caught.value)
    assert "\n" not in message
    return message


# What is replaced, by what, and words of the message; the line is that of the replacement's mark §.
WRONG = [
    ('kind = "squad"', '§kind = "squat"', "expected one of company, platoon, squad"),
    ("settle_s = 5", "§setle_s = 5", "did you mean 'settle_s'"),
    ("settle_s = 5", "§settle_s = -1", ">= 0"),
    ("settle_s = 5", "§settle_s = nan", "settle_s is nan"),
    ("latitude_deg = 59.35", "§latitude_deg = 95", "<= 90"),
    ("soldiers = 4", '§soldiers = "four"', "expected int"),
    ("for_s = 2", "§fors = 2", "did you mean 'for_s'"),
    ('{ do = "stand"', '§{ do = "stnd"', "expected one of walk, run"),
    ('to = "room"', '§to = "rom"', "did you mean 'room'"),
    ('to = "room"', "§to = 3", "expected text or a list"),
    ('to = "room"', '§to = "store"', "there is no way from"),
    ('units = ["alpha"]', '§units = ["beta"]', "there is no unit 'beta'"),
    ('at = "start"', '§at = "strat"', "did you mean 'start'"),
    ('name = "store", rectangle_m', '§name = "store", rectangle', "did you mean 'rectangle_m'"),
    ("[12, 0, 15, 6] }", "[§12, 0, 11, 6] }", "west < east"),
    ("[12, 0, 15, 6] }", "[§12, 0, 12.5, 6] }", "too narrow"),
    ("[12, 0, 15, 6] }", "[§11, 0, 15, 6] }", "overlap"),
    ('name = "store"', '§name = "room"', "is taken"),
    ('"store", rect', '§"store", floor = 7, rect', "no floor 7"),
    ('["hall", "room"]', '§["hall", "store"]', "share no wall"),
    ('["hall", "room"]', '§["hall", "romo"]', "did you mean 'room'"),
    ("at_m = [3, 0] }", "§at_m = [3, 1] }", "1.0 m off the wall"),
    ("at_m = [3, 0] }", "§at_m = [0.2, 0] }", "does not fit"),
    ("[[1, 1], [1, 5.5]]", "§[[1, 1], [1, 2]]", "make the flights"),
    ("[[1, 1], [1, 5.5]]", "§[[1, 1], [1, 7]]", "not inside"),
    ("[[1, 1], [1, 5.5]]", "§[[1, 1], [1, 3], [1, 5]]", "must be even"),
]


@pytest.mark.parametrize(("old", "new", "words"), WRONG)
def test_schema_and_site(tmp_path: Path, old: str, new: str, words: str) -> None:
    marked = GOOD.replace(old, new, 1)
    assert marked != GOOD
    message = refused(tmp_path, marked.replace("§", ""))
    assert words in message
    assert message.startswith(f"{tmp_path / 'test.toml'}:{line_of(marked, '§')}: ")


TASKS = [
    ('{ do = "stack_up", door = "frnt door" }', "did you mean 'front door'"),
    ('{ do = "clear", room = "hal" }', "did you mean 'hall'"),
    ('{ do = "clear", room = "store" }', "has no door"),
    ('{ do = "wait", until = "brech" }', "did you mean 'breach'"),
    ('{ do = "walk", to = "room", who = [5] }', "the team has 4 members, not 5"),
    ('{ do = "turn" }', "to_deg"),
    ('{ do = "lift", by = "lift", to_floor = 1 }', "there is no lift"),
    ('{ do = "stairs", by = "stair" }', "did you mean 'stairs'"),
    ('{ do = "follow", soldier = "a1", task = "breach" }', "there is no soldier"),
    ('{ do = "bound", to = "room" }', "open ground"),
    ('{ do = "repeat", times = 2, tasks = [{ do = "walk", to = "x" }] }', "there is no room or place 'x'"),
]


@pytest.mark.parametrize(("task", "words"), TASKS)
def test_tasks_that_cannot_be_done(tmp_path: Path, task: str, words: str) -> None:
    text = HEAD + UNITS + HOUSE + team(f'  {{ do = "gather", name = "breach" }},\n  {task},')
    message = refused(tmp_path, text)
    assert words in message
    assert f"test.toml:{line_of(text, task)}: " in message


def test_who_waits_for_each_other_in_a_circle(tmp_path: Path) -> None:
    first = team('  { do = "wait", until = "b" },\n  { do = "gather", name = "a" },', soldiers=1)
    second = team('  { do = "wait", until = "a" },\n  { do = "gather", name = "b" },', soldiers=1)
    text = HEAD + UNITS + HOUSE + first + second
    message = refused(tmp_path, text)
    assert "nobody goes on" in message
    assert f"test.toml:{line_of(text, 'until =')}: " in message


MORE = [
    (
        '\n[[faults]]\nkind = "radio_gone"\nat_s = 5\ntarget = "a9"\nfor_s = 3\n',
        'target = "a9"',
        "no target 'a9'",
    ),
    (
        '\n[[faults]]\nkind = "sensor_frozen"\nat_s = 5\ntarget = "a1"\nsensor = "camera"\n',
        "sensor = ",
        "no sensor",
    ),
    ('\n[[zones]]\nkind = "dark"\nroom = "cellar"\n', 'room = "cellar"', "no room 'cellar'"),
    ('\n[[zones]]\nkind = "jammed"\nfrom_s = 5\nuntil_s = 4\n', "[[zones]]", "must be after"),
    ('\n[[zones]]\nkind = "jammed"\nroom = "hall"\nbuilding = "house"\n', "[[zones]]", "not several"),
    ('\n[[nets]]\nname = "x"\nmembers = ["a1"]\n', "[[nets]]", "it needs two"),
    ('\n[[nets]]\nname = "x"\nmembers = ["a1", "zz"]\n', "members", "no unit, soldier or post 'zz'"),
    (NET + NET, "[[nets]]", "two nets 'alpha'"),
    (NET + 'profile = "vhf-120"\n', "[[nets]]", "no radio profile 'vhf-120'; did you mean 'vhf-1200'"),
    ('\n[[posts]]\nid = "a1"\nunit = "alpha"\n', 'id = "a1"', "is taken"),
]


@pytest.mark.parametrize(("more", "where", "words"), MORE)
def test_names_in_other_tables(tmp_path: Path, more: str, where: str, words: str) -> None:
    text = GOOD + more
    message = refused(tmp_path, text)
    line = text[: text.rindex(where)].count("\n") + 1
    assert words in message
    assert f"test.toml:{line}: " in message


def test_files_that_are_none(tmp_path: Path) -> None:
    assert "no such file" in _refused_path(tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    assert "cannot be read" in _refused_path(tmp_path / "bytes.toml")
    assert "did you mean 'building-clearing'" in _refused_path("building-claering")
    for text, line in (("title = 1\ntitle = 2\n", 2), ("title = 'a\n\n", 3), ("a = [1,\n\n", 3)):
        assert f"test.toml:{line}: not valid TOML" in refused(tmp_path, text)


def test_files_that_would_never_end(tmp_path: Path) -> None:
    inner = '{ do = "stand", for_s = 1 }'
    for _ in range(4):
        inner = f'{{ do = "repeat", times = 200, tasks = [{inner}] }}'
    assert "repeat less" in refused(tmp_path, HEAD + UNITS + HOUSE + team(f"  {inner},"))
    assert "s at most" in refused(tmp_path, GOOD.replace("for_s = 2", "for_s = 1e6"))
    assert "nested too deeply" in refused(tmp_path, "a = " + "[" * 600 + "]" * 600)
    assert "not a scenario" in refused(tmp_path, "#" * 5_000_000)


def _refused_path(path: Path | str) -> str:
    with pytest.raises(ConfigError) as caught:
        load_scenario(path)
    return str(caught.value)


_STARTER = STARTER.read_text(encoding="utf-8")
_TOKEN = re.compile(r'"[^"\n]*"|-?\d+(?:\.\d+)?|\w+|[\[\]{}=,]')
_TOKENS = [match.span() for match in _TOKEN.finditer(_STARTER)]
_OTHERS = [
    '""',
    "0",
    "-1",
    "1e308",
    "nan",
    "[]",
    "{}",
    "true",
    '"a"',
    '"outside"',
    "[1, 2]",
    "",
    "x",
    "]",
    "9e9",
]


@settings(max_examples=120, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.data())
def test_no_mutation_makes_anything_but_a_scenario_or_one_line(tmp_path: Path, data: st.DataObject) -> None:
    text = _STARTER
    for _ in range(data.draw(st.integers(1, 2))):
        start, end = data.draw(st.sampled_from(_TOKENS))
        text = text[:start] + data.draw(st.sampled_from(_OTHERS)) + text[end:]
    path = written(tmp_path, text)
    message = _outcome(path)
    assert message is None or ("\n" not in message and message.startswith(str(path)))


def _outcome(path: Path) -> str | None:
    """None for a scenario, the message for one that is refused; whatever else happens, happens."""
    try:
        load_scenario(path)
    except ConfigError as error:
        return str(error)
    return None


def test_the_library_is_complete() -> None:
    wanted = {
        "straight-49m",
        "straight-100m",
        "closed-loops",
        "building-clearing",
        "urban-patrol",
        "forest-march",
    }
    assert {*wanted, "stairs-and-lift", "platoon-raid", "company-exercise"} <= set(library())
