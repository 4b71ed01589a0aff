"""The site's plan and everybody's ways, storey by storey: on the terminal, or as a picture in a file."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import shapely

from bootprint.errors import ConfigError
from proving_ground.people import Leg
from proving_ground.scenario.canvas import Canvas
from proving_ground.scenario.cast import Soldier
from proving_ground.scenario.scenario import Play, Scenario
from proving_ground.scenario.site import Site

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.text import Text

FloatArray = npt.NDArray[np.float64]
Bounds = tuple[float, float, float, float]
_WAY, _GROUND, _STAIRS, _WALL = 1, 2, 3, 4
_STYLES = ("cyan", "green", "yellow", "bold white")
_MARGIN = 0.03
MANY = 24  # soldiers from which on one of each team stands for all on a terminal
_ROWS = 44  # of a terminal, at most
_STILL = ("stand", "kneel", "prone", "turn", "lift")


def shown_levels(scenario: Scenario) -> list[int]:
    """Storeys with rooms or ways, from the top down."""
    levels = {space.level for space in scenario.site.rooms()} | {0}
    return sorted(levels, reverse=True)


def ways_on(scenario: Scenario, play: Play, level: int) -> list[FloatArray]:
    """Polylines (k, 3) of everybody's ways on a storey; stairs belong to the storey at their foot."""
    legs = (leg for table in play.timetables.values() for leg in table.itinerary.legs)
    return [leg.points_m for leg in legs if leg.gait not in _STILL and _level_of(scenario.site, leg) == level]


def _level_of(site: Site, leg: Leg) -> int:
    if site.mounds and not site.rooms():
        return 0
    low_m = float(leg.points_m[:, 2].min())
    return min(site.heights_m, key=lambda level: abs(site.heights_m[level] - low_m))


def bounds_of(scenario: Scenario, level: int, ways: Iterable[FloatArray]) -> Bounds:
    """What a picture of a storey has to cover."""
    shapes = [space.polygon for space in scenario.site.rooms(level)]
    lines = [shapely.LineString(way[:, :2]) for way in ways]
    west, south, east, north = shapely.union_all([*shapes, *lines]).bounds
    margin = max(1.0, _MARGIN * max(east - west, north - south))
    return west - margin, south - margin, east + margin, north + margin


def terminal_plan(scenario: Scenario, play: Play, level: int, columns: int) -> "Text":
    """A storey with walls, stairs, ways, names of rooms and places, and where soldiers start."""
    ways = ways_on(scenario, _thinned(scenario, play), level)
    canvas = Canvas(bounds_of(scenario, level, ways), columns, _ROWS, _STYLES)
    for way in ways:
        canvas.line(way, _WAY)
    site = scenario.site
    if level == 0:
        for name, obstacle in site.obstacles.items():
            canvas.line(np.array(obstacle.exterior.coords), _GROUND)
            canvas.write((obstacle.centroid.x, obstacle.centroid.y), name, "green")
    for wall in shapely.get_parts(site.walls[level]):
        canvas.line(np.array(wall.coords), _WALL)
    for stairs in site.stairs:
        if level in {site.spaces[space].level for space in stairs.spaces}:
            canvas.line(stairs.points_m, _STAIRS)
    _write_names(canvas, scenario, level)
    return canvas.render()


def _thinned(scenario: Scenario, play: Play) -> Play:
    """Of many soldiers the first of each team: more ways than that hide each other."""
    if len(play.timetables) <= MANY:
        return play
    return replace(
        play, timetables={s.id: play.timetables[s.id] for s in first_of_teams(scenario.cast.soldiers)}
    )


def first_of_teams(soldiers: Iterable[Soldier]) -> list[Soldier]:
    """The first soldier of each unit's team."""
    firsts: dict[tuple[int, int], Soldier] = {}
    for soldier in soldiers:
        firsts.setdefault((soldier.team, soldier.copy), soldier)
    return list(firsts.values())


def _write_names(canvas: Canvas, scenario: Scenario, level: int) -> None:
    for place, (at_m, floor) in scenario.site.places.items():
        if floor == level:
            canvas.write(at_m, place, "bold magenta")
    for space in scenario.site.rooms(level):
        canvas.write(space.middle_m, space.name, "white")
    for lift in scenario.site.lifts:
        if level in {scenario.site.spaces[space].level for space in lift.spaces}:
            canvas.write(lift.at_m, lift.name, "yellow")
    for soldier in scenario.cast.soldiers:
        east_m, north_m, up_m = scenario.starts[soldier.id][0][0].tolist()
        if abs(up_m - scenario.site.heights_m[level]) < 1.0:
            canvas.write((east_m, north_m), soldier.id, "bold red")


def save_plan(scenario: Scenario, play: Play, path: Path) -> None:
    """The same as a picture (PNG, SVG or PDF by the file's ending); ConfigError if it cannot be written."""
    from matplotlib.figure import Figure

    levels = shown_levels(scenario)
    figure = Figure(figsize=(7.0 * len(levels), 7.0), layout="constrained")
    for axes, level in zip(figure.subplots(1, len(levels), squeeze=False)[0], levels[::-1], strict=True):
        _draw_level(axes, scenario, play, level)
    figure.suptitle(scenario.file.title)
    try:
        figure.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        raise ConfigError(f"--plot {path}: cannot be written: {error}") from error


def _draw_level(axes: "Axes", scenario: Scenario, play: Play, level: int) -> None:
    site = scenario.site
    for way in ways_on(scenario, play, level):
        axes.plot(way[:, 0], way[:, 1], color="tab:cyan", linewidth=0.7, zorder=1)
    for wall in shapely.get_parts(site.walls[level]):
        axes.plot(*np.array(wall.coords).T, color="black", linewidth=1.6, zorder=3)
    for stairs in site.stairs:
        if level in {site.spaces[space].level for space in stairs.spaces}:
            axes.plot(*np.array(stairs.points_m).T, color="goldenrod", linewidth=4, alpha=0.5, zorder=2)
    for space in site.rooms(level):
        axes.annotate(space.name, space.middle_m, ha="center", va="center", fontsize=7, color="0.3")
    if level == 0:
        for obstacle in site.obstacles.values():
            axes.fill(*np.array(obstacle.exterior.coords).T, color="tab:green", alpha=0.25, zorder=0)
        starts = np.array([place[0] for place, _ in scenario.starts.values()])
        axes.plot(starts[:, 0], starts[:, 1], ".", color="tab:red", markersize=4, zorder=4)
    axes.set_aspect("equal")
    axes.set_title(f"floor {level}, {site.heights_m[level]:g} m")
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")
