"""`bootprint benchmark all`: the performance report, compared with the figures that were committed last."""

import json
import os
import platform
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from bootprint.commands.options import Json, write_json
from bootprint.errors import ConfigError
from proving_ground.performance.figures import FILE, Table, committed


def all_parts(
    soldiers: Annotated[
        list[int] | None,
        typer.Option(min=1, max=200, help="So many soldiers; repeatable (default: 1, 8 and 40)."),
    ] = None,
    seconds: Annotated[float, typer.Option(min=5.0, help="Of walking, for each number of soldiers.")] = 60.0,
    docs: Annotated[
        Path | None,
        typer.Option(help="Folder of performance.json and performance.md, which are written anew."),
    ] = None,
    json_out: Json = None,
) -> None:
    """Measure what everything costs: services by number of soldiers, their starts, the bus, the estimators.

    Every figure is told with its ratio to the one that was committed last.

    Example: bootprint benchmark all --soldiers 8 --docs docs
    """
    from proving_ground.performance.page import write_page

    if docs is not None and not docs.is_dir():
        raise ConfigError(f"{docs}: no such folder for {FILE} and its page")
    before = committed(docs) if docs is not None else {}
    sizes = soldiers or [1, 8, 40]
    measured = _circumstances(sizes, seconds)
    measured["tables"] = {}
    for section, table in _tables(sizes, seconds):
        measured["tables"][section] = table
        typer.echo(f"{section}: {json.dumps(_rounded(table))}", err=True)
    if docs is not None:
        write_json(measured, str(docs / FILE))
        write_page(docs, measured, before)
    if json_out is not None:
        write_json(measured, json_out)


def _circumstances(sizes: list[int], seconds: float) -> dict[str, Any]:
    return {
        "processors": os.cpu_count(),
        "processor": _processor(),
        "python": platform.python_version(),
        "load": os.getloadavg()[0],
        "soldiers": sizes,
        "seconds": seconds,
    }


def _processor() -> str:
    """The processor's own name, as Linux tells it."""
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.machine()


def _tables(sizes: list[int], seconds: float) -> Iterator[tuple[str, Table]]:
    from proving_ground.performance import fusion_benchmark
    from proving_ground.performance.bus_throughput import bus_throughput
    from proving_ground.performance.estimators import estimators
    from proving_ground.performance.playing import cost_of, starts

    yield "Estimators and the hub", estimators()
    yield "The bus of one computer", bus_throughput(20_000)
    yield "One soldier with everything", fusion_benchmark.table(fusion_benchmark.measure(seconds))
    with tempfile.TemporaryDirectory() as folder:
        yield "Start", starts(Path(folder, "starts"), turns=5)
        for size in sizes:
            yield _heading(size), cost_of(size, seconds, Path(folder, str(size)))


def _heading(soldiers: int) -> str:
    return f"{soldiers} soldier{'s' if soldiers > 1 else ''}"


def _rounded(table: Table) -> dict[str, dict[str, float | None]]:
    return {
        row: {name: None if value is None else round(value, 3) for name, value in cells.items()}
        for row, cells in table.items()
    }
