"""The navigator of one foot: a thin face of the compiled stream.

Nav frame: starts at 0, z up, right-handed. Its x axis is the horizontal direction in which the sensor's x axis
points at the first alignment (the y axis, if x is steeper than 45°); yaw is the foot's turn about the vertical
since the start, counter-clockwise, and so is zero there. Where north is, nobody here knows.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from bootprint.geomagnetism import EarthField
from bootprint.messages import Float64Array, Int64Array
from pdr_engine.foot.machine_code import load_kernel
from pdr_engine.foot.memory import SAMPLE
from pdr_engine.foot.settings import UNCALIBRATED, FootSettings, MagnetometerCalibration
from pdr_engine.foot.steps import FootStepEstimate, step_from_row
from pdr_engine.foot.tables import CHUNK, fresh_tables

CONTRADICTED_STANCES, CONTRADICTED_SHARE = 10, 0.1
# Samples; gaps of more than 50 ms; cut peaks of the gyro, cut samples of the accelerometer; what the filter did;
# what became of the magnetometer's fields, one a stance.
COUNTERS = (
    *("accepted", "dropped", "gaps", "missing", "clippings", "force_clippings"),
    *("stances", "contradictions", "realignments", "fields_used", "fields_refused"),
)


@dataclass(frozen=True, slots=True)
class FootEstimates:
    """What one call gave: the samples that became known, one row each, and the steps that ended."""

    rows: npt.NDArray[Any]
    steps: list[FootStepEstimate]

    @property
    def time_ns(self) -> Int64Array:
        """Sample times, shape (k,)."""
        return self.rows["time_ns"]

    @property
    def position_m(self) -> Float64Array:
        """The sensor's place in the nav frame, shape (k, 3)."""
        return self.rows["position_m"]

    @property
    def speed_m_s(self) -> Float64Array:
        """The sensor's speed, shape (k,)."""
        return self.rows["speed_m_s"]

    @property
    def attitude(self) -> Float64Array:
        """The turn from sensor to nav axes as a quaternion w x y z, shape (k, 4)."""
        return self.rows["attitude"]

    @property
    def yaw_rad(self) -> Float64Array:
        """The foot's yaw since the start in (−π, π], shape (k,)."""
        return self.rows["yaw_rad"]

    @property
    def stance(self) -> npt.NDArray[np.bool_]:
        """Whether the sample got a zero-velocity update, shape (k,)."""
        return self.rows["stance"]


class FootNavigator:
    """Dead reckoning of one foot, sample by sample.

    Results come at most 100 ms after their sample (the first ones when the foot has been found at rest, or after
    a second at the latest) and do not depend on how the samples are cut into batches.
    """

    def __init__(
        self,
        settings: FootSettings | None = None,
        calibration: MagnetometerCalibration = UNCALIBRATED,
    ) -> None:
        self.settings = settings or FootSettings()
        tables = fresh_tables(self.settings, calibration)
        self._state, self._parameters = tables.state, tables.parameters
        self._estimates, self._steps = tables.estimates, tables.steps
        self._time_ns, self._accel, self._gyro, self._mag = (
            tables.batch[name] for name in SAMPLE.names or ()
        )
        self._run = load_kernel().bind(tables)
        self._made = self._state["estimates"], self._state["steps"]

    def process(
        self,
        time_ns: Int64Array,
        accel: Float64Array,
        gyro: Float64Array,
        mag: Float64Array | None = None,
    ) -> FootEstimates:
        """Take a batch of any size: ``time_ns`` (n,) UTC, ``accel`` (n, 3) m/s², ``gyro`` (n, 3) rad/s.

        ``mag`` (n, 3) µT, in the axes of the other two, holds the heading where the field deserves it.
        """
        count = len(time_ns)
        if count <= CHUNK:
            self._time_ns[:count] = time_ns
            self._accel[:count] = accel
            self._gyro[:count] = gyro
            self._mag[:count] = math.nan if mag is None else mag
            return self._feed(count, ends=False)
        cuts = [slice(i, i + CHUNK) for i in range(0, count, CHUNK)]
        pieces = [
            self.process(time_ns[cut], accel[cut], gyro[cut], None if mag is None else mag[cut])
            for cut in cuts
        ]
        rows = np.concatenate([piece.rows for piece in pieces])
        return FootEstimates(rows, [step for piece in pieces for step in piece.steps])

    @property
    def state(self) -> npt.NDArray[Any]:
        """The record that the navigator is (`memory.STATE`), shape (1,): a view."""
        return self._state

    def go_on(self, state: npt.NDArray[Any]) -> None:
        """Become the navigator whose record this is, shape (1,)."""
        self._state[:] = state

    def know_earth_field(self, field: EarthField) -> None:
        """What the field should be here: from now on steps tell their magnetic azimuth where it is like that."""
        self._parameters["earth_horizontal"] = field.horizontal_ut
        self._parameters["earth_vertical"] = field.up_ut

    def finish(self) -> FootEstimates:
        """The stream has ended: what still waited for its look-ahead."""
        return self._feed(0, ends=True)

    def counters(self) -> dict[str, int]:
        """Counts since the start, by the names of `COUNTERS`."""
        return {name: int(self._state[name][0]) for name in COUNTERS}

    @property
    def contradicts_itself(self) -> bool:
        """Whether the sensors do not fit together: one stance in ten, of ten at least, begins seven sigmas off.

        Left-handed axes and wrong units do that; of the recorded walks none does, whatever fault is put into it
        (`proving_ground.evaluation.foot.faults`), but some at 50 Hz. Or the filter is lost more often than the foot
        stands, and ten times at least: a force a hundred times too large, or none.
        """
        names = ("stances", "contradictions", "realignments")
        stances, contradictions, realignments = (int(self._state[name][0]) for name in names)
        surprised = stances >= CONTRADICTED_STANCES and contradictions > CONTRADICTED_SHARE * stances
        return surprised or realignments > max(stances, CONTRADICTED_STANCES)

    @property
    def gyro_bias_rad_s(self) -> Float64Array:
        """The gyro bias as it is known now, sensor axes, shape (3,)."""
        bias: Float64Array = self._state["bias"][0].copy()
        return bias

    @property
    def lever_m(self) -> Float64Array:
        """From the sensor to the sole's still point as it is known now, sensor axes, shape (3,)."""
        lever: Float64Array = self._state["lever"][0].copy()
        return lever

    def _feed(self, count: int, *, ends: bool) -> FootEstimates:
        self._run(count, ends)
        estimates, steps = self._made
        ended = steps.item()
        return FootEstimates(
            self._estimates[: estimates.item()].copy(),
            [step_from_row(row) for row in self._steps[:ended]] if ended else [],
        )


@cache
def warm_up() -> str | None:
    """Compile the kernel, or load it from disk, before the first sample comes.

    Returns why numba has to run it in this process, None if it does not (`machine_code`).
    """
    navigator = FootNavigator()
    navigator.process(np.zeros(1, np.int64), np.zeros((1, 3)), np.zeros((1, 3)))
    navigator.finish()
    return load_kernel().fallback
