"""The Rauch-Tung-Striebel smoother over the feet's steps: what all of a walk says of each of its moments.

Rauch, Tung and Striebel, "Maximum likelihood estimates of linear dynamic systems" (1965), on the extended filter's
own run (`fusion.tape`). A change from ``x`` (covariance P) to ``x⁺ = f(x)`` (P⁺, F = ∂f/∂x) goes back by

    G = P Fᵀ (P⁺)⁻¹,    x̂ = x + G (x̂⁺ − x⁺),    P̂ = P + G (P̂⁺ − P⁺) Gᵀ,

with the pseudo-inverse, for a state can be known exactly (where the boots frame begins). Both feet, satellites and
fixes are in the state already, so all of them count, and so do the errors that a foot's steps share. What lies
before the walk was placed goes into the placed frame by the smoothed move; what a foot walked before it joined the
other one, by its own steps.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bootprint.geodesy import wrap_angle
from fusion.boots import Boots
from fusion.models import body
from fusion.models.foot_step import rotate
from fusion.state import Array, FootBlock, Layout
from fusion.tape import Change, Mark, Tape

_RANK = 1e-13  # of the largest: what is smaller is known exactly
_LONGEST_HOLE_S = 3.0  # in a foot's track: in a longer one it may have been anywhere
_NS_PER_S = 1e9


@dataclass(frozen=True, slots=True)
class Moment:
    """State (n,) and covariance (n, n) given everything."""

    state: Array
    covariance: Array


@dataclass(frozen=True, slots=True)
class FootTrack:
    """One foot's way: ``time_s`` (k,) rising, ``position_m`` (k, 3), ``covariance_m2`` (k, 3, 3)."""

    time_s: Array
    position_m: Array
    covariance_m2: Array


@dataclass(frozen=True, slots=True)
class Place:
    """A foot's position (3,) m with covariance (3, 3) m² at a time."""

    time_ns: int
    point: Array
    covariance: Array


class Smoother:
    """Keeps what one soldier's filter goes through; asked at the end."""

    def __init__(self, boots: Boots) -> None:
        self._boots = boots
        self._tape = Tape()
        boots.filter.tape = self._tape

    def causal(self) -> dict[str, FootTrack]:
        """The feet's tracks as they were known then."""
        covariance = np.full((3, 3), np.nan)
        pose = _Filtered(self._boots.filter.layout, self._tape)
        return _tracks(
            (mark.block.place, Place(mark.time_ns, point, covariance))
            for mark, point in _followed_back(self._tape.marks, pose)
        )

    def smoothed(self) -> dict[str, FootTrack]:
        """The feet's tracks given everything."""
        state_filter = self._boots.filter
        last = Moment(state_filter.state, state_filter.covariance)
        moments = smooth(self._tape.changes, last, state_filter.layout)
        pose = _Smoothed(moments, frame_moves(self._tape.changes, moments))
        return _tracks(
            (mark.block.place, Place(mark.time_ns, point, pose.covariance(mark)))
            for mark, point in _followed_back(self._tape.marks, pose)
        )


def body_track(feet: Mapping[str, FootTrack], rate_hz: float) -> FootTrack | None:
    """The body over the mean of the feet that are known around each time of the grid; None if no foot is known.

    Its covariance is the mean of theirs: what the mean's is when their errors are the same, and never too little.
    """
    tracks = list(feet.values())
    if not tracks:
        return None
    begin, end = min(track.time_s[0] for track in tracks), max(track.time_s[-1] for track in tracks)
    grid = np.arange(math.ceil(begin * rate_hz), math.floor(end * rate_hz) + 1) / rate_hz
    weights = np.array([_is_known(track.time_s, grid) for track in tracks], dtype=np.float64)
    seen = weights.sum(axis=0) > 0.0
    grid, weights = grid[seen], weights[:, seen] / weights.sum(axis=0)[seen]
    places = np.stack([_interpolated(grid, track.time_s, track.position_m) for track in tracks])
    doubts = np.stack(
        [_interpolated(grid, track.time_s, track.covariance_m2.reshape(-1, 9)) for track in tracks]
    )
    position, covariance = np.einsum("fk,fki->ki", weights, places), np.einsum("fk,fki->ki", weights, doubts)
    return FootTrack(grid, position, covariance.reshape(-1, 3, 3))


def _is_known(time_s: Array, grid: Array) -> npt.NDArray[np.bool_]:
    """At which of these times a track has a point not long before and not long after."""
    after = np.clip(np.searchsorted(time_s, grid), 1, max(1, len(time_s) - 1))
    inside = (grid >= time_s[0]) & (grid <= time_s[-1])
    return np.asarray(
        inside & (time_s[np.minimum(after, len(time_s) - 1)] - time_s[after - 1] <= _LONGEST_HOLE_S)
    )


def _interpolated(grid: Array, time_s: Array, values: Array) -> Array:
    return np.column_stack([np.interp(grid, time_s, column) for column in values.T])


def smooth(changes: list[Change], last: Moment, layout: Layout) -> list[Moment]:
    """Moments (len(changes) + 1): before the first change, and after each of them."""
    moments = [last]
    for change in reversed(changes):
        moments.append(_back(change, moments[-1], layout))
    return moments[::-1]


def _back(change: Change, later: Moment, layout: Layout) -> Moment:
    inverse = np.linalg.pinv(change.after_covariance, rcond=_RANK, hermitian=True)
    gain = change.before_covariance @ change.transition.T @ inverse
    difference = later.state - change.after
    for block in layout.blocks:
        difference[block.yaw] = wrap_angle(float(difference[block.yaw]))
    covariance = change.before_covariance + gain @ (later.covariance - change.after_covariance) @ gain.T
    return Moment(change.before + gain @ difference, 0.5 * (covariance + covariance.T))


@dataclass(frozen=True, slots=True)
class FrameMove:
    """From the frame before to the one after: a turn about up around ``pivot``, which comes to ``target``."""

    pivot: Array
    target: Array
    yaw_rad: float

    @staticmethod
    def between(before: Array, after: Array) -> "FrameMove":
        """The move that takes a pose (4,) to another."""
        return FrameMove(before[:3], after[:3], float(after[3] - before[3]))

    def point(self, at: Array) -> Array:
        """A point (3,) of the frame before in the one after."""
        return self.target + self.turned(at - self.pivot)

    def turned(self, vector: Array) -> Array:
        """A vector (3,) likewise."""
        return np.array(rotate(self.yaw_rad, (float(vector[0]), float(vector[1]), float(vector[2]))))

    @property
    def rotation(self) -> Array:
        """The turn as a matrix (3, 3)."""
        return np.column_stack([self.turned(axis) for axis in np.eye(3)])


def frame_moves(changes: list[Change], moments: list[Moment]) -> list[tuple[int, FrameMove]]:
    """After how many changes the state was moved into another frame, and how, by the first foot's poses."""
    return [
        (index, FrameMove.between(moments[index].state[:4], moments[index + 1].state[:4]))
        for index, change in enumerate(changes)
        if change.kind == "frame"
    ]


class _Filtered:
    """Poses as the filter had them."""

    def __init__(self, layout: Layout, tape: Tape) -> None:
        self._layout = layout
        self._tape = tape

    def point(self, mark: Mark) -> Array:
        return mark.point

    def pose(self, mark: Mark) -> Array:
        """The pose (4,) right after the change that the mark follows: a join has just been made."""
        return self._tape.changes[mark.changes - 1].after[mark.block.all]


class _Smoothed:
    """Poses given everything, in the last frame."""

    def __init__(self, moments: list[Moment], moves: list[tuple[int, FrameMove]]) -> None:
        self._moments = moments
        self._moves = moves

    def point(self, mark: Mark) -> Array:
        point = body.foot_position(self._moments[mark.changes].state, (mark.block, mark.offset_m))
        for move in self._moves_after(mark):
            point = move.point(point)
        return point

    def pose(self, mark: Mark) -> Array:
        """The pose (4,) in the last frame."""
        pose: Array = self._moments[mark.changes].state[mark.block.all].copy()
        for move in self._moves_after(mark):
            pose = np.append(move.point(pose[:3]), pose[3] + move.yaw_rad)
        return pose

    def covariance(self, mark: Mark) -> Array:
        moment = self._moments[mark.changes]
        jacobian = body.position_jacobian(moment.state, [(mark.block, mark.offset_m)])
        covariance: Array = jacobian @ moment.covariance @ jacobian.T
        for move in self._moves_after(mark):
            covariance = move.rotation @ covariance @ move.rotation.T
        return covariance

    def _moves_after(self, mark: Mark) -> Iterator[FrameMove]:
        return (move for index, move in self._moves if index >= mark.changes)


def _followed_back(marks: Iterable[Mark], poses: _Filtered | _Smoothed) -> Iterator[tuple[Mark, Array]]:
    """Marks with their places; those of a foot outside the filter, once it has joined, by its own frame's pose."""
    waiting: dict[FootBlock, list[Mark]] = {}
    for mark in marks:
        if not mark.inside:
            waiting.setdefault(mark.block, []).append(mark)
            continue
        if mark.own is not None:
            move = FrameMove.between(mark.own, poses.pose(mark))
            yield from ((one, move.point(one.point)) for one in waiting.pop(mark.block, []))
        yield mark, poses.point(mark)


def _tracks(found: Iterable[tuple[str, Place]]) -> dict[str, FootTrack]:
    by_place: dict[str, dict[int, Place]] = {}
    for name, place in found:
        by_place.setdefault(name, {})[place.time_ns] = place  # what was told last of a time counts
    return {name: _track([places[key] for key in sorted(places)]) for name, places in by_place.items()}


def _track(places: list[Place]) -> FootTrack:
    return FootTrack(
        np.array([place.time_ns for place in places]) / _NS_PER_S,
        np.array([place.point for place in places]),
        np.array([place.covariance for place in places]),
    )
