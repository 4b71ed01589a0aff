"""`bootprint smooth`: a recording's walks once more, each moment with all that the whole walk says of it."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bootprint.errors import ConfigError

if TYPE_CHECKING:
    from proving_ground.evaluation.smoothed import Walk

_WRITERS = ("csv", "gpx", "mcap")


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(smooth)


def smooth(
    recording: Annotated[Path, typer.Argument(help="An MCAP recording of the bus.", metavar="RECORDING")],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="FILE.csv, FILE.gpx or FILE.mcap.", metavar="FILE")
    ] = Path("smoothed.csv"),
    config: Annotated[
        Path | None, typer.Option(help="The soldier's computer.toml: start, feet and the realm's origin.")
    ] = None,
    soldier: Annotated[str | None, typer.Option(help="This soldier only.")] = None,
) -> None:
    """Write after-action tracks of a recording: boots, satellites and fixes, smoothed.

    Every position is given what came after it as well (Rauch-Tung-Striebel). CSV holds all figures, GPX a track
    for each soldier, MCAP Position messages of the source "smoothed".

    Example: bootprint smooth walk.mcap -o walk.gpx
    """
    from proving_ground.evaluation.smoothed import smoothed_walks
    from proving_ground.evaluation.track_files import write_csv, write_gpx, write_mcap

    writers = dict(zip(_WRITERS, (write_csv, write_gpx, write_mcap), strict=True))
    writer = writers.get(output.suffix.lstrip("."))
    if writer is None:
        raise ConfigError(f"--output {output}: ends in neither of .{', .'.join(_WRITERS)}")
    walks = smoothed_walks(recording, config, soldier)
    try:
        writer(walks, output)
    except OSError as error:
        raise ConfigError(f"--output {output}: cannot be written: {error.strerror}") from error
    for line in _told(walks):
        typer.echo(line)


def _told(walks: Sequence["Walk"]) -> list[str]:
    return [
        f"{walk.identity.soldier}: {len(walk.positions)} positions over {walk.duration_s:.0f} s, "
        f"median sigma {walk.median_sigma_m:.2f} m"
        for walk in walks
    ]
