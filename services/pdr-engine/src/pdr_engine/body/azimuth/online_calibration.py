"""The compass calibrated while walking (METHODS A5 on line): what `WornIron` learns, used once it is known well.

The unit's axes ahead, left and up are those of its mean posture: a trunk sways, and tilts with every step.
"""

import numpy as np

from bootprint.geomagnetism import EarthField
from bootprint.messages import Float64Array
from pdr_engine.body.azimuth.worn_iron import WornIron
from pdr_engine.body.settings import HeadingSettings
from pdr_engine.body.steps.attitude import Rows
from pdr_engine.body.steps.strides import Cut

_POSTURE_STEPS = 8.0  # over which the posture is averaged


class OnlineCalibration:
    """Takes what is worn off the fields of steps: for each step `corrected`, then `learn`."""

    def __init__(self, settings: HeadingSettings) -> None:
        self.iron = WornIron(settings)
        self.corrects = False
        self._frame: Float64Array = np.eye(3)
        self._up: Float64Array | None = None  # mean direction of up, device axes

    def know_earth_field(self, field: EarthField) -> None:
        """What the field should be here."""
        self.iron.know_earth_field(field)

    def corrected(self, cut: Cut, rows: Rows, reference: tuple[float, float]) -> Float64Array | None:
        """A step's fields (n, 3) as far as is known; None without any.

        ``rows``: the attitude about now; ``reference``: east and north part of the reference axis in it.
        """
        self._frame = self._posture(rows, reference)
        if cut.field_ut is None or not self.corrects:
            return cut.field_ut
        return self.iron.corrected(cut.field_ut, self._frame)

    def learn(self, cut: Cut, step_s: float, clean: bool) -> tuple[float, float] | None:
        """Take the step in. Where a correction begins now: the unit's azimuth and its sigma without the iron.

        What a filter made of the readings before is wrong then. ``clean``: nothing disturbs the field.
        """
        if cut.field_ut is None:
            return None
        self.iron.step(cut.field_ut.mean(axis=0), self._frame, cut.yaw_rad, step_s, clean)
        if self.corrects or not self.iron.sure(self._frame):
            return None
        self.corrects = True
        return self.iron.azimuth(cut.yaw_rad)

    def _posture(self, rows: Rows, reference: tuple[float, float]) -> Float64Array:
        """Ahead (along the reference axis), left and up in device axes (3, 3)."""
        nav = np.array(rows)
        self._up = nav[2] if self._up is None else self._up + (nav[2] - self._up) / _POSTURE_STEPS
        up = self._up / np.linalg.norm(self._up)
        ahead = reference[0] * nav[0] + reference[1] * nav[1]
        ahead = ahead - (ahead @ up) * up
        ahead = ahead / np.linalg.norm(ahead)
        return np.array([ahead, np.cross(up, ahead), up])
