"""The tables that a navigator shares with its kernel: state and parameters, samples in, estimates and steps out."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from pdr_engine.foot.memory import ESTIMATE, RING, SAMPLE, STATE, STEP, fresh_state
from pdr_engine.foot.parameters import PARAMETERS, parameters
from pdr_engine.foot.settings import UNCALIBRATED, FootSettings, MagnetometerCalibration

Table = npt.NDArray[Any]

CHUNK = 1024  # samples a call of the kernel
ROWS = RING + CHUNK  # what one call may give: all that waited, and all that came
SHAPES = {
    "state": (STATE, 1),
    "parameters": (PARAMETERS, 1),
    "batch": (SAMPLE, CHUNK),
    "estimates": (ESTIMATE, ROWS),
    "steps": (STEP, ROWS),
}


@dataclass(frozen=True, slots=True)
class Tables:
    """One table a field; record types and rows as in `SHAPES`, for the kernel reads and writes them by address."""

    state: Table
    parameters: Table
    batch: Table
    estimates: Table
    steps: Table

    def __post_init__(self) -> None:
        for name, (dtype, rows) in SHAPES.items():
            table: Table = getattr(self, name)
            if table.dtype != dtype or table.shape != (rows,) or not table.flags.carray:
                raise ValueError(f"{name} must be {rows} contiguous rows of {dtype}")


def fresh_tables(settings: FootSettings, calibration: MagnetometerCalibration = UNCALIBRATED) -> Tables:
    """The tables before the first sample."""
    return Tables(
        state=fresh_state(settings),
        parameters=parameters(settings, calibration),
        batch=np.zeros(CHUNK, SAMPLE),
        estimates=np.zeros(ROWS, ESTIMATE),
        steps=np.zeros(ROWS, STEP),
    )
