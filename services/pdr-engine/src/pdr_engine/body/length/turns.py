"""Quick turns: who turns fast hardly moves on (METHODS B6).

Above a rate of turn the stride shrinks, by up to 80 % for who turns about on the spot.
"""

import math

QUICK_RAD_S, ABOUT_RAD_S = (
    math.radians(70.0),
    math.radians(120.0),
)  # corners are walked below, about-turns above
MOST_SHRINK = 0.8


def stride_share(turn_rad: float, duration_s: float) -> float:
    """What is left of a stride (1 to 0.2) in which the body turns by so much, either way."""
    if duration_s <= 0.0:
        return 1.0
    rate = abs(turn_rad) / duration_s
    quickness = (rate - QUICK_RAD_S) / (ABOUT_RAD_S - QUICK_RAD_S)
    return 1.0 - MOST_SHRINK * min(max(quickness, 0.0), 1.0)
