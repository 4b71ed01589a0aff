"""A foot's motion from its strides: recorded shapes from footfall to footfall, creep in stance, heel strikes.

The foot's frame is forward, left, up; its origin is the point of the sole, under the ball of the foot, that stands
still while the heel rises. `INSTEP_M` is where a sensor on the laces sits in it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from proving_ground.people.attitude import along_heading, attitude_of
from proving_ground.people.gaits import ShapeName
from proving_ground.people.legs import FloatArray
from proving_ground.people.shape import (
    ACROSS,
    ALONG,
    CREEP_SHARE,
    HEIGHT,
    MIRRORED,
    PITCH,
    ROLL,
    YAW,
    evaluated,
)
from proving_ground.people.smooth import Tremble, bump, cruise, glide, ring

INSTEP_M = np.array([-0.045, 0.0, 0.065])
# A landing's two rings: the foot slaps down, and its shell knocks on the ground.
_SLAP_ONSET_S, _SLAP_DECAY_S = 0.008, 0.019
_KNOCK_ONSET_S, _KNOCK_DECAY_S = 0.003, 0.014
# A standing foot: tenths of a millimetre, hundredths of a degree.
_TREMBLE_M, _TREMBLE_RAD = 1.5e-4, 3e-4
# A foot in swing is not as smooth as the mean of many: what the means lack of the recorded bands, at 1 m/s.
_SHIVER_M, _SHIVER_RAD, _SHIVER_HZ = 2.0e-4, 4.0e-3, (10.0, 25.0)
_SHIVER_EDGE = 0.12  # of a stride: how long before lifting it begins and after landing it ends


class StrideRecord(NamedTuple):
    """One stride (or other displacement) of a foot: when, from where to where, and by which curve.

    ``shape``: the recorded curve; None is a glide lifted by ``clearance_m``, or, if ``ramp_share`` is above zero,
    a ride: even speed but for ramps that take this share of it at both ends.
    """

    start_s: float
    end_s: float
    from_m: FloatArray
    to_m: FloatArray
    yaw_from: float
    yaw_to: float
    pitch_from: float
    pitch_to: float
    shape: ShapeName | None
    backward: bool = False
    strike_m_s2: float = 0.0
    clearance_m: float = 0.0
    ramp_share: float = 0.0


@dataclass(frozen=True)
class Strides:
    """All strides of a foot, in order: the records' columns (k, ...), and what was drawn for each.

    ``coefficients`` (k, 6, C) of the shape, ``gain`` (k,) of its excursions, ``creep_begin`` and ``creep_end``
    (k, 6) at the mid-stances, ``lift_share``, ``land_share`` (k,), ``slap`` and ``knock`` (k, 6): rings at landing,
    ``slap_hz`` and ``knock_hz`` (k,), ``shiver`` (k,) in swing. ``glides``, ``rides`` (k,): which are no recorded
    shapes; see `StrideRecord` for theirs.
    """

    start_s: FloatArray
    end_s: FloatArray
    from_m: FloatArray
    to_m: FloatArray
    yaw_from: FloatArray
    yaw_to: FloatArray
    pitch_from: FloatArray
    pitch_to: FloatArray
    coefficients: FloatArray
    gain: FloatArray
    creep_begin: FloatArray
    creep_end: FloatArray
    lift_share: FloatArray
    land_share: FloatArray
    slap: FloatArray
    slap_hz: FloatArray
    knock: FloatArray
    knock_hz: FloatArray
    shiver: FloatArray
    glides: npt.NDArray[np.bool_]
    rides: npt.NDArray[np.bool_]
    clearance_m: FloatArray
    ramp_share: FloatArray


@dataclass(frozen=True)
class FootMotion:
    """One foot; ``side`` +1 left, −1 right."""

    strides: Strides
    side: int
    tremble: Tremble
    shiver: Tremble

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Place of the still point (n, 3) in ENU metres and attitude (foot to ENU) at these times (n,)."""
        time_s = np.asarray(time_s, dtype=np.float64)
        s = self.strides
        index = np.maximum(np.searchsorted(s.start_s, time_s, side="right") - 1, 0)
        phase = np.clip((time_s - s.start_s[index]) / (s.end_s - s.start_s)[index], 0.0, 1.0)
        channels = self._channels(index, phase)
        position, euler = self._placed(index, channels)
        shift, turn = self._disturbance(index, time_s)
        return position + along_heading(euler[:, 0], shift), attitude_of(euler, turn)

    def _channels(self, index: npt.NDArray[np.int64], phase: FloatArray) -> FloatArray:
        s = self.strides
        channels = evaluated(s.coefficients, index, phase)
        channels[:, ACROSS:] *= s.gain[index, None]
        glides, rides = s.glides[index], s.rides[index]
        smooth = glide(phase)
        for plain in (glides, rides):
            channels[plain, ACROSS:] = 0.0
        channels[glides, ALONG] = smooth[glides]
        lifted = (4.0 * phase * (1.0 - phase)) ** 3
        channels[glides, HEIGHT] = (s.clearance_m[index] * lifted)[glides]
        if rides.any():
            channels[rides, ALONG] = cruise(phase[rides], s.ramp_share[index][rides])
        mirror = MIRRORED if self.side > 0 else np.ones(len(MIRRORED))
        return np.asarray(channels * mirror)

    def _placed(self, index: npt.NDArray[np.int64], channels: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Place (n, 3), and yaw, pitch and roll (n, 3), from the channels between two footfalls."""
        s = self.strides
        way = (s.to_m - s.from_m)[index]
        length = np.hypot(way[:, 0], way[:, 1])
        yaw = s.yaw_from[index]
        own = np.column_stack([np.cos(yaw), np.sin(yaw)])
        ahead = np.where(length[:, None] > 1e-3, way[:, :2] / np.maximum(length, 1e-3)[:, None], own)
        along = channels[:, ALONG]
        position = s.from_m[index] + along[:, None] * way
        position[:, :2] += channels[:, ACROSS, None] * np.column_stack([-ahead[:, 1], ahead[:, 0]])
        position[:, 2] += channels[:, HEIGHT]
        euler = np.column_stack(
            [
                yaw + along * (s.yaw_to[index] - yaw) + channels[:, YAW],
                s.pitch_from[index] + along * (s.pitch_to - s.pitch_from)[index] + channels[:, PITCH],
                channels[:, ROLL],
            ]
        )
        return position, euler

    def _disturbance(self, index: npt.NDArray[np.int64], time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What creep, heel strike and tremble add: shift (n, 3) in the foot's level heading, small turn (n, 3)."""
        s = self.strides
        width = CREEP_SHARE * (s.end_s - s.start_s)[index]
        both = (
            s.creep_begin[index] * bump(time_s - s.start_s[index], width)[:, None]
            + s.creep_end[index] * bump(time_s - s.end_s[index], width)[:, None]
            + self.tremble(time_s)
            + self._shaking(index, time_s)
        )
        return both[:, :3], both[:, 3:]

    def _shaking(self, index: npt.NDArray[np.int64], time_s: FloatArray) -> FloatArray:
        """What shakes the foot about its instep, (n, 6): shivers in swing, rings at landing."""
        s = self.strides
        phase = (time_s - s.start_s[index]) / (s.end_s - s.start_s)[index]
        lifting = glide((phase - s.lift_share[index]) / _SHIVER_EDGE + 1.0)
        landing = glide((s.land_share[index] - phase) / _SHIVER_EDGE + 1.0)
        shaking = (s.shiver[index] * lifting * landing)[:, None] * self.shiver(time_s)
        shaking += self._rings(index, time_s)
        shaking[:, :3] -= np.cross(shaking[:, 3:], INSTEP_M)
        return shaking

    def _rings(self, index: npt.NDArray[np.int64], time_s: FloatArray) -> FloatArray:
        """The landing: rings that start softly and have died away at mid-stance, (n, 6)."""
        s = self.strides
        duration = (s.end_s - s.start_s)[index]
        since = time_s - (s.start_s[index] + s.land_share[index] * duration)
        share = np.clip(since / np.maximum((1.0 - s.land_share[index]) * duration, 1e-3), 0.0, 1.0)
        fade = (1.0 - share**2) ** 3
        since = np.maximum(since, 0.0)
        slap = fade * ring(since, s.slap_hz[index], _SLAP_ONSET_S, _SLAP_DECAY_S)
        knock = fade * ring(since, s.knock_hz[index], _KNOCK_ONSET_S, _KNOCK_DECAY_S)
        return np.asarray(s.slap[index] * slap[:, None] + s.knock[index] * knock[:, None])

    def footfalls(self) -> "Footfalls":
        """Every stance between two strides, from standing at the start to standing at the end."""
        s = self.strides
        duration = s.end_s - s.start_s
        begin = np.concatenate([[-np.inf], s.start_s + s.land_share * duration])
        end = np.concatenate([s.start_s + s.lift_share * duration, [np.inf]])
        place = np.vstack([s.from_m[:1], s.to_m])
        yaw = np.concatenate([s.yaw_from[:1], s.yaw_to])
        return Footfalls(begin, end, place, yaw)


@dataclass(frozen=True)
class Footfalls:
    """Stances: ``begin_s``, ``end_s`` (k,) (infinite at the ends), ``place_m`` (k, 3), ``yaw_rad`` (k,)."""

    begin_s: FloatArray
    end_s: FloatArray
    place_m: FloatArray
    yaw_rad: FloatArray


def fresh_shiver(rng: np.random.Generator) -> Tremble:
    """How one foot shivers as it swings at 1 m/s."""
    return Tremble(np.repeat([_SHIVER_M, _SHIVER_RAD], 3), rng, _SHIVER_HZ, fall=2.0)


def fresh_tremble(rng: np.random.Generator) -> Tremble:
    """How one foot trembles as it stands."""
    return Tremble(np.repeat([_TREMBLE_M, _TREMBLE_RAD], 3), rng)
