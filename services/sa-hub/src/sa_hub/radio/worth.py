"""What telling each soldier is worth to each receiver: by how much it lowers errors until the next report."""

from typing import Final

import numpy as np

from sa_hub.radio.ground import FloatArray
from sa_hub.radio.outlook import Outlook
from sa_hub.radio.picture import Pictures

CURVE: Final = 1.6
"""Worth grows a little faster than the error: one symbol 20 m off is worse than three 10 m off."""
UNKNOWN_M: Final = 20.0
SILENCE_WORTH: Final = 0.3


def worth(outlook: Outlook, pictures: Pictures, enough_m: float, heartbeat_s: float) -> FloatArray:
    """(rows, n) by which pictures improve; errors below ``enough_m`` cost nothing, silence costs by heartbeats."""
    who = outlook.who
    off_east, off_north = pictures.off_m(who.slots, who.latitude, who.longitude, who.now_s)
    shown_east, shown_north = pictures.velocity_m_s(who.slots, who.now_s)
    known = pictures.known[:, who.slots]
    east, north = (
        off[None] + way[:, None] - shown[None] * outlook.reaches_s
        for off, way, shown in (
            (off_east, outlook.ways_m[:, :, 0], shown_east),
            (off_north, outlook.ways_m[:, :, 1], shown_north),
        )
    )
    error_m = np.where(known, np.hypot(east, north), UNKNOWN_M)
    left = outlook.left_m()
    left_m = np.hypot(left[:, None, :, 0], left[:, None, :, 1])
    gains = _cost(error_m, enough_m) - _cost(left_m, enough_m)
    gain: FloatArray = np.maximum(gains.mean(axis=0), 0.0)
    silence = np.maximum(who.time_s - pictures.time_s[:, who.slots], 0.0) / heartbeat_s
    return gain + np.where(known, SILENCE_WORTH * silence**2, 0.0)


def _cost(error_m: FloatArray, enough_m: float) -> FloatArray:
    cost: FloatArray = np.maximum(error_m - enough_m, 0.0) ** CURVE
    return cost
