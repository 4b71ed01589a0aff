"""Figures as tables: rows of named figures; kept as JSON, and compared with those that were committed last."""

import json
import subprocess
from pathlib import Path
from typing import Any, Final

Cells = dict[str, float | None]
Table = dict[str, Cells]
"""By row (a service, a part), then by figure."""

FILE: Final = "performance.json"


def committed(docs: Path) -> dict[str, Any]:
    """The figures of the last commit; those of the file where there is no git; {} if there are none."""
    asked = ["git", "show", f"HEAD:./{FILE}"]
    try:
        shown = subprocess.run(asked, cwd=docs, capture_output=True, text=True, check=False)
        text = shown.stdout if shown.returncode == 0 else (docs / FILE).read_text(encoding="utf-8")
        read: dict[str, Any] = json.loads(text)
    except (OSError, ValueError):
        return {}
    return read


def ratio(now: float | None, before: float | None) -> float | None:
    """How many times as much as before; None where there is nothing to compare with."""
    return now / before if now is not None and before else None
