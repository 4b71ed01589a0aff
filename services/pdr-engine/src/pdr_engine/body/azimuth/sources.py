"""The azimuth sources by name."""

from collections.abc import Callable

from pdr_engine.body.azimuth.bridges import Bridged
from pdr_engine.body.azimuth.cascade import Cascade
from pdr_engine.body.azimuth.heading import Combined, CompassAlone, GyroAlone, Source
from pdr_engine.body.settings import Azimuth, HeadingSettings

_SOURCES: dict[Azimuth, Callable[[HeadingSettings], Source]] = {
    "combined": Combined,
    "gyro": GyroAlone,
    "compass": CompassAlone,
    "two-axis": CompassAlone,
    "cascade": Cascade,
    "bridge": lambda settings: Bridged("kalman", settings),
    "bridge-direct": lambda settings: Bridged("plain", settings),
    "bridge-weighted": lambda settings: Bridged("exponential", settings),
}


def source_of(azimuth: Azimuth, settings: HeadingSettings) -> Source:
    """A fresh source of this name."""
    return _SOURCES[azimuth](settings)
