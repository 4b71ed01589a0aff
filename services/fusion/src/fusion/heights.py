"""What air pressure and floors do to the boots' height."""

from collections import Counter

import numpy as np

from bootprint.messages import FootStep, Pressure
from fusion.altitude import Climb, Landing, LiftWatch
from fusion.boots import Boots
from fusion.config import FusionConfig
from fusion.filter import Measurement
from fusion.models import body
from fusion.shadows import Shadows


class Heights:
    """Lifts and floors of one soldier; ``shadows`` are carried along."""

    def __init__(self, config: FusionConfig, shadows: Shadows, counters: Counter[str]) -> None:
        self._config = config.altitude
        self._lift = LiftWatch(config.altitude, floors_known=config.floor_height_m is not None)
        self._landing = Landing(config.altitude, config.floor_height_m)
        self._shadows = shadows
        self._counters = counters

    def step(self, boots: Boots, place: str, step: FootStep) -> None:
        """A step that the boots have been told."""
        self._lift.step(place, step)
        if self._landing.step(step):
            self._stand_on_floor(boots, step.time_ns)

    def pressure(self, boots: Boots, pressure: Pressure, *, outdoors: bool) -> None:
        """A sample of air pressure."""
        climb = self._lift.pressure(pressure, outdoors=outdoors)
        if climb is None or boots.reference is None:
            return
        self._carry(boots, climb)
        if climb.ended:
            self._arrive(boots, climb, pressure.time_ns)

    def _arrive(self, boots: Boots, climb: Climb, time_ns: int) -> None:
        """A lift stops at floors: what ended between them was a whim of the air."""
        up_m = float(body.position(boots.filter.state, boots.stands(time_ns))[2])
        if boots.in_enu and self._landing.is_between(up_m):
            self._counters["rides_undone"] += 1
            self._carry(boots, Climb(-climb.ridden_m, 0.0))
        else:
            self._counters["rides"] += 1
            self._stand_on_floor(boots, time_ns)

    def shift(self, by_ns: int) -> None:
        """The clock has been set."""
        self._lift.shift(by_ns)

    def _carry(self, boots: Boots, climb: Climb) -> None:
        by = np.array([0.0, 0.0, climb.up_m])
        spread = np.diag([0.0, 0.0, climb.sigma_m**2 if climb.ended else 0.0])
        for one in (boots, *(shadow.boots for shadow in self._shadows)):
            one.carry(by, spread)

    def _stand_on_floor(self, boots: Boots, time_ns: int) -> None:
        """Draw the height to the floor that it is near to; only in ENU, where floors are."""
        if not boots.in_enu:
            return
        for one in (boots, *(shadow.boots for shadow in self._shadows)):
            stands, state = one.stands(time_ns), one.filter.state
            up_m = float(body.position(state, stands)[2])
            floor_m = self._landing.floor_m(up_m)
            if floor_m is not None:
                jacobian = body.position_jacobian(state, stands)[2:]
                noise = np.array([[self._config.floor_sigma_m**2]])
                one.correct(Measurement("floor", np.array([floor_m - up_m]), jacobian, noise))
