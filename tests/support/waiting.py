"""Waiting on conditions: tests never sleep for a guessed time."""

import time
from collections.abc import Callable

PATIENCE_S = 60.0  # a condition that comes at all comes long before, on a busy machine too


def wait_until(
    condition: Callable[[], object], timeout_s: float = PATIENCE_S, what: str = "condition"
) -> None:
    """Return as soon as ``condition()`` is true; AssertionError naming ``what`` if it never is."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, f"not within {timeout_s} s: {what}"
        time.sleep(0.01)
