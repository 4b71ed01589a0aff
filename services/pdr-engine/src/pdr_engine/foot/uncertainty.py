"""How wrong a step may be: the filter's covariance, what landing and motion say of it, and errors that steps share.

The filter's own covariance knows noise, not how people move. Two things mend it. The innovations of the stance at
the step's end show how wrong the swing was: under Student's t with ν degrees of freedom instead of Gaussian noise,
the posterior covariance is (ν + NIS)/(ν + 3) times the filter's (Roth, Özkan and Gustafsson 2013). And motions
differ: factors by class, such that of ten-second displacements 95 % lie inside their ellipse
(`proving_ground.evaluation.foot.honesty`).

Steps also err alike: the sole rolls in every stance, so all are short or long together and rise or fall together,
the gyro's bias turns all the same way, and a gyro that saturates cuts the same peak off every stride. No covariance
of single steps can tell that from noise. The 4x4 covariance holds both, as it must for one step; the `COMMON` and
`CUT` figures say which part is common: who sums steps adds that part by its size, not by its square.
"""

import math

import numpy as np

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import HEADING, NS, POSITION

# By motion class: standing, walking, running, stairs, crawling, unknown. Of the ladder and of crawling there are
# two runs each: those figures are coarse.
IN_PLANE = np.array([0.9, 0.9, 1.0, 0.9, 4.0, 4.0])  # of the variance of place and heading
UPWARD = np.array([1.0, 1.0, 1.0, 5.0, 1.0, 5.0])
COMMON_SCALE = np.array([0.0125, 0.0125, 0.018, 0.018, 0.045, 0.045])  # 1 σ, of a step's length
COMMON_SLOPE = np.array(
    [0.0075, 0.0075, 0.0075, 0.0075, 0.015, 0.015]
)  # 1 σ, of a step's length on the ground
COMMON_TURN_RAD_S = 6.5e-4  # 1 σ: 2.2 °/min
# Every stride cuts the same peak, so a part of what that takes along is alike: of the turn about the vertical (of
# single peaks' errors a fifth of the variance lasts), and, as a turn by the landing's corrections, of the tilt.
CUT_ALIKE = 0.5
CUT_LEANS = 0.05
CUT_SHRINKS = 50.0  # of that angle's fourth power, as a scale error: nothing for runs, a quarter for sprints
TAIL = 1.0  # ν
MEASURED = 3.0  # components of the velocity
LARGEST_NIS = 100.0


@compiled
def write_covariance(s: Record, p: Record, row: Record, cosine: float, sine: float) -> None:
    """The 4x4 covariance of (forward, left, up, heading): the filter's in the step's axes, and the length's own."""
    square = 0.0
    for i in range(4):
        a = HEADING if i == 3 else POSITION + i
        for j in range(4):
            b = HEADING if j == 3 else POSITION + j
            row.covariance[i, j] = s.P[a, b]
    for axis in range(3):
        square += row.displacement_m[axis] ** 2
    for axis in range(3):
        row.covariance[axis, axis] += p.step_scale**2 * square
    for j in range(4):
        x, y = row.covariance[0, j], row.covariance[1, j]
        row.covariance[0, j], row.covariance[1, j] = cosine * x + sine * y, cosine * y - sine * x
    for i in range(4):
        x, y = row.covariance[i, 0], row.covariance[i, 1]
        row.covariance[i, 0], row.covariance[i, 1] = cosine * x + sine * y, cosine * y - sine * x


@compiled
def surprise(nis: float) -> float:
    """What a landing with this normalised innovation squared multiplies the variance by."""
    return (TAIL + min(LARGEST_NIS, nis)) / (TAIL + MEASURED)


@compiled
def widen(row: Record) -> None:
    """Scale the covariance in ``row`` by landing and motion class, and add what steps have in common."""
    landing = surprise(row.nis)
    plane = math.sqrt(landing * IN_PLANE[row.motion])
    up = math.sqrt(landing * UPWARD[row.motion])
    for i in range(4):
        for j in range(4):
            row.covariance[i, j] *= (up if i == 2 else plane) * (up if j == 2 else plane)
    cut = plane * row.cut_rad
    scale = math.hypot(COMMON_SCALE[row.motion], CUT_SHRINKS * cut**4)
    for i in range(3):
        for j in range(3):
            row.covariance[i, j] += scale**2 * row.displacement_m[i] * row.displacement_m[j]
    across = math.hypot(row.displacement_m[0], row.displacement_m[1])
    row.covariance[2, 2] += (COMMON_SLOPE[row.motion] * across) ** 2
    duration_s = max(1, row.time_ns - row.start_time_ns) * NS
    cut_turn = math.hypot(CUT_ALIKE * plane * row.cut_turn_rad, CUT_LEANS * cut)
    turn = math.hypot(COMMON_TURN_RAD_S * duration_s, cut_turn)
    row.covariance[3, 3] += turn**2
    row.common_scale, row.common_slope = scale, COMMON_SLOPE[row.motion]
    row.common_turn_rad_s = turn / duration_s
    row.quality_pct = 100.0 * (1.0 - min(1.0, row.doubt)) / max(1.0, landing)
