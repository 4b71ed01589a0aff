"""Inertial samples gathered into batches of a stated size and age."""

from collections.abc import Iterator

import numpy as np

from bootprint.messages import Int64Array, Vector3
from sensor_gateway.readings import ImuReading

Samples = list[tuple[int, ImuReading]]


class ImuBatcher:
    """Samples (UTC ns, reading) of one place; a batch never spans more than ``max_age_ns``."""

    def __init__(self, size: int, max_age_ns: int) -> None:
        self._size = size
        self._max_age_ns = max_age_ns
        self._samples: Samples = []

    def add(self, utc_ns: int, reading: ImuReading) -> Iterator[Samples]:
        """Take a sample; yield what it completes: the batch it does not fit into, or the one it fills."""
        if self.is_due(utc_ns) or (self._samples and utc_ns < self._samples[-1][0]):
            yield self.take()
        self._samples.append((utc_ns, reading))
        if len(self._samples) >= self._size:
            yield self.take()

    def is_due(self, now_ns: int) -> bool:
        """Whether the oldest sample has waited too long."""
        return bool(self._samples) and now_ns - self._samples[0][0] > self._max_age_ns

    def take(self) -> Samples:
        """What is waiting."""
        samples, self._samples = self._samples, []
        return samples


def mags(samples: Samples) -> list[Vector3] | None:
    """The field of every sample, or None if one has none."""
    found = [reading.mag_ut for _, reading in samples if reading.mag_ut is not None]
    return found if len(found) == len(samples) else None


def batch_bounds(times_ns: Int64Array, size: int, max_age_ns: int) -> Iterator[tuple[int, int]]:
    """How a whole series (n,) falls into the same batches: (first, behind last) of each."""
    first = 0
    while first < len(times_ns):
        too_late = int(np.searchsorted(times_ns, times_ns[first] + max_age_ns, side="right"))
        end = min(first + size, too_late)
        yield first, end
        first = end
