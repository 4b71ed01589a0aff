"""Monte Carlo: a scenario with many seeds and every combination of parameters, with confidence intervals.

A job is one seed with all combinations, for a seed's soldiers are the same in all of them: what radio parameters do
not touch is played once. Jobs are independent, so processes of this machine or of a Dask cluster share them.
"""

import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent import futures as local
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.errors import BootprintError, ConfigError
from proving_ground.exercises.event_time.inprocess_play import SETTLE_S, line_job, play_lines
from proving_ground.exercises.event_time.line import Line
from proving_ground.exercises.event_time.radio_play import RadioPlay
from proving_ground.exercises.exercise import Exercise
from proving_ground.exercises.scoring.result import Played, result_of
from proving_ground.exercises.scoring.statistics import mean_of
from proving_ground.exercises.settings import with_settings
from proving_ground.exercises.source import open_exercise

Settings = Mapping[str, Any]
Figures = dict[str, float | None]
Row = dict[str, Any]
OnDone = Callable[[float], None]
Job = Callable[[str, int, Sequence[Settings]], list[Figures]]
"""Plays a seed: what is played, its seed, the settings; a function of a module, so that it travels to workers."""
_SOLDIER_FIGURES = (
    "dead_reckoning_error_p95_m",
    "position_error_p50_m",
    "position_error_p95_m",
    "height_error_p95_m",
    "inside_95_pct",
    "floor_correct_pct",
)
_PICTURE_FIGURES = (
    "picture_error_p50_m",
    "picture_error_p95_m",
    "added_error_p95_m",
    "age_p95_s",
    "missing_pct",
    "false_pct",
)


def parse_values(text: str) -> tuple[str, list[Any]]:
    """``key=value,value`` with numbers, true, false or words; ConfigError says how it should look."""
    key, equals, values = text.partition("=")
    if not (equals and key and values):
        raise ConfigError(f"--set {text!r}: want key=value,value, e.g. net.loss=0,0.1,0.3")
    return key.strip(), [_value(value.strip()) for value in values.split(",")]


def _value(text: str) -> Any:
    words = {"true": True, "false": False}
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return words.get(text, text)


def combinations(parameters: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    """Every combination of the parameters' values, the last one changing fastest."""
    return [dict(zip(parameters, values, strict=True)) for values in product(*parameters.values())]


def play_seed(scenario: str, seed: int, grid: Sequence[Settings]) -> list[Figures]:
    """One job: the figures of a seed for every combination of settings, in their order."""
    exercise = open_exercise(scenario, seed)
    lines: dict[str, dict[str, Line]] = {}
    figures = []
    for settings in grid:
        changed = with_settings(exercise, settings)
        own = repr((changed.settings.pdr, changed.settings.fusion))
        if own not in lines:
            lines[own] = _lines(changed)
        figures.append(_figures(changed, lines[own]))
    return figures


def _span_ns(exercise: Exercise) -> tuple[int, int]:
    begin_ns = exercise.begins_ns
    return begin_ns, begin_ns + round((exercise.duration_s + SETTLE_S) * NS_PER_S)


def _lines(exercise: Exercise) -> dict[str, Line]:
    jobs = [line_job(exercise, soldier, *_span_ns(exercise), record=False) for soldier in exercise.soldiers]
    return {line.soldier: line for line in play_lines(jobs, workers=1)}


def _figures(exercise: Exercise, lines: Mapping[str, Line]) -> Figures:
    begin_ns, end_ns = _span_ns(exercise)
    radio = RadioPlay(exercise, lines, begin_ns, end_ns)
    radio.run()
    nets = {name: air.counts for name, air in radio.airs.items()}
    result = result_of(Played(exercise, begin_ns, (end_ns - begin_ns) / NS_PER_S, radio.heard, nets)).figures
    found = {name: _median(result["soldiers"], name) for name in _SOLDIER_FIGURES}
    found |= {f"post_{name}": result["pictures"][0][name] for name in _PICTURE_FIGURES}
    found |= {f"everyone_{name}": _median(result["pictures"], name) for name in _PICTURE_FIGURES}
    found["net_bits_per_s"] = _median(result["nets"], "bits_per_s")
    return found


def _median(rows: Sequence[Mapping[str, Any]], name: str) -> float | None:
    values = [row[name] for row in rows if row[name] is not None]
    return float(np.median(values)) if values else None


def aggregate(grid: Sequence[Settings], by_seed: Mapping[int, Sequence[Figures]]) -> list[Row]:
    """A row for each combination and figure: n seeds, mean, and half the 95 % interval's width."""
    rows = []
    for index, settings in enumerate(grid):
        columns = [by_seed[seed][index] for seed in sorted(by_seed)]
        for figure in columns[0]:
            values = [value for column in columns if (value := column[figure]) is not None]
            if values:
                mean = mean_of(values)
                row = {"figure": figure, "n": mean.n, "mean": mean.mean, "half_width_95": mean.half_width}
                rows.append({**settings, **row})
    return rows


def swept(
    subject: str, seeds: int, grid: Sequence[Settings], workers: int, dask: str | None, job: Job
) -> list[Row]:
    """The rows of ``subject`` over seeds 1, 2, …, with a progress bar: on ``dask``, or on so many local workers."""
    from proving_ground.exercises.playing import Playing, progress_bars

    numbers = range(1, seeds + 1)
    with progress_bars() as show:

        def done(share: float) -> None:
            show("seeds", share)

        done(0.0)
        if dask is None:
            processes = Playing(Path(), workers=workers).local_workers
            by_seed = sweep_locally(subject, numbers, grid, processes, done, job)
        else:
            by_seed = sweep_on_dask(subject, numbers, grid, dask, done, job)
    return aggregate(grid, by_seed)


def sweep_locally(
    scenario: str,
    seeds: Sequence[int],
    grid: Sequence[Settings],
    workers: int,
    on_done: OnDone,
    job: Job = play_seed,
) -> dict[int, list[Figures]]:
    """All jobs on this machine's processors."""
    context = multiprocessing.get_context("forkserver")
    with local.ProcessPoolExecutor(min(workers, len(seeds)), context) as pool:
        futures = {pool.submit(job, scenario, seed, grid): seed for seed in seeds}
        found = {}
        for future in local.as_completed(futures):
            found[futures[future]] = future.result()
            on_done(len(found) / len(seeds))
    return found


def sweep_on_dask(
    scenario: str,
    seeds: Sequence[int],
    grid: Sequence[Settings],
    address: str,
    on_done: OnDone,
    job: Job = play_seed,
) -> dict[int, list[Figures]]:
    """All jobs on a Dask cluster, whose workers have this package; ConfigError if it cannot be reached."""
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise ConfigError("--dask needs Dask: pip install 'bootprint-proving-ground[dask]'") from None
    try:
        client = Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise ConfigError(f"--dask {address}: no scheduler answers there: {error}") from error
    with client:
        futures = {client.submit(job, scenario, seed, list(grid), pure=False): seed for seed in seeds}
        return dict(_collected(as_completed(list(futures), loop=client.loop), futures, on_done))


def _collected(
    completed: Iterator[Any], futures: Mapping[Any, int], on_done: OnDone
) -> Iterator[tuple[int, list[Figures]]]:
    for count, future in enumerate(completed, start=1):
        try:
            yield futures[future], future.result()
        except (BootprintError, ImportError) as error:
            raise ConfigError(f"seed {futures[future]} failed on a worker: {error}") from error
        on_done(count / len(futures))
