"""Cuts steps out of the level stream: what `gait`, `compass` and the classes look at."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bootprint.messages import Float64Array
from pdr_engine.body.azimuth.denoise import SPAN, approximation
from pdr_engine.body.pieces import Stride
from pdr_engine.body.settings import Denoising
from pdr_engine.body.steps.gait import Gait, gait_of
from pdr_engine.body.steps.grid import CELL_NS, CELL_S, Cell
from pdr_engine.body.steps.likeness import likeness

# Of a cell: force (3), rate (3) and field (3) in the nav frame, yaw of the reference axis.
WIDTH = 10
_ACCEL, _RATE, _FIELD, _YAW = slice(0, 3), slice(3, 6), slice(6, 9), 9
_KEPT = 600  # cells, 12 s: the steps that begin a bout may wait
_LEAST_CELLS = 5


@dataclass(frozen=True, slots=True)
class Cut:
    """One step's cells: ``nav`` (n, `WIDTH`) from ``start_ns``, and what is known of it.

    ``yaw_rad``: mean of the reference axis, counter-clockwise, unwrapped; ``field_ut`` (n, 3) along the reference
    axis, left of it, up; ``turn_rate_rad_s`` over the last two steps.
    """

    start_ns: int
    end_ns: int
    nav: Float64Array
    gait: Gait
    yaw_rad: float
    turn_rate_rad_s: float
    field_ut: Float64Array | None

    def stride(self, ahead_rad: float, gravity_m_s2: float, pressure_pa: float | None) -> Stride:
        """The step with x ahead, ``ahead_rad`` counter-clockwise of the reference axis; gravity taken out."""
        yaw = self.nav[:, _YAW]
        accel = _levelled(self.nav[:, _ACCEL], yaw + ahead_rad)
        accel[:, 2] -= gravity_m_s2
        return Stride(
            start_ns=self.start_ns,
            end_ns=self.end_ns,
            level_accel_m_s2=accel,
            level_gyro_rad_s=_levelled(self.nav[:, _RATE], yaw + ahead_rad),
            time_s=_times(len(yaw)),
            level_field_ut=None if self.field_ut is None else _levelled(self.nav[:, _FIELD], yaw + ahead_rad),
            turn_rad=float(yaw[-1] - yaw[0]),
            pressure_pa=pressure_pa,
        )


def _times(count: int) -> Float64Array:
    """Seconds since the first of so many cells."""
    return np.arange(count, dtype=np.float64) * CELL_S


def _levelled(nav: Float64Array, yaw_rad: Float64Array) -> Float64Array:
    """Nav vectors (n, 3) in axes whose x points to these yaws (n,)."""
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    x, y = nav[:, 0], nav[:, 1]
    return np.column_stack([cosine * x + sine * y, cosine * y - sine * x, nav[:, 2]])


class Strides:
    """Keeps the newest cells and cuts steps out of them."""

    def __init__(self, denoising: Denoising = "step") -> None:
        self._denoising = denoising
        self._cells: deque[Cell] = deque(maxlen=_KEPT)
        self._before: tuple[int, int] | None = None  # start and end of the last step cut

    def __getstate__(self) -> tuple[Denoising, tuple[int, int] | None, int, Float64Array]:
        """As one array: six hundred cells one by one would take longer to save than all the rest."""
        first_ns = self._cells[0].time_ns if self._cells else 0
        values = np.array([cell.values for cell in self._cells]).reshape(-1, WIDTH)
        return self._denoising, self._before, first_ns, values

    def __setstate__(self, state: tuple[Denoising, tuple[int, int] | None, int, Float64Array]) -> None:
        self._denoising, self._before, first_ns, values = state
        cells = (Cell(first_ns + i * CELL_NS, tuple(row)) for i, row in enumerate(values.tolist()))
        self._cells = deque(cells, maxlen=_KEPT)

    def restart(self) -> None:
        """The stream broke."""
        self._cells.clear()
        self._before = None

    def add(self, cell: Cell) -> None:
        """Keep a cell."""
        self._cells.append(cell)

    def cut(self, start_ns: int, end_ns: int) -> Cut | None:
        """The step from peak to peak; with the step before, if they join, its gait is taken over both."""
        first_ns = self._first_of_two(start_ns)
        self._before = (start_ns, end_ns)
        both = self._between(first_ns, end_ns)
        own = min(len(both), (end_ns - start_ns) // CELL_NS)
        if own < _LEAST_CELLS:
            return None
        steps = 1 if first_ns == start_ns else 2
        yaw = both[:, _YAW]
        time_s = _times(len(both))
        level = _levelled(both[:, _ACCEL], yaw)
        part = slice(len(both) - own, len(both))
        gait = gait_of(time_s, level, (end_ns - first_ns) * 1e-9 / steps, part)
        field = _levelled(both[part, _FIELD], yaw[part])
        known = bool(np.isfinite(field).all())
        return Cut(
            start_ns=start_ns,
            end_ns=end_ns,
            nav=both[part],
            gait=gait,
            yaw_rad=self._direction(yaw, part, end_ns),
            turn_rate_rad_s=float(yaw[-1] - yaw[0]) / float(time_s[-1]),
            field_ut=field if known else None,
        )

    def likeness(self, peaks_ns: Sequence[int]) -> float:
        """How alike the stride from the first of five peaks to the third is to that from there to the last."""
        first_ns, middle_ns, last_ns = peaks_ns[::2]
        return likeness(self._motion(first_ns, middle_ns), self._motion(middle_ns, last_ns))

    def _motion(self, start_ns: int, end_ns: int) -> Float64Array:
        """Accelerations and rates (n, 6) along the reference axis, left of it, up."""
        nav = self._between(start_ns, end_ns)
        yaw = nav[:, _YAW]
        return np.hstack([_levelled(nav[:, _ACCEL], yaw), _levelled(nav[:, _RATE], yaw)])

    def _first_of_two(self, start_ns: int) -> int:
        """Where the step before began, if this one joins it and all of it is at hand; else where this does."""
        if self._before is None or self._before[1] != start_ns:
            return start_ns
        return self._before[0] if self._cells and self._cells[0].time_ns <= self._before[0] else start_ns

    def _direction(self, yaw: Float64Array, part: slice, end_ns: int) -> float:
        """The trunk's direction in the step, without its swing as far as that is wanted."""
        if self._denoising == "stride":
            return float(yaw.mean())
        if self._denoising == "wavelet":
            recent = self._between(end_ns - SPAN * CELL_NS, end_ns)[:, _YAW]
            own = part.stop - part.start
            return float(approximation(recent)[-own:].mean()) if len(recent) == SPAN else float(yaw.mean())
        return float(yaw[part].mean())

    def _between(self, start_ns: int, end_ns: int) -> Float64Array:
        """The cells that begin in [start, end), (n, `WIDTH`)."""
        if not self._cells:
            return np.zeros((0, WIDTH))
        first_ns = self._cells[0].time_ns
        low = max(0, (start_ns - first_ns) // CELL_NS)
        high = max(low, (end_ns - first_ns) // CELL_NS)
        picked = [self._cells[i].values for i in range(low, min(high, len(self._cells)))]
        return np.array(picked).reshape(-1, WIDTH)
