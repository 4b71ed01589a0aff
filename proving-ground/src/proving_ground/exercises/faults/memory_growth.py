"""By how much the services' memory grows: a line through what each tells of itself, once it has settled."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from proving_ground.exercises.scoring.heard import Heard
from proving_ground.exercises.scoring.score import Row

_SETTLED_S: Final = 3600.0
"""Of a process's life: until then caches fill, and allocators find their size."""
_LEAST_S: Final = 1200.0
"""A shorter line says nothing of an hour."""


def memory_growth(heard: Mapping[str, Heard]) -> Row:
    """Per cent an hour, median and worst over all lives of processes that lasted so long; None without any."""
    growths = [
        growth
        for computer in heard.values()
        for samples in computer.memory_mb.values()
        for life in _lives(samples)
        if (growth := _pct_per_h(life)) is not None
    ]
    return {
        "memory_growth_median_pct_per_h": float(np.median(growths)) if growths else None,
        "memory_growth_worst_pct_per_h": max(growths, default=None),
        "memory_growth_lives": len(growths),
    }


def _lives(samples: Sequence[tuple[int, int, float]]) -> Iterator[Sequence[tuple[int, int, float]]]:
    """Samples (time ns, health's number, MB) of one process each: a number that goes back is another's."""
    begin = 0
    for index in range(1, len(samples)):
        if samples[index][1] < samples[index - 1][1]:
            yield samples[begin:index]
            begin = index
    yield samples[begin:]


def _pct_per_h(life: Sequence[tuple[int, int, float]]) -> float | None:
    settled = [(at / NS_PER_S, mb) for at, _, mb in life if at - life[0][0] >= _SETTLED_S * NS_PER_S]
    if len(settled) < 3 or settled[-1][0] - settled[0][0] < _LEAST_S:
        return None
    time_s, size_mb = np.array(settled).T
    slope = float(np.polyfit(time_s - time_s[0], size_mb, 1)[0])
    return 100.0 * 3600.0 * slope / float(size_mb[0])
