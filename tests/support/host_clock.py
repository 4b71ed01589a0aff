"""A computer's clocks in a test's hands: they go on when somebody sleeps."""

from pathlib import Path

from sa_hub.radio.counters import FileCounters

JAN_2026_S = 1_767_225_600.0


class HostClock:
    """Wall clock when called, `monotonic` beside it; ``slept_s``: how long somebody slept, each time."""

    def __init__(self, now_s: float = JAN_2026_S) -> None:
        self.now_s = now_s
        self.slept_s: list[float] = []

    def __call__(self) -> float:
        return self.now_s

    def monotonic(self) -> float:
        """Seconds since a moment of no meaning."""
        return self.now_s - JAN_2026_S

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self.slept_s.append(seconds)
        self.now_s += seconds

    def counters(self, path: Path, block: int = 4, earlier_life: Path | None = None) -> FileCounters:
        """A source of counters in a file, on this clock."""
        return FileCounters(path, self, block, earlier_life=earlier_life, sleep=self.sleep)
