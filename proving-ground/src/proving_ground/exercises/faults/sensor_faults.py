"""Faults of sensors, done to what they measured: unplugged, frozen, saturated, NaN; from a time on, for a while."""

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from proving_ground.exercises.exercise import Fault, FloatArray
from sensor_gateway.recordings.run import ImuSeries, Run

Series = TypeVar("Series")
_ACCEL_LIMIT_M_S2 = 160.0
_GYRO_LIMIT_RAD_S = 35.0
_OTHERS = {"gnss": "gnss", "pressure": "pressure", "camera": "camera", "range": "ranges"}
SENSOR_FAULTS = ("sensor_unplugged", "sensor_frozen", "sensor_saturated", "sensor_nan")


def with_faults(run: Run, faults: Sequence[Fault], soldier: str) -> Run:
    """The run as the soldier's broken sensors would have measured it; the same run if none breaks."""
    for fault in faults:
        if fault.target == soldier and fault.kind in SENSOR_FAULTS:
            run = _broken(run, fault)
    return run


def _broken(run: Run, fault: Fault) -> Run:
    sensor = str(fault.details["sensor"])
    if sensor in run.imus:
        return replace(run, imus={**run.imus, sensor: _done_to(run.imus[sensor], fault)})
    name = _OTHERS.get(sensor, "")
    series = getattr(run, name, None) if name else None
    return run if series is None else replace(run, **{name: _done_to(series, fault)})


def _done_to(series: Series, fault: Fault) -> Series:
    time_s: FloatArray = series.time_s  # type: ignore[attr-defined]
    during = (time_s >= fault.at_s) & (time_s < fault.until_s)
    if fault.kind == "sensor_unplugged":
        return _each(series, lambda _, values: values[~during])
    if fault.kind == "sensor_frozen":
        last = max(0, int(np.argmax(during)) - 1)
        return _measured(series, lambda _, values: _set(values, during, values[last]))
    if fault.kind == "sensor_nan":
        return _measured(series, lambda _, values: _set(values, during, np.nan))
    return _saturated(series, during)


def _saturated(series: Series, during: npt.NDArray[np.bool_]) -> Series:
    """An inertial unit sticks at the ends of its ranges; of other sensors nobody knows such an end."""
    if not isinstance(series, ImuSeries):
        return series
    limits = {"accel_m_s2": _ACCEL_LIMIT_M_S2, "gyro_rad_s": _GYRO_LIMIT_RAD_S}

    def stuck(name: str, values: FloatArray) -> FloatArray:
        limit = limits.get(name)
        return values if limit is None else _set(values, during, np.copysign(limit, values[during]))

    return _measured(series, stuck)


def _set(values: FloatArray, where: npt.NDArray[np.bool_], to: Any) -> FloatArray:
    if not np.issubdtype(np.asarray(values).dtype, np.floating):
        return values  # names of peers do not freeze
    changed = values.copy()
    changed[where] = to
    return changed


def _each(series: Series, change: Callable[[str, Any], Any]) -> Series:
    """The series with every column changed."""
    columns = {
        item.name: getattr(series, item.name)
        for item in fields(series)  # type: ignore[arg-type]
    }
    changed = {
        name: change(name, np.asarray(values)) for name, values in columns.items() if values is not None
    }
    restored = {
        name: tuple(values.tolist()) if isinstance(columns[name], tuple) else values
        for name, values in changed.items()
    }
    return replace(series, **restored)  # type: ignore[type-var]


def _measured(series: Series, change: Callable[[str, Any], Any]) -> Series:
    """The same for all columns but the times."""
    return _each(series, lambda name, values: values if name.endswith("time_s") else change(name, values))
