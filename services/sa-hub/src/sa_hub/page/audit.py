"""The audit log of the page: a line of JSON for every change, who asked for it and what came of it."""

import threading
from pathlib import Path
from typing import Any

import msgspec
import structlog


class Audit:
    """Appends to a file; each line is complete when `note` returns. A full disk is told of, and stops nobody."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.faults = 0
        self._lock = threading.Lock()
        self._log = structlog.get_logger().bind(part="page")
        path.parent.mkdir(parents=True, exist_ok=True)

    def note(self, time_s: float, who: str, client: str, change: str, outcome: int, asked: Any) -> None:
        """One change: by whom, from where, what, the HTTP status of the answer, and what was asked for."""
        row = {"time_s": time_s, "who": who, "client": client, "change": change, "outcome": outcome}
        self._log.info("change", **row)
        line = msgspec.json.encode({**row, "asked": asked}) + b"\n"
        try:
            with self._lock, self.path.open("ab") as file:
                file.write(line)
        except OSError:
            self.faults += 1

    def newest(self, count: int) -> list[dict[str, Any]]:
        """The last lines, the newest first; what cannot be read (a line cut by a power cut) is left out."""
        try:
            lines = self.path.read_bytes().splitlines()[-count:]
        except OSError:
            return []
        return [row for line in reversed(lines) if (row := _row(line)) is not None]


def _row(line: bytes) -> dict[str, Any] | None:
    try:
        return msgspec.json.decode(line, type=dict[str, Any])
    except msgspec.DecodeError:
        return None
