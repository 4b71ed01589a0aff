"""The added error of a picture: each second, how far off a receiver shows a soldier, against what the soldier's own
fusion has told the sender by then, at the newest moment that it has told.

So what a fusion takes to tell a place (half a second) is not counted as the radio's doing; all that comes after is:
deciding, waiting for bits, the time on the air, rounding and losses.
"""

from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from bootprint.prediction import moved_m
from proving_ground.radio_load.squad_tracks import SquadTracks
from proving_ground.radio_load.telling import DELAY_S, PERIOD_S, FloatArray

_SAMPLED_S: Final = 1.0
_COLUMNS: Final = 6
Moving = Callable[[float, float, float], tuple[float, float]]
"""Where velocity (east, north) m/s takes a symbol on the map after so many seconds."""


def stay(_east_m_s: float, _north_m_s: float, _elapsed_s: float) -> tuple[float, float]:
    """The symbol stands where it was last reported."""
    return 0.0, 0.0


def straight_on(east_m_s: float, north_m_s: float, elapsed_s: float) -> tuple[float, float]:
    """The symbol goes on at constant velocity."""
    return east_m_s * elapsed_s, north_m_s * elapsed_s


DAMPED: Final[Moving] = moved_m
"""The project's own rule."""


class Seen:
    """What one receiver was told of one soldier, in the order of arrival."""

    def __init__(self) -> None:
        self._values = array("d")

    def add(
        self,
        arrived_s: float,
        stamp_s: float,
        place_m: tuple[float, float],
        velocity_m_s: tuple[float, float],
    ) -> None:
        """A report has come; one that is older than the newest changes nothing."""
        if not self._values or stamp_s > self._values[-_COLUMNS + 1]:
            self._values.extend((arrived_s, stamp_s, *place_m, *velocity_m_s))

    def rows(self) -> FloatArray:
        """All of it (k, 6): arrival s, stamp s, east and north m, velocity east and north m/s."""
        return np.array(self._values, dtype=np.float64).reshape(-1, _COLUMNS)


@dataclass
class Errors:
    """Samples pooled over soldiers, receivers and seconds: ``added_m`` and ``age_s`` where there was a report."""

    added_m: list[FloatArray] = field(default_factory=list)
    age_s: list[FloatArray] = field(default_factory=list)
    expected: int = 0

    def take(self, seen: Seen, tracks: SquadTracks, soldier: int, moving: Moving) -> None:
        """Add what one receiver saw of one soldier."""
        seconds = np.arange(_SAMPLED_S, tracks.duration_s, _SAMPLED_S)
        self.expected += seconds.size
        rows = seen.rows()
        known = seconds[seconds >= rows[0, 0]] if len(rows) else seconds[:0]
        newest = rows[np.searchsorted(rows[:, 0], known, side="right") - 1] if len(known) else rows[:0]
        # The newest stamp that the fusion had published by then.
        told_s = np.maximum(np.floor((known - DELAY_S) / PERIOD_S + 1e-6) * PERIOD_S, 0.0)
        age_s = known - newest[:, 1]
        elapsed_s = told_s - newest[:, 1]
        moved = np.array(
            [moving(row[4], row[5], to) for row, to in zip(newest.tolist(), elapsed_s.tolist(), strict=True)]
        ).reshape(-1, 2)
        shown_m = newest[:, 2:4] + moved
        self.added_m.append(np.linalg.norm(shown_m - tracks.at(soldier, told_s), axis=1))
        self.age_s.append(age_s)

    def join(self, other: "Errors") -> None:
        """Add another's samples."""
        self.added_m += other.added_m
        self.age_s += other.age_s
        self.expected += other.expected

    def percentile_m(self, share: float) -> float | None:
        """Of the added error, m."""
        return _percentile(self.added_m, share)

    @property
    def age_p95_s(self) -> float | None:
        """95th percentile of the reports' age, s."""
        return _percentile(self.age_s, 95.0)

    @property
    def missing_pct(self) -> float:
        """Share of the samples at which a receiver had never heard of the soldier."""
        known = sum(len(part) for part in self.age_s)
        return 100.0 * (self.expected - known) / self.expected if self.expected else 0.0


def _percentile(parts: list[FloatArray], share: float) -> float | None:
    values = np.concatenate(parts) if parts else np.empty(0)
    return float(np.percentile(values, share)) if values.size else None
