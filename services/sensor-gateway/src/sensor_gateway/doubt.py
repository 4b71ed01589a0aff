"""Statements of the time that contradict what is believed: believed themselves once enough of them agree. Pure."""

from dataclasses import dataclass, field


@dataclass(slots=True)
class Doubt:
    """Needs ``needed`` statements in a row, within ``tolerance_ns`` of the first and over ``span_ns`` at least."""

    needed: int
    tolerance_ns: int
    span_ns: int = 0
    _run: list[tuple[int, int]] = field(default_factory=list)

    def clear(self) -> None:
        """What is believed was confirmed."""
        self._run.clear()

    def settle(self, time_ns: int, offset_ns: int) -> int | None:
        """One more contradicting statement; the offset to believe from now on (of the least delayed), or None."""
        run = self._run
        if run and abs(offset_ns - run[0][1]) > self.tolerance_ns:
            run.clear()
        if run and time_ns <= run[-1][0]:  # the same statement over another way
            return None
        run.append((time_ns, offset_ns))
        if len(run) < self.needed or time_ns - run[0][0] < self.span_ns:
            return None
        settled_ns = max(offset for _, offset in run)
        run.clear()
        return settled_ns
