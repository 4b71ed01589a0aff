"""From raw samples to usable ones: what cannot be is refused and counted, breaks of the stream are told.

Samples come one by one, so that nothing depends on how they were cut into batches.
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

NS = 1e-9
CLOCK_PATIENCE = 100  # samples with earlier stamps, until the clock is believed to have been set back
LONG_GAP_S = 0.5  # a trunk does too much in a longer one to go on as if nothing had been
SHORTEST_S = 1e-4
MOST_FORCE_M_S2, MOST_RATE_RAD_S, MOST_FIELD_UT = 1e3, 1e2, 1e4

Vector = tuple[float, float, float]


class Sample(NamedTuple):
    """One usable sample, device axes; ``step_s`` since the last one, 0 at the first and after a break."""

    time_ns: int
    step_s: float
    accel_m_s2: Vector
    gyro_rad_s: Vector
    field_ut: Vector | None
    breaks: bool


def _is_usable(vector: Vector, most: float) -> bool:
    return all(math.isfinite(value) and abs(value) < most for value in vector)


@dataclass(slots=True)
class Intake:
    """Judges sample after sample."""

    newest_ns: int | None = None
    dropped_in_a_row: int = 0
    counters: dict[str, int] = field(
        default_factory=lambda: {"accepted": 0, "dropped": 0, "gaps": 0, "fields_dropped": 0}
    )

    def judge(self, time_ns: int, accel: Vector, gyro: Vector, field_ut: Vector | None) -> Sample | None:
        """The sample if it can be used, None if not."""
        step_s = 0.0 if self.newest_ns is None else (time_ns - self.newest_ns) * NS
        sane = _is_usable(accel, MOST_FORCE_M_S2) and _is_usable(gyro, MOST_RATE_RAD_S)
        late = self.newest_ns is not None and step_s < SHORTEST_S
        if not sane or (late and (step_s > 0.0 or self.dropped_in_a_row < CLOCK_PATIENCE)):
            self.counters["dropped"] += 1
            self.dropped_in_a_row += 1
            return None
        breaks = late or step_s > LONG_GAP_S
        self.counters["gaps"] += breaks
        self.counters["accepted"] += 1
        self.newest_ns, self.dropped_in_a_row = time_ns, 0
        return Sample(time_ns, 0.0 if breaks else step_s, accel, gyro, self._field(field_ut), breaks)

    def _field(self, field_ut: Vector | None) -> Vector | None:
        if field_ut is None or _is_usable(field_ut, MOST_FIELD_UT):
            return field_ut
        self.counters["fields_dropped"] += 1
        return None
