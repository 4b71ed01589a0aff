"""Whether frames on the air kept to a budget: told from the frames alone, knowing nothing of the sender's bucket.

In every window of T seconds at most rate · T + depth bits. Of a bucket that is empty at start more is asked: in the
window that begins with the test at most rate · T.
"""

from collections.abc import Iterable
from fractions import Fraction
from typing import Final

_NS_PER_S: Final = 1_000_000_000
_DEPTH_BITS: Final = 4000
_SHORTEST_S, _LONGEST_S = 2, 40


def allowed_depth_bits(rate_bits_per_s: int) -> int:
    """The depth that the budget's contract grants: rate × clamp(4000 / rate, 2 s, 40 s)."""
    seconds = min(max(Fraction(_DEPTH_BITS, rate_bits_per_s), Fraction(_SHORTEST_S)), Fraction(_LONGEST_S))
    return int(rate_bits_per_s * seconds)


def exceeds_budget(
    frames: Iterable[tuple[int, int]], rate_bits_per_s: int, start_ns: int, *, empty_at_start: bool = False
) -> bool:
    """Whether frames (time ns, bytes on the air), in order of time, break the budget in any window."""
    rate, depth = rate_bits_per_s, allowed_depth_bits(rate_bits_per_s) * _NS_PER_S
    sent = 0  # in 1e-9 bit, as all that follows: whole numbers, no rounding
    least = 0  # the smallest surplus before a frame so far: where the worst window may begin
    for time_ns, size in frames:
        earned = rate * (time_ns - start_ns)
        least = min(least, sent - earned)
        sent += 8 * size * _NS_PER_S
        if sent - earned - least > depth or (empty_at_start and sent > earned):
            return True
    return False
