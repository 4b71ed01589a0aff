"""Makes docs/performance.md: what was measured, each figure with its ratio to the one that was committed last."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from proving_ground.performance.figures import Table, ratio

_TITLES: Final = {
    "processes": "processes",
    "cpu_mean_pct": "processor, % of a core",
    "memory_mean_mb": "memory, MB",
    "latency_p50_ms": "late by, ms, median",
    "latency_p99_ms": "ms, p99",
    "start_s": "first word after, s",
    "start_cpu_s": "processor, s",
    "resident_mb": "resident, MB",
    "messages_per_s": "messages a second",
    "us_each": "processor each, µs",
    "us_per_sample": "µs a sample",
    "ms_per_s": "processor, ms a second",
}
_HEAD: Final = """# Performance: what it costs

Made by `make bench`:
`{command}`.
Behind each figure stands, in brackets, how many times the one that was committed last it is; the figures themselves
are in [performance.json](performance.json).

"""
_BUSY: Final = "\nOthers were at work on it: times are longer than they would be on a machine of one's own."
_MEANINGS: Final = """
Soldiers walk round yards for {seconds:g} s, every service a process of its own, a router for each computer, all on
this one machine: squads of eight with a leader's computer, and a command post. Each row is the mean of a service's
processes. Memory is the proportional share (PSS): what processes share counts once. Latency is from the stamp of
the newest sample that a message tells of until the message is on the computer's bus, at the first four soldiers';
it adds up from row to row. `umpire` is the exercise itself: all routers, radio nets and observers; services are
forked from the `fork-server`, as by `bootprint up`, and share what it has imported. Start is of a process that is
killed and started again while its soldier walks, until its first word. The foot filter is one boot's, in batches of
ten samples, the body module's unit runs at 100 Hz, and the hub is a command post's. The soldier with everything
wears both boots, a body unit, a receiver and a camera; what a position waits for by design (batches, look-ahead,
order) is told by the same sensors played in event time.
"""


def write_page(docs: Path, measured: Mapping[str, Any], before: Mapping[str, Any]) -> None:
    """Write the page of these figures beside those."""
    lines = [
        _HEAD.format(command=_command(measured)) + _circumstances(measured, before),
        _MEANINGS.format(seconds=measured["seconds"]),
    ]
    for section, table in measured["tables"].items():
        lines += [f"\n## {section}\n", *_table(table, before.get("tables", {}).get(section, {}))]
    (docs / "performance.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _command(measured: Mapping[str, Any]) -> str:
    """What was run, with all its arguments."""
    sizes = " ".join(f"--soldiers {size}" for size in measured["soldiers"])
    return f"bootprint benchmark all {sizes} --seconds {measured['seconds']:g} --docs docs"


def _circumstances(measured: Mapping[str, Any], before: Mapping[str, Any]) -> str:
    text = _machine("Measured", measured)
    if not before:
        return text + "\nNothing had been committed before."
    return f"{text}\n{_machine('The committed figures', before)}"


def _machine(what: str, measured: Mapping[str, Any]) -> str:
    busy = measured["load"] > 0.5 * measured["processors"]
    return (
        f"{what}: {measured['processors']} processors ({measured['processor']}), Python {measured['python']}, "
        f"load {measured['load']:.1f} before it began.{_BUSY if busy else ''}"
    )


def _table(table: Table, before: Mapping[str, Mapping[str, float | None]]) -> Iterator[str]:
    names = [name for name in _TITLES if any(name in cells for cells in table.values())]
    yield f"| | {' | '.join(_TITLES[name] for name in names)} |"
    yield f"|---|{'--:|' * len(names)}"
    for row, cells in table.items():
        shown = (_cell(cells.get(name), before.get(row, {}).get(name)) for name in names)
        yield f"| {row} | {' | '.join(shown)} |"


def _cell(now: float | None, before: float | None) -> str:
    if now is None:
        return "–"
    times = ratio(now, before)
    return _number(now) if times is None else f"{_number(now)} ({times:.2f})"


def _number(value: float) -> str:
    if value >= 100.0 or value == int(value):
        return f"{value:,.0f}"
    return f"{value:.2f}" if value < 10.0 else f"{value:.1f}"
