"""`bootprint exercise list|show|new`: what there is to play, what it looks like, and a start for one's own."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bootprint.commands.options import write_json
from bootprint.errors import ConfigError

if TYPE_CHECKING:
    from rich.console import Console

    from proving_ground.scenario.scenario import Play, Scenario

_MARGIN_COLUMNS = 22
_NO_LIMIT = 10_000


def add_to(app: typer.Typer) -> None:
    """Add the commands about scenarios to ``bootprint exercise``."""
    app.command("list")(list_)
    app.command()(show)
    app.command()(new)


def list_(
    json_out: Annotated[
        str | None,
        typer.Option("--json", metavar="FILE", help="Write the rows as JSON; - for standard output."),
    ] = None,
) -> None:
    """The scenarios that come with bootprint: name, duration, soldiers, and what each is for."""
    from proving_ground.scenario import library, load_scenario
    from proving_ground.scenario.timeline import longest_m

    rows: list[dict[str, Any]] = []
    for name in library():
        scenario = load_scenario(name)
        play = scenario.first_play
        rows.append(
            {
                "scenario": name,
                "duration_s": round(play.duration_s, 1),
                "soldiers": len(scenario.cast.soldiers),
                "distance_m": round(longest_m(play), 1),
                "floors": len({space.level for space in scenario.site.rooms()}),
                "purpose": scenario.file.purpose,
                "source": scenario.file.source,
            }
        )
    if json_out is not None:
        write_json(rows, json_out)
    if json_out != "-":
        _print_list(rows)


def _print_list(rows: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table

    from proving_ground.scenario.timeline import clock_text

    console = Console()
    if not console.is_terminal:
        console.width = _NO_LIMIT
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("scenario", no_wrap=True, style="cyan")
    for heading in ("time", "soldiers", "up to m"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("purpose")
    for row in rows:
        figures = (clock_text(row["duration_s"]), str(row["soldiers"]), f"{row['distance_m']:.0f}")
        table.add_row(row["scenario"], *figures, row["purpose"])
    console.print(table)


def show(
    scenario: Annotated[str, typer.Argument(metavar="SCENARIO", help="A name of the list, or a .toml file.")],
    seed: Annotated[int, typer.Option(min=0, help="Draws the persons, and so how long things take.")] = 1,
    soldier: Annotated[
        str | None, typer.Option(metavar="ID", help="Everything that this soldier does.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the plan as a picture: .png, .svg or .pdf.")
    ] = None,
    geojson: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the plan as GeoJSON; - for standard output.")
    ] = None,
) -> None:
    """Check a scenario and show it: plan, soldiers, who does what when.

    Example: bootprint exercise show building-clearing --plot plan.png
    """
    from rich.console import Console

    from proving_ground.scenario.loading import load_scenario, play

    loaded = load_scenario(scenario)
    played = play(loaded, seed)
    if soldier is not None and soldier not in played.timetables:
        raise ConfigError(f"--soldier {soldier}: not in {loaded.name}; known: {', '.join(played.timetables)}")
    if plot is not None:
        from proving_ground.scenario.plan_view import save_plan

        save_plan(loaded, played, plot)
    if geojson is not None:
        _write_geojson(loaded, geojson)
    if geojson != "-":
        console = Console()
        _print_head(console, loaded, played)
        _print_plan(console, loaded, played)
        _print_timeline(console, loaded, played, soldier)


def _write_geojson(scenario: "Scenario", target: str) -> None:
    from proving_ground.scenario.geojson import write_plan

    document = write_plan(scenario.site, scenario.file.site, scenario.file.origin)
    text = json.dumps(document, ensure_ascii=False, indent=1) + "\n"
    if target == "-":
        sys.stdout.write(text)
        return
    try:
        Path(target).write_text(text, encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"--geojson {target}: cannot be written: {error}") from error


def _print_head(console: "Console", scenario: "Scenario", play: "Play") -> None:
    from proving_ground.scenario.timeline import clock_text, longest_m

    file, cast = scenario.file, scenario.cast
    console.print(f"[bold]{file.title}[/bold]: {file.purpose}", highlight=False)
    if file.source:
        console.print(file.source, style="dim", highlight=False)
    counts = (
        f"{clock_text(play.duration_s)} min, {len(cast.soldiers)} soldiers who go up to {longest_m(play):.0f} m, "
        f"{len(cast.units)} units, {len(cast.posts)} posts, {len(cast.nets)} radio nets, "
        f"{len(file.zones)} zones, {len(file.faults)} faults"
    )
    console.print(counts, highlight=False)


def _print_plan(console: "Console", scenario: "Scenario", play: "Play") -> None:
    from proving_ground.scenario.plan_view import shown_levels, terminal_plan

    for level in shown_levels(scenario):
        console.print(f"\n[bold]floor {level}[/bold], {scenario.site.heights_m[level]:g} m", highlight=False)
        console.print(terminal_plan(scenario, play, level, min(console.width, 110)), soft_wrap=True)


def _print_timeline(console: "Console", scenario: "Scenario", play: "Play", soldier: str | None) -> None:
    from rich.table import Table

    from proving_ground.scenario.plan_view import MANY, first_of_teams
    from proving_ground.scenario.timeline import LEGEND, doings, ruler, strip

    soldiers = [s for s in scenario.cast.soldiers if soldier in (None, s.id)]
    if len(soldiers) > MANY:
        soldiers = first_of_teams(soldiers)
        console.print("the first soldier of each team; others by --soldier ID", style="dim")
    columns = max(20, min(console.width, 160) - _MARGIN_COLUMNS)
    console.print(" " * _MARGIN_COLUMNS + ruler(play.duration_s, columns), highlight=False, soft_wrap=True)
    for one in soldiers:
        table = play.timetables[one.id]
        line = strip(play.persons[one.id], table.itinerary, play.duration_s, columns)
        label = f"{one.id:<10.10}{one.role:<12.12}"
        console.print(f"[cyan]{label}[/cyan]{line}", highlight=False, soft_wrap=True)
    console.print(LEGEND, style="dim", highlight=False)
    rows = Table(box=None, header_style="bold", pad_edge=False)
    rows.add_column("soldier", style="cyan", no_wrap=True)
    rows.add_column("what when")
    for first in first_of_teams(soldiers):
        words = "; ".join(f"{time} {text}" for time, text in doings(play.timetables[first.id]))
        rows.add_row(first.id, words)
    console.print(rows)


def new(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="The file to write, e.g. my-exercise.toml.")],
    like: Annotated[
        str | None,
        typer.Option(metavar="SCENARIO", help="A copy of this one, rather than the commented start."),
    ] = None,
) -> None:
    """Write a scenario to start from, with a comment on every part."""
    from proving_ground.scenario.loading import STARTER, load_scenario

    source = load_scenario(like).path if like is not None else STARTER
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(source.read_text(encoding="utf-8"))
    except FileExistsError:
        raise ConfigError(f"{path}: is there already; give another name") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be written: {error.strerror}") from error
    sys.stdout.write(f"{path}: written; see it with: bootprint exercise show {path}\n")
