"""The azimuth sources by name."""

from collections.abc import Callable

from pdr_engine.body.azimuth.bridges import Bridged
from pdr_engine.body.azimuth.cascade import Cascade
from pdr_engine.body.azimuth.compass import Reading
from pdr_engine.body.azimuth.heading import Combined, CompassAlone, GyroAlone, Heading, Source
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


class Headings:
    """Two azimuths of the reference axis, step by step: for a track that keeps its shape, and from north.

    A compass past iron tells north within a few degrees only after minutes, and a track that is turned while it is
    walked loses its shape. So the default follows two: `Combined` for the track, and a prompt one for north. Other
    sources have one.
    """

    def __init__(self, azimuth: Azimuth, settings: HeadingSettings) -> None:
        self._track = source_of(azimuth, settings)
        self._prompt = Combined(settings, prompt=True) if azimuth == "combined" else None

    def step(self, turn_rad: float, step_s: float, reading: Reading | None) -> tuple[Heading, Heading]:
        """The track's, and that from north; see `Source`."""
        track = self._track.step(turn_rad, step_s, reading)
        return track, track if self._prompt is None else self._prompt.step(turn_rad, step_s, reading)

    def lose(self, sigma_rad: float) -> None:
        """See `Source`."""
        for source in self._all:
            source.lose(sigma_rad)

    def unbias(self, rate_rad_s: float) -> None:
        """See `Source`."""
        for source in self._all:
            source.unbias(rate_rad_s)

    @property
    def _all(self) -> tuple[Source, ...]:
        return (self._track,) if self._prompt is None else (self._track, self._prompt)


def source_of(azimuth: Azimuth, settings: HeadingSettings) -> Source:
    """A fresh source of this name."""
    return _SOURCES[azimuth](settings)
