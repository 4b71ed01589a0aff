"""Rest: how it is verified, and what it teaches of gyro bias, gravity and an unknown sensor's noise.

Stillness is judged by variation. A mean rate may be a bias or an even turn: a small one, or one that the bias known
so far explains, is taken for a bias at once; a larger one only if it stays as even as no foot turns.
"""

import math
from typing import Any

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import MASK, NS
from pdr_engine.foot.quaternion import assign

UNREST_BLOCK_NS = 50_000_000
ROCKING_S = 0.25
REST_RATE_RAD_S = 0.015  # a foot at rest rocks by this much
BIAS_SIGMAS = 4.0
QUICK_RATE_RAD_S = 0.02  # a faster turn must be shown to be none
EXPECTED_NS, UNEXPECTED_NS, NEVER_NS = 500_000_000, 2_000_000_000, 2**62
STEADY_RAD_S, STEADY_PART, STEADY_FORCE_M_S2 = 0.006, 0.1, 0.1
LARGEST_BIAS_RAD_S = 0.6  # 20 °/s on each axis, as the worst sensor of the presets may have
GRAVITY_MEMORY_S = 60.0
LISTEN_BLOCK_NS = 20_000_000
NOISE_MEMORY_S = 10.0


@compiled
def mean(ring: Any, first: int, last: int, axis: int) -> float:
    """Mean of one axis over the samples ``first`` .. ``last``."""
    total = 0.0
    for k in range(first, last + 1):
        total += ring[k & MASK, axis]
    return total / (last - first + 1)


@compiled
def _deviation(ring: Any, first: int, last: int) -> float:
    """Standard deviation over the window, of the axis that moves most."""
    worst = 0.0
    for axis in range(3):
        middle = mean(ring, first, last, axis)
        total = 0.0
        for k in range(first, last + 1):
            total += (ring[k & MASK, axis] - middle) ** 2
        worst = max(worst, total / (last - first + 1))
    return math.sqrt(worst)


@compiled
def mean_length(ring: Any, first: int, last: int) -> float:
    """Length of the mean vector over the samples ``first`` .. ``last``."""
    total = 0.0
    for axis in range(3):
        total += mean(ring, first, last, axis) ** 2
    return math.sqrt(total)


@compiled
def quiet(s: Record, p: Record, first: int, last: int) -> bool:
    """Whether neither sensor varies and the force is gravity alone: at rest, or turning evenly."""
    still: bool = (
        _deviation(s.gyro, first, last) < p.still_gyro_std
        and _deviation(s.accel, first, last) < p.still_accel_std
        and abs(mean_length(s.accel, first, last) - 9.81) < p.still_gravity
    )
    return still


@compiled
def verified_still(s: Record, p: Record, first: int, last: int) -> bool:
    """Whether the window shows a sensor at rest: quiet, and its mean rate no more than the bias may be."""
    return quiet(s, p, first, last) and explained(s, p, first, last)


@compiled
def _strange_rate(s: Record, first: int, last: int) -> float:
    """Size of the window's mean rate less the bias that is known, rad/s."""
    square = 0.0
    for axis in range(3):
        square += (mean(s.gyro, first, last, axis) - s.bias[axis]) ** 2
    return math.sqrt(square)


@compiled
def explained(s: Record, p: Record, first: int, last: int) -> bool:
    """Whether the window's mean rate may be the known bias and its doubt, or a good sensor's at the start."""
    limit: float = min(
        p.still_rate, QUICK_RATE_RAD_S, REST_RATE_RAD_S + BIAS_SIGMAS * math.sqrt(s.bias_variance)
    )
    return _strange_rate(s, first, last) < limit


@compiled
def steady(s: Record, first: int, last: int) -> bool:
    """Whether a quiet window is of a sensor that does not turn, however large its mean rate.

    No foot turns for so long as evenly as a sensor's own noise allows, and a turn about any axis but the
    vertical would lead gravity around.
    """
    middle = (first + last) // 2
    away = 0.0
    for axis in range(3):
        away += (mean(s.accel, first, middle, axis) - mean(s.accel, middle, last, axis)) ** 2
    limit = max(STEADY_RAD_S, STEADY_PART * _strange_rate(s, first, last))
    return unrest(s, first, last) < limit and away < STEADY_FORCE_M_S2**2


@compiled
def steady_ns(s: Record, p: Record, first: int, last: int) -> int:
    """How long a rate as strange as the window's must be steady before it counts as a bias.

    Half a second if the sensor may start with it, two if its preset does not expect it, for ever if none has it.
    """
    strange = _strange_rate(s, first, last)
    if strange > LARGEST_BIAS_RAD_S:
        return NEVER_NS
    return EXPECTED_NS if strange < p.still_rate else UNEXPECTED_NS


@compiled
def unrest(s: Record, first: int, last: int) -> float:
    """How much the angular rate wanders within the window, rad/s: its worst axis's deviation, in means of 50 ms.

    The means take the sensor's own noise away and leave the rocking of a foot that is not quite at rest.
    """
    worst = 0.0
    for axis in range(3):
        blocks, total, squares = 0, 0.0, 0.0
        begin = first
        for k in range(first, last + 1):
            if s.time_ns[k & MASK] - s.time_ns[begin & MASK] >= UNREST_BLOCK_NS:
                rate = mean(s.gyro, begin, k - 1, axis)
                blocks, total, squares = blocks + 1, total + rate, squares + rate * rate
                begin = k
        if blocks > 1:
            worst = max(worst, (squares - total * total / blocks) / (blocks - 1))
    return math.sqrt(worst)


@compiled
def blend_bias(s: Record, p: Record, rate: Any, span_s: float, wander: float) -> None:
    """Gyro bias from the mean ``rate`` over ``span_s`` at rest, weighed against what was known before the stop.

    A standing foot rocks by ``sway`` at least, and by its rate's ``wander`` for a quarter of a second: a mean
    over T is the bias to within that angle over T.
    """
    variance = (max(p.sway, wander * ROCKING_S) / span_s) ** 2
    weight = s.stop_variance / (s.stop_variance + variance)
    for axis in range(3):
        s.bias[axis] = s.stop_bias[axis] + weight * (rate[axis] - s.stop_bias[axis])
    s.bias_variance = s.stop_variance * (1.0 - weight)


@compiled
def remember_bias(s: Record) -> None:
    """A stop begins: what is known of the bias before it."""
    assign(s.stop_bias, s.bias)
    s.stop_variance = s.bias_variance


@compiled
def distrust_bias(s: Record) -> None:
    """The bias is not at all what was thought: forget it."""
    s.stop_variance = LARGEST_BIAS_RAD_S**2


@compiled
def weigh_gravity(s: Record, first: int, last: int) -> None:
    """Gravity as this accelerometer measures it: the mean over all rest so far, a minute at most."""
    span_s = (s.time_ns[last & MASK] - s.time_ns[first & MASK]) * NS
    share = span_s / (s.gravity_s + span_s)
    s.gravity += share * (mean_length(s.accel, first, last) - s.gravity)
    s.gravity_s = min(s.gravity_s + span_s, GRAVITY_MEMORY_S)


@compiled
def _white(s: Record, ring: Any, first: int, last: int) -> float:
    """Density of white noise, squared: half the mean square difference of neighbouring means, times their time.

    Means over 20 ms (an Allan variance at that time): a sensor's own filter or its steps do not count, and slow
    motion hardly does. Mean of the axes; negative where the window is too short.
    """
    total, count = 0.0, 0
    for axis in range(3):
        begin, before, known = first, 0.0, False
        for k in range(first + 1, last + 1):
            span_ns = s.time_ns[k & MASK] - s.time_ns[begin & MASK]
            if span_ns < LISTEN_BLOCK_NS:
                continue
            here = mean(ring, begin, k - 1, axis)
            if known:
                total, count = total + 0.5 * (here - before) ** 2 * span_ns * NS, count + 1
            begin, before, known = k, here, True
    return total / count if count > 0 else -1.0


@compiled
def listen(s: Record, p: Record, first: int, last: int) -> None:
    """Noise of a sensor that nobody knows, from a window at rest; within what sensors of this kind have."""
    gyro, accel = _white(s, s.gyro, first, last), _white(s, s.accel, first, last)
    if p.listens == 0 or gyro < 0.0 or accel < 0.0:
        return
    span_s = (s.time_ns[last & MASK] - s.time_ns[first & MASK]) * NS
    share = span_s / (s.listened_s + span_s)
    s.gyro_white += share * (gyro - s.gyro_white)
    s.accel_white += share * (accel - s.accel_white)
    s.listened_s = min(s.listened_s + span_s, NOISE_MEMORY_S)
    gyro = min(max(s.gyro_white, p.quietest_gyro**2), p.loudest_gyro**2)
    accel = min(max(s.accel_white, p.quietest_accel**2), p.loudest_accel**2)
    s.gyro_noise = math.sqrt(p.gyro_noise**2 - p.loudest_gyro**2 + gyro)
    s.accel_noise = math.sqrt(p.accel_noise**2 - p.loudest_accel**2 + accel)
