"""From planned strides to a foot's motion: chooses each stride's curve and draws how it differs from the mean."""

import itertools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from proving_ground.people.foot import FootMotion, StrideRecord, Strides, fresh_shiver, fresh_tremble
from proving_ground.people.legs import FloatArray
from proving_ground.people.person import Person
from proving_ground.people.shape import COEFFICIENTS, MIRRORED, StrideShape, backwards, whole
from proving_ground.people.stride_shapes import SHAPES

_MODES = 3
_SCORE_AT_MOST = 2.0  # sigmas: beyond this the components would bend a stride out of shape
_GAIN_AT_LEAST, _GAIN_AT_MOST = 0.35, 1.15
_SHIVER_AT_LEAST = 0.6
# The few recorded side steps are so unlike each other that their mean lifts the foot and turns it less than any.
_SIDE_STEP_GAIN = 1.5
_CLIMB_M = 0.1  # shapes that rise by more are stairs
_CONTIGUOUS_S = 0.05
_CREEP_MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
_CREEP_BACKWARD = np.array([-1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
# A ring's push (m/s²: forward, left, up) and shaking (rad/s²: about these axes) per m/s² of strike, mean and sigma.
_SLAP = (np.array([-0.6, 0.0, 1.2, 0.0, -42.0, 0.0]), np.array([0.7, 0.6, 0.7, 14.0, 17.0, 14.0]))
_KNOCK = (np.array([-0.5, 0.0, 1.0, 0.0, 0.0, 0.0]), np.array([0.3, 0.3, 0.3, 4.0, 6.0, 4.0]))
_SLAP_HZ = (20.0, 2.5)
_STRIKE_SPREAD = 0.3  # of the logarithm, from landing to landing
# When a foot that glides leaves the ground and is back, as shares of the glide.
_GLIDE_LIFT, _GLIDE_LAND = 0.12, 0.85


def foot_motion(
    records: Sequence[StrideRecord], person: Person, side: int, rng: np.random.Generator
) -> FootMotion:
    """The motion of a foot (``side`` +1 left, −1 right) with these strides, in order; at least one."""
    start, end, place, target, yaw, yaw_to, pitch, pitch_to = (_column(records, index) for index in range(8))
    shapes = [_shape_of(record) for record in records]
    way = target - place
    speed = np.hypot(way[:, 0], way[:, 1]) / (end - start)
    scores = np.clip(rng.normal(size=(len(records), _MODES)), -_SCORE_AT_MOST, _SCORE_AT_MOST)
    creep_begin, creep_end = _creep(records, shapes, person, side, rng)
    grounded = np.array([_grounded(*pair) for pair in zip(records, shapes, strict=True)])
    strike = np.array([record.strike_m_s2 for record in records])
    rides = np.array([record.ramp_share > 0.0 for record in records])
    strides = Strides(
        start,
        end,
        place,
        target,
        yaw,
        yaw_to,
        pitch,
        pitch_to,
        coefficients=np.array([_curve(*each) for each in zip(records, shapes, speed, scores, strict=True)]),
        gain=np.array([_gain(*each) for each in zip(records, shapes, speed, way[:, 2], strict=True)]),
        creep_begin=creep_begin,
        creep_end=creep_end,
        lift_share=grounded[:, 0],
        land_share=grounded[:, 1],
        slap=_rings(strike, _SLAP, rng),
        slap_hz=rng.normal(*_SLAP_HZ, len(records)),
        knock=_rings(person.hardness * strike, _KNOCK, rng),
        knock_hz=person.knock_hz * rng.uniform(0.85, 1.15, len(records)),
        shiver=np.where(rides, 0.0, np.maximum(speed, _SHIVER_AT_LEAST)),
        glides=np.array([record.shape is None and record.ramp_share == 0.0 for record in records]),
        rides=rides,
        clearance_m=np.array([record.clearance_m for record in records]),
        ramp_share=np.array([record.ramp_share for record in records]),
    )
    return FootMotion(strides, side, fresh_tremble(rng), fresh_shiver(rng))


def _column(records: Sequence[StrideRecord], index: int) -> FloatArray:
    return np.array([record[index] for record in records], dtype=np.float64)


def _shape_of(record: StrideRecord) -> StrideShape:
    """The stride's shape; a walk's stands in where there is none."""
    return SHAPES[record.shape or "walk"]


def _curve(record: StrideRecord, shape: StrideShape, speed_m_s: float, scores: FloatArray) -> FloatArray:
    if record.shape is None:
        return np.zeros((len(MIRRORED), COEFFICIENTS))
    curve = whole(shape.coefficients(np.array([speed_m_s]), scores[None]))
    return np.asarray((backwards(curve) if record.backward else curve)[0])


def _gain(record: StrideRecord, shape: StrideShape, speed_m_s: float, rise_m: float) -> float:
    """Of a stride's excursions, beyond the speeds or the riser that were recorded."""
    if abs(shape.rise_m) > _CLIMB_M:
        return float(np.clip(rise_m / shape.rise_m, _GAIN_AT_LEAST, _GAIN_AT_MOST))
    if record.shape == "side_step":
        return _SIDE_STEP_GAIN
    slow = min(1.0, np.sqrt(speed_m_s / shape.slowest_m_s))
    fast = min(_GAIN_AT_MOST, max(1.0, (speed_m_s / shape.fastest_m_s) ** 0.3))
    return float(max(_GAIN_AT_LEAST, slow * fast))


def _creep(
    records: Sequence[StrideRecord],
    shapes: Sequence[StrideShape],
    person: Person,
    side: int,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Velocity and rate of the still point at each stride's begin and end, (k, 6) each; none where the foot stops.

    On stairs, where no motion capture was, a foot creeps as in walking.
    """
    usual, sigma = (np.array([_known_creep(shape)[row] for shape in shapes]) for row in (0, 1))
    scatter = np.clip(rng.normal(size=usual.shape), -_SCORE_AT_MOST, _SCORE_AT_MOST)
    usual[:, :3] *= [person.creep, person.creep, person.sink]
    drawn = usual + sigma * scatter
    drawn[:, 5] += person.stance_turn_rad_s
    drawn[[record.backward for record in records]] *= _CREEP_BACKWARD
    drawn *= _CREEP_MIRROR if side > 0 else 1.0
    end = np.where(_goes_on(records)[:, None], drawn, 0.0)
    return np.vstack([np.zeros(6), end[:-1]]), end


def _known_creep(shape: StrideShape) -> FloatArray:
    """Mean and sigma (2, 6), velocities from walking where the shape has none."""
    known = np.array([shape.creep, shape.creep_sigma])
    walk = np.array([SHAPES["walk"].creep, SHAPES["walk"].creep_sigma])
    known[:, :3] = np.where(shape.creep_sigma[:3] > 0.0, known[:, :3], walk[:, :3])
    return known


def _goes_on(records: Sequence[StrideRecord]) -> npt.NDArray[np.bool_]:
    """Whether the next stride follows at once, so that the foot is not at rest between them."""
    going = [
        before.shape is not None and after.shape is not None and after.start_s - before.end_s < _CONTIGUOUS_S
        for before, after in itertools.pairwise(records)
    ]
    return np.array([*going, False])


def _grounded(record: StrideRecord, shape: StrideShape) -> tuple[float, float]:
    """Shares of the stride at which the foot leaves the ground and meets it again."""
    if record.shape is None:
        return _GLIDE_LIFT, _GLIDE_LAND
    if record.backward:
        return 1.0 - shape.land_share, 1.0 - shape.lift_share
    return shape.lift_share, shape.land_share


def _rings(
    strike_m_s2: FloatArray, shape: tuple[FloatArray, FloatArray], rng: np.random.Generator
) -> FloatArray:
    """Peaks of the rings at landing, (k, 6)."""
    count = len(strike_m_s2)
    peak = strike_m_s2 * np.exp(rng.normal(0.0, _STRIKE_SPREAD, count))
    return np.asarray(peak[:, None] * rng.normal(*shape, (count, 6)))
