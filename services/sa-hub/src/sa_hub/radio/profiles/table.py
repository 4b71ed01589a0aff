"""The named radios as a table: rows for JSON, a table for the terminal, and the one in docs/radio.md."""

from collections.abc import Iterator
from typing import Any, Final

from sa_hub.radio.profiles import RadioProfile, named, names

_REPORT_BYTES: Final = 20
"""An own report, authenticated: what the last columns are told for."""

Row = dict[str, Any]


def rows() -> list[Row]:
    """One row for each profile; units are in the names."""
    return [_row(named(name)) for name in names()]


def _row(profile: RadioProfile) -> Row:
    return {
        "profile": profile.name,
        "rate_bits_per_s": profile.rate_bits_per_s,
        "budget_bits_per_s": profile.sustained_bits_per_s,
        "header_bytes": profile.header_bytes,
        "mtu_bytes": profile.mtu_bytes,
        "latency_s": profile.latency_s,
        "key_up_s": profile.key_up_s,
        "slot_s": profile.slot_s,
        "duty_cycle_pct": 100.0 * profile.duty_cycle,
        "air_bytes_of_20": profile.air_bytes(_REPORT_BYTES),
        "airtime_ms_of_20": 1e3 * profile.airtime_s(_REPORT_BYTES),
        "summary": profile.summary,
        "source": profile.source,
    }


_HEADINGS: Final = (
    ("profile", "profile"),
    ("rate_bits_per_s", "bit/s"),
    ("header_bytes", "header B"),
    ("mtu_bytes", "MTU B"),
    ("latency_s", "latency s"),
    ("key_up_s", "key-up s"),
    ("slot_s", "slot s"),
    ("duty_cycle_pct", "duty %"),
    ("budget_bits_per_s", "budget"),
    ("air_bytes_of_20", "20 B cost"),
    ("airtime_ms_of_20", "on air ms"),
)


def _cells(row: Row) -> list[str]:
    """A row as it is shown; what a radio does not have is a dash."""
    absent = {"key_up_s": 0.0, "slot_s": 0.0, "duty_cycle_pct": 100.0}
    return ["–" if row[key] == absent.get(key) else _shown(row[key]) for key, _ in _HEADINGS]


def _shown(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if value < 1e3 else f"{value:,.0f}"
    return f"{value:,}" if isinstance(value, int) else str(value)


def print_profiles() -> None:
    """To the terminal."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, header_style="bold", pad_edge=False)
    for key, heading in _HEADINGS:
        table.add_column(heading, justify="left" if key == "profile" else "right", no_wrap=True)
    for row in rows():
        table.add_row(*_cells(row))
    Console(width=max(140, Console().width)).print(table)


def profiles_markdown() -> str:
    """As it stands in docs/radio.md, with where the figures come from."""
    headings = [heading for _, heading in _HEADINGS]
    lines = [f"| {' | '.join(headings)} |", f"| --- |{' ---: |' * (len(headings) - 1)}"]
    lines += [f"| `{cells[0]}` | {' | '.join(cells[1:])} |" for cells in map(_cells, rows())]
    lines += ["", "Where the figures come from:", ""]
    return "\n".join([*lines, *_sources()])


def _sources() -> Iterator[str]:
    """A line for each source, with the radios that have it."""
    by_source: dict[str, list[str]] = {}
    for row in rows():
        by_source.setdefault(row["source"], []).append(f"`{row['profile']}`")
    return (f"- {', '.join(radios)}: {source}." for source, radios in by_source.items())
