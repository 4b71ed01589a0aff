"""What a load test is asked: who walks, over which radio, with how many bits; and what comes out of a format."""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Final, Literal

from bootprint.clock import NS_PER_S
from bootprint.errors import ConfigError
from proving_ground.exercises.exercise import ORIGIN
from proving_ground.radio_load.picture_error import Errors
from proving_ground.radio_load.squad_tracks import LONGEST_S, SquadTracks, squad_tracks
from sa_hub.radio.medium import Medium
from sa_hub.radio.profiles import named
from sa_hub.settings import LinkProfile

__all__ = ["BEGINS_NS", "NET", "ORIGIN", "Load", "Outcome"]

NET: Final = "squad"
"""The narrow net's name."""

BEGINS_NS: Final = round(datetime(2026, 6, 1, 8, 0, tzinfo=UTC).timestamp()) * NS_PER_S
"""The zero of tracks, UTC ns; whole seconds, as radio decisions fall on a grid of event time."""
LOSSY_RECEIVERS: Final = 3
MOST_SOLDIERS: Final = 1000
SETTLE_S: Final = 2.0
"""How long the net runs on after the last position."""
_OTHER_SQUAD: Final = 10_000
_SHARED_OUT: Final = (
    0.8  # of the radio's rate, to sender and receivers: a frame that waits for the air is late
)
_MOST_EXPECTED: Final = 0.8
"""A planner who states a loss states it to the hub, too, which goes by it until receivers tell what they heard."""
_LEAST_BITS_PER_S: Final = 15
TagBytes = Literal[8, 4]


@dataclass(frozen=True)
class Load:
    """One load test. ``bitrate`` is the squad's budget on the ``link``; ``feedback``: receivers speak, too.

    They report themselves, or, ``posts``, have no place of their own and tell nothing but what they heard.
    ``foreseen``: the sender's settings say how many frames are lost.
    """

    soldiers: int = 12
    bitrate: int = 34
    loss: float = 0.0
    tag: TagBytes = 8
    link: str = "raw"
    tracks: str = "patrol"
    seed: int = 1
    feedback: bool = True
    posts: bool = False
    foreseen: bool = True
    duration_s: float = LONGEST_S
    data: Path | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.soldiers <= MOST_SOLDIERS:
            raise ConfigError(f"--soldiers {self.soldiers}: want 1 to {MOST_SOLDIERS}")
        if self.bitrate < 1:
            raise ConfigError(f"--bitrate {self.bitrate}: want 1 bit/s or more")
        if not 0.0 <= self.loss < 1.0:
            raise ConfigError(f"--loss {self.loss:g}: want a share from 0 to below 1, e.g. 0.2")
        if not self.duration_s >= 10.0:
            raise ConfigError(f"--duration {self.duration_s:g}: want 10 s or more")
        if self.tag not in (4, 8):
            raise ConfigError(f"--tag {self.tag}: want 8 or 4 bytes")
        _ = self.hub_link

    @cached_property
    def hub_link(self) -> LinkProfile:
        """The narrow net as the sender's settings have it; ConfigError if the radio cannot give this budget."""
        return self._link(self.bitrate)

    @cached_property
    def receivers_link(self) -> LinkProfile | None:
        """The same for a receiver that speaks, too: as much as the sender, if the radio has that left; None
        without feedback, or where the radio has hardly anything left."""
        left = int(_SHARED_OUT * self.medium.rate_bits_per_s) - self.bitrate
        rate = min(self.bitrate, left // len(self.receivers))
        return self._link(rate) if self.feedback and rate >= _LEAST_BITS_PER_S else None

    def _link(self, rate_bits_per_s: int) -> LinkProfile:
        _ = named(self.link)
        try:
            return LinkProfile(
                name=NET,
                profile=self.link,
                rate_bits_per_s=rate_bits_per_s,
                expected_loss=min(self.loss, _MOST_EXPECTED) if self.foreseen else 0.0,
            )
        except ValueError as error:
            raise ConfigError(f"--link {self.link} --bitrate {self.bitrate}: {error}") from error

    @property
    def medium(self) -> Medium:
        """What a frame costs on the radio, and its rate."""
        return self.hub_link.medium

    @property
    def latency_s(self) -> float:
        """From the end of a transmission to its being heard."""
        return named(self.link).latency_s

    @property
    def receivers(self) -> tuple[str, ...]:
        """Who listens: without loss all hear the same, so one is enough."""
        return tuple(f"r{index + 1}" for index in range(LOSSY_RECEIVERS if self.loss else 1))

    def squad(self) -> SquadTracks:
        """What the soldiers' fusions tell."""
        return squad_tracks(self.tracks, self.soldiers, self.seed, self.data, self.duration_s)

    def receivers_tracks(self) -> SquadTracks:
        """What the receivers' own fusions tell: they are of another squad on the same kind of ground."""
        count, seed = len(self.receivers), self.seed + _OTHER_SQUAD
        return squad_tracks(self.tracks, count, seed, self.data, self.duration_s)


@dataclass
class Outcome:
    """What a format did in one load test.

    ``frames`` are (time ns, bytes on the air) of all that was offered, ``reports`` how many positions they told.
    ``feedback_bits`` is what the receivers spent, ``squeezed`` the errors over a link no faster than the budget,
    if the format asked for more.
    """

    errors: Errors
    duration_s: float
    frames: list[tuple[int, int]] = field(default_factory=list)
    reports: int = 0
    dropped: int = 0
    feedback_bits: int = 0
    budget_exceeded: bool = False
    squeezed: Errors | None = None

    @property
    def bits(self) -> int:
        """All bits offered to the air."""
        return 8 * sum(size for _, size in self.frames)
