"""What the filter went through, kept for a smoother: each change of its state, and where feet were between.

Corrections leave no entry of their own: what they made of the state is where the next change begins.
"""

from dataclasses import dataclass, field
from typing import Literal

from bootprint.messages import Vector3
from fusion.state import Array, FootBlock

ChangeKind = Literal["carry", "frame"]


@dataclass(frozen=True, slots=True)
class Change:
    """One affine change of the state: ``after = f(before)`` with ``transition = ∂f/∂before``, covariances (n, n).

    ``frame``: the whole state was moved into another frame.
    """

    before: Array
    before_covariance: Array
    transition: Array
    after: Array
    after_covariance: Array
    kind: ChangeKind


@dataclass(frozen=True, slots=True)
class Mark:
    """A foot was somewhere: after ``changes`` changes, ``offset_m`` from its last stance; ``point`` as known then.

    ``own`` is its pose (4,) in its own frame while it is not in the filter, and at the moment when it joins.
    """

    changes: int
    time_ns: int
    block: FootBlock
    offset_m: Vector3
    point: Array
    own: Array | None = None
    inside: bool = True


@dataclass(slots=True)
class Tape:
    """Changes and marks in the order in which they happened."""

    changes: list[Change] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)

    def mark(
        self,
        time_ns: int,
        block: FootBlock,
        offset_m: Vector3,
        point: Array,
        own: Array | None = None,
        inside: bool = True,
    ) -> None:
        """The foot is there now."""
        self.marks.append(Mark(len(self.changes), time_ns, block, offset_m, point, own, inside))
