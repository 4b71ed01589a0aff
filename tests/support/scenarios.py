"""A small scenario that tests change: a two-storey house, four soldiers."""

from pathlib import Path

from proving_ground.scenario import Scenario, load_scenario

HEAD = """\
title = "Test"
purpose = "to be tested"
origin = { latitude_deg = 59.35, longitude_deg = 18.07, height_m = 40.0 }
settle_s = 5
"""

HOUSE = """\
[site]
floors = [{ level = 0, height_m = 0.0 }, { level = 1, height_m = 3.0 }]
places = [{ name = "start", at_m = [3, -20] }]

[[site.buildings]]
name = "house"
iron = 0
rooms = [
  { name = "hall", rectangle_m = [0, 0, 6, 6] },
  { name = "room", rectangle_m = [6, 0, 12, 6] },
  { name = "store", rectangle_m = [12, 0, 15, 6] },
  { name = "upstairs", rectangle_m = [0, 0, 6, 6], floor = 1 },
]
doors = [
  { name = "front door", between = ["outside", "hall"], at_m = [3, 0] },
  { between = ["hall", "room"] },
]
stairs = [{ name = "stairs", between = ["hall", "upstairs"], points_m = [[1, 1], [1, 5.5]] }]
"""

UNITS = 'units = [{ id = "alpha", kind = "squad" }]\n'


def team(tasks: str, extra: str = "", at: str = '"start"', soldiers: int = 4, prefix: str = "a") -> str:
    """A team's table; ``tasks`` are lines of the task list."""
    return (
        f'\n[[teams]]\nunits = ["alpha"]\nsoldiers = {soldiers}\nprefix = "{prefix}"\nat = {at}\n{extra}\n'
        f"tasks = [\n{tasks}\n]\n"
    )


def written(folder: Path, text: str) -> Path:
    """The text as a scenario file."""
    path = folder / "test.toml"
    path.write_text(text, encoding="utf-8")
    return path


def house(folder: Path, tasks: str, more: str = "", **options: object) -> Scenario:
    """A scenario in the house with one team that does these tasks."""
    return load_scenario(written(folder, HEAD + UNITS + HOUSE + team(tasks, **options) + more))  # type: ignore[arg-type]
