"""`bootprint exercise honesty`: of all positions that fusion publishes, how many true ones lie where it says."""

from typing import Annotated

import typer

from bootprint.commands.options import Json, write_json
from proving_ground.performance.limits import MISSED

LEAST_PCT, MOST_PCT = 92.0, 98.0


def add_to(app: typer.Typer) -> None:
    """Add the command to ``bootprint exercise``."""
    app.command()(honesty)


def honesty(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SCENARIO]...", help="Names or .toml files (default: all that come along)."),
    ] = None,
    seeds: Annotated[
        list[int] | None,
        typer.Option("--seed", min=0, help="May be repeated (default: 1, 3 and 5).", show_default=False),
    ] = None,
    soldiers: Annotated[int, typer.Option(min=1, help="Of each scenario, spread over its teams.")] = 2,
    check: Annotated[
        bool, typer.Option("--check", help="Exit 1 unless 92 to 98 % lie inside over all.")
    ] = False,
    json_out: Json = None,
) -> None:
    """Does fusion know how wrong it is? Truths inside the 95 % ellipse, over scenarios and seeds.

    Each scenario is played without radio, for a quarter of an hour at most. Errors last for minutes, so a soldier's
    share says little by itself; the mean normalised square of honest errors is 2.

    Example: bootprint exercise honesty stairs-and-lift --seed 1 --seed 2
    """
    from proving_ground.evaluation.fusion.library_honesty import SEEDS, Honesty, measure, rows
    from proving_ground.exercises.playing import progress_bars
    from proving_ground.exercises.reporting.tables import print_rows
    from proving_ground.scenario.loading import library, load_scenario

    names = scenarios or library()
    for name in names:
        load_scenario(name)  # a mistake is told before anything is played
    plays = [(name, seed) for name in names for seed in seeds or SEEDS]
    found: list[Honesty] = []
    with progress_bars() as show:
        for done, (name, seed) in enumerate(plays):
            show("seeds", done / len(plays))
            found += measure(name, [seed], soldiers)
        show("seeds", 1.0)
    told = rows(found)
    if json_out is not None:
        write_json(told, json_out)
    if json_out != "-":
        print_rows(told, "True places inside fusion's 95 % ellipse")
    if check and not LEAST_PCT <= told[-1]["inside_95_pct"] <= MOST_PCT:
        raise typer.Exit(MISSED)
