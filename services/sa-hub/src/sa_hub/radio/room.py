"""What link and budget leave for a frame of reports now."""

from dataclasses import dataclass
from typing import Final

_ENTRY_BITS: Final = 18.0
_FULL_ENTRY_BITS: Final = 32.0


@dataclass(frozen=True, slots=True)
class Room:
    """What the budget allows: bits free now, of how many at most, per second; and the longest payload that can go.

    ``frame_bits``: the next frame's header and tag on the air; ``bits_per_bit``: what a payload's bit costs there.
    """

    free_bits: float
    depth_bits: float
    rate_bits_per_s: float
    payload_bits: float
    frame_bits: float
    bits_per_bit: float = 1.0

    def full_s(self, soldiers: int) -> float:
        """For how long telling so many soldiers in full takes all of the budget."""
        return (self.frame_bits + _FULL_ENTRY_BITS * self.bits_per_bit * soldiers) / self.rate_bits_per_s

    def interval_s(self, soldiers: int) -> float:
        """Time between two reports of a soldier, when so many share the budget."""
        return (self.frame_bits + _ENTRY_BITS * self.bits_per_bit * soldiers) / self.rate_bits_per_s

    def report_bits(self, soldiers: int) -> float:
        """What a report of one of so many takes on the air, with its share of the frame."""
        return self.interval_s(soldiers) * self.rate_bits_per_s / soldiers
