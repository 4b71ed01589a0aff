"""Reports of soldiers who are some metres north of the origin, as radio nets take them in."""

from sa_hub.radio.content import Report
from support.hub_squad import ORIGIN, START_NS, S

METRE_DEG = 1.0 / 111_133.0
"""Of latitude, by the mean that the radio's own grid has."""


def at(number: int, seconds: float, north_m: float = 0.0, **options: object) -> Report:
    """A report of a soldier at a time after the start."""
    return Report(
        number=number,
        time_ns=START_NS + round(seconds * S),
        latitude_deg=ORIGIN.latitude_deg + north_m * METRE_DEG,
        longitude_deg=ORIGIN.longitude_deg,
        accuracy_m=1.0,
        **options,  # type: ignore[arg-type]
    )
