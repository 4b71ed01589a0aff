"""Two results beside each other: what changed, and what of it is more than the spread between soldiers.

Figures are paired by soldier, receiver and net. A change counts when the 95 % interval of the mean difference
leaves zero out. Soldiers of one exercise share its radio and its site, so they are not quite independent: what
stands on the edge wants more seeds (`bootprint exercise sweep`).
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from bootprint.errors import ConfigError
from proving_ground.exercises.scoring.statistics import Mean, mean_of

Better = Literal["less", "more"]
Row = dict[str, Any]
_LEAST_SHARE = 0.01
PAIRED: dict[str, tuple[str, dict[str, Better]]] = {
    "soldiers": (
        "soldier",
        {
            "dead_reckoning_error_p95_m": "less",
            "dead_reckoning_final_m": "less",
            "position_error_p50_m": "less",
            "position_error_p95_m": "less",
            "final_error_m": "less",
            "height_error_p95_m": "less",
            "inside_95_pct": "more",
            "floor_correct_pct": "more",
        },
    ),
    "pictures": (
        "receiver",
        {
            "picture_error_p50_m": "less",
            "picture_error_p95_m": "less",
            "added_error_p95_m": "less",
            "age_p95_s": "less",
            "inside_95_pct": "more",
            "floor_correct_pct": "more",
            "missing_pct": "less",
            "false_pct": "less",
        },
    ),
    "nets": ("net", {"bits_per_s": "less"}),
    "usage": ("process", {"cpu_pct": "less", "memory_mb": "less"}),
}


def read_result(path: Path) -> dict[str, Any]:
    """A ``result.json``, or that of a report's folder; ConfigError if it is none."""
    file = path / "result.json" if path.is_dir() else path
    try:
        figures = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigError(f"{file}: no such file; want a result.json or a report's folder") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{file}: cannot be read: {error}") from error
    except json.JSONDecodeError as error:
        raise ConfigError(f"{file}:{error.lineno}: not valid JSON: {error.msg}") from error
    if not isinstance(figures, dict) or not isinstance(figures.get("soldiers"), list):
        raise ConfigError(f"{file}: is no result of an exercise: it has no list of soldiers")
    return figures


def compare_results(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[Row]:
    """A row a figure: means of both, the mean difference with its interval, and better, worse, same or unsure."""
    rows = []
    for table, (key, columns) in PAIRED.items():
        for column, better in columns.items():
            pairs = _pairs(first.get(table, []), second.get(table, []), key, column)
            if pairs:
                rows.append(_row(f"{table}.{column}", pairs, better))
    return rows


def _pairs(first: list[Row], second: list[Row], key: str, column: str) -> list[tuple[float, float]]:
    """The figures of those who stand in both and have one in both."""
    others = {row.get(key): row.get(column) for row in second}
    found = [(row.get(column), others.get(row.get(key))) for row in first]
    return [(float(a), float(b)) for a, b in found if a is not None and b is not None]


def _row(figure: str, pairs: list[tuple[float, float]], better: Better) -> Row:
    change = mean_of([b - a for a, b in pairs])
    scale = sum(abs(a) for a, _ in pairs) / change.n
    return {
        "figure": figure,
        "n": change.n,
        "first": sum(a for a, _ in pairs) / change.n,
        "second": sum(b for _, b in pairs) / change.n,
        "difference": change.mean,
        "half_width_95": change.half_width,
        "verdict": _verdict(change, scale, better),
    }


def _verdict(change: Mean, scale: float, better: Better) -> str:
    """``scale`` is the size of the figure itself: a hundredth more or less is nobody's concern."""
    if change.mean == 0.0 or abs(change.mean) < _LEAST_SHARE * scale:
        return "same"
    if change.half_width is None:
        return "unsure"
    if not change.is_beyond_noise:
        return "same"
    return "better" if (change.mean < 0.0) == (better == "less") else "worse"
