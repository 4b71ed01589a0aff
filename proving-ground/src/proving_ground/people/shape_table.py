"""Reads a table of `stride_shapes`: whole numbers of `TABLE_UNIT`."""

import numpy as np

from proving_ground.people.shape import CHANNELS, FREE, StrideShape

# Finer than it looks: over a knot of 25 ms a hundredth of a millimetre is 0.02 m/s².
TABLE_UNIT = 1e-5
_ENDS = (7, 13, 19)  # of the figures, of creep, of its sigma; curves follow


def parsed(text: str) -> StrideShape:
    """The shape that such a table holds."""
    numbers = np.array(text.split(), dtype=np.float64) * TABLE_UNIT
    figures, creep, creep_sigma, curves = np.split(numbers, _ENDS)
    tables = curves.reshape(-1, len(CHANNELS), FREE)
    speed, slowest, fastest, rise, length, lift, land = figures.tolist()
    return StrideShape(
        speed_m_s=speed,
        slowest_m_s=slowest,
        fastest_m_s=fastest,
        rise_m=rise,
        length_m=length,
        lift_share=lift,
        land_share=land,
        mean=tables[0],
        by_speed=tables[1],
        modes=tables[2:],
        creep=creep,
        creep_sigma=creep_sigma,
    )
