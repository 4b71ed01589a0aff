"""`bootprint radio loadtest` and `bootprint radio sweep`: how formats do on a radio, once and over a grid."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from bootprint.cli import group
from bootprint.commands.options import Json, write_json
from bootprint.errors import ConfigError

_HELP = "Radios: what they cost a sender, and how formats do on them."
_STDOUT = "-"
Data = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Recorded data, for tracks `recorded` (or BOOTPRINT_DATA).")
]
Seeds = Annotated[int, typer.Option(min=1, help="How many seeds, from 1 on.")]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    commands = group(app, "radio", _HELP)
    commands.command()(loadtest)
    commands.command()(sweep)


def loadtest(
    soldiers: Annotated[int, typer.Option(help="How many soldiers the sender tells of.")] = 12,
    bitrate: Annotated[int, typer.Option(help="The squad's budget, bit/s, link headers included.")] = 34,
    loss: Annotated[float, typer.Option(help="Share of the frames that a receiver misses.")] = 0.0,
    tag: Annotated[int, typer.Option(help="Bytes of our frames' authentication tag: 8 or 4.")] = 8,
    link: Annotated[str, typer.Option(help="A name of `bootprint radio profiles`.")] = "raw",
    tracks: Annotated[
        str, typer.Option(help="patrol, building, recorded, or a name of `bootprint exercise list`.")
    ] = "patrol",
    formats: Annotated[
        list[str] | None, typer.Option("--format", help="May be repeated (default: all).", metavar="NAME")
    ] = None,
    seeds: Seeds = 1,
    duration: Annotated[float, typer.Option(help="Seconds of the tracks to play.")] = 1800.0,
    feedback: Annotated[
        bool, typer.Option(help="Receivers report, too, and so tell what they heard; else they are silent.")
    ] = True,
    posts: Annotated[
        bool,
        typer.Option("--posts", help="Receivers have no place of their own: they tell only what they heard."),
    ] = False,
    foreseen: Annotated[
        bool,
        typer.Option("--foreseen/--unforeseen", help="The sender's settings say how many frames are lost."),
    ] = True,
    data: Data = None,
    json_out: Json = None,
) -> None:
    """Tell the same squad by our hub and by formats that others use, over the same emulated radio.

    bits/s are what a format asks for by its own rule; errors are what receivers add to the senders' own, over the
    radio at its full rate. Squeezed: over a radio no faster than the budget.

    Example: bootprint radio loadtest --bitrate 40 --loss 0.2 --format bootprint --format cot-xml
    """
    from proving_ground.exercises.playing import progress_bars
    from proving_ground.radio_load.contest import contest
    from proving_ground.radio_load.formats import check_format, format_names
    from proving_ground.radio_load.load import Load
    from proving_ground.radio_load.squad_tracks import check_tracks
    from proving_ground.radio_load.tables import contest_table, print_table

    chosen = list(dict.fromkeys(check_format(name) for name in formats or format_names()))
    check_tracks(tracks, data)
    load = Load(
        soldiers=soldiers,
        bitrate=bitrate,
        loss=loss,
        tag=_tag(tag),
        link=link,
        tracks=tracks,
        feedback=feedback,
        posts=posts,
        foreseen=foreseen,
        duration_s=duration,
        data=data,
    )
    with progress_bars() as show:
        rows = contest(load, chosen, range(1, seeds + 1), show)
    if json_out is not None:
        write_json(rows, json_out)
    if json_out != _STDOUT:
        title = f"{soldiers} soldiers, {tracks}, {link} at {bitrate} bit/s, {100 * loss:g} % loss, {seeds} seed(s)"
        print_table(contest_table(rows, title))


def _tag(tag: int) -> Literal[8, 4]:
    if tag == 8:
        return 8
    if tag == 4:
        return 4
    raise ConfigError(f"--tag {tag}: want 8 or 4 (bytes)")


def sweep(
    tracks: Annotated[str, typer.Argument(help="patrol, building, recorded, or a scenario of the library.")],
    seeds: Seeds = 3,
    parameters: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE,…",
            help="soldiers, bitrate, loss, tag, link, feedback, posts, foreseen, duration_s, format. Repeatable.",
        ),
    ] = None,
    workers: Annotated[
        int, typer.Option(min=0, help="Local processes (default: one a processor).", show_default=False)
    ] = 0,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Dask scheduler, e.g. tcp://10.0.0.5:8786.")
    ] = None,
    json_out: Json = None,
) -> None:
    """Repeat the load test with many seeds and all combinations of settings; recorded data by BOOTPRINT_DATA.

    Example: bootprint radio sweep patrol --set bitrate=20,34,60 --set loss=0,0.2 --set format=bootprint
    """
    from proving_ground.exercises.sweep import combinations, parse_values, swept
    from proving_ground.radio_load.load_sweep import load_of, play_load_seed
    from proving_ground.radio_load.squad_tracks import check_tracks
    from proving_ground.radio_load.tables import print_table, sweep_table

    grid = combinations(dict(parse_values(text) for text in parameters or ()))
    check_tracks(tracks, None)
    for settings in grid:
        load_of(tracks, settings)
    rows = swept(tracks, seeds, grid, workers, dask, play_load_seed)
    if json_out is not None:
        write_json(rows, json_out)
    if json_out != _STDOUT:
        print_table(sweep_table(rows, list(grid[0])))
