"""A service that remembers: recalls what an earlier process left, and saves its core's state as time goes by."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import structlog

from bootprint.bus import Envelope
from bootprint.figures import Figures
from bootprint.saved_state import Kept, StateFile
from bootprint.service import CorePart, CoreWithFigures

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Recalled(Generic[T]):
    """What an earlier process left, understood; ``refusal`` says why there is none although there is a file."""

    value: T | None = None
    refusal: str = ""


def recall(file: StateFile, understood: Callable[[Kept], T]) -> Recalled[T]:
    """Load and understand a file of state; ``understood`` raises ValueError for what it cannot go on from.

    What is refused is logged, and left aside: a start afresh is always possible.
    """
    try:
        kept = file.load()
        return Recalled() if kept is None else Recalled(understood(kept))
    except (OSError, ValueError) as error:
        reason = str(error)
    structlog.get_logger().warning("saved state refused, starting afresh", file=str(file.path), reason=reason)
    return Recalled(refusal=reason)


@dataclass(frozen=True, slots=True)
class Memory:
    """How a core's state is saved: every so often (ns of event time), and at the end.

    ``remembered`` gives the state, None before there is anything; by OSError or ValueError it says why it cannot.
    ``refusal`` is why that of an earlier process was not taken.
    """

    file: StateFile
    every_ns: int
    remembered: Callable[[], Kept | None]
    refusal: str = ""


class RememberingPart(CorePart):
    """A core whose state is saved every so often, and at the end; one without a memory is a `CorePart`.

    Figures tell how often it could not be saved (``memory_unsaved``), why not, and whether what an earlier process
    left could not be read.
    """

    def __init__(self, core: CoreWithFigures, memory: Memory | None) -> None:
        super().__init__(core)
        self._memory = memory
        self._saved_ns: int | None = None
        self._unsaved = 0
        self._fault = ""

    def figures(self) -> Figures:
        """The core's own, and how the memory fares: degraded while it cannot be saved."""
        figures, memory = super().figures(), self._memory
        if memory is None:
            return figures
        counts = {"memory_unsaved": self._unsaved, "memory_unreadable": int(bool(memory.refusal))}
        figures = replace(figures, counters=figures.counters | counts)
        if not self._fault:
            return figures
        note = "; ".join(filter(None, (figures.note, f"state is not saved: {self._fault}")))
        return replace(figures, state="degraded", note=note)

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        """Save when it is time."""
        said = list(super().tick(now_ns))
        if self._memory is not None and self._is_due(self._memory.every_ns, now_ns):
            self._saved_ns = now_ns
            self._save(self._memory)
        return said

    def _is_due(self, every_ns: int, now_ns: int) -> bool:
        return self._saved_ns is None or abs(now_ns - self._saved_ns) >= every_ns

    def close(self) -> Iterable[Envelope]:
        """Let the core say its last words, and save for good."""
        said = list(super().close())
        if self._memory is not None:
            self._save(self._memory, last=True)
        return said

    def _save(self, memory: Memory, *, last: bool = False) -> None:
        try:
            kept = memory.remembered()
            if kept is not None:
                memory.file.save(kept)
            if last:
                memory.file.close()
        except (OSError, ValueError) as error:  # a full disk costs the memory, not the soldier
            self._unsaved += 1
            self._fault = getattr(error, "strerror", None) or str(error)
        else:
            self._fault = ""
