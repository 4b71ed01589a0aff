"""What is known of the person who wears the body unit, kept on disk from one start to the next.

A profile that cannot be read is told and left aside: the person is learned anew.
"""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import msgspec

from bootprint.bus import Envelope
from bootprint.config import Config
from bootprint.figures import Figures
from bootprint.files import write_whole
from bootprint.remembering import Memory, RememberingPart
from pdr_engine.body import BodySettings
from pdr_engine.body.azimuth.deviation import Deviation
from pdr_engine.body.length.personal import Person
from pdr_engine.engine import EngineCore

FILE = "body-profile.json"
SAVE_EVERY_NS = 60_000_000_000
_LEAST_SIGMA = 0.02  # shoes, load and place of the unit are not those of last time


class BodyProfile(Config, frozen=True):
    """The person's factor on step length and the sigma of its logarithm; `LengthSettings.refinement`.

    ``deviations``: of the compass by place, `BodySettings.deviations`.
    """

    scale: Annotated[float, msgspec.Meta(ge=0.5, le=2.0)]
    scale_sigma: Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
    refinement: tuple[Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)], ...] = ()
    deviations: tuple[Deviation, ...] = ()


def load_profile(path: Path) -> BodyProfile | None:
    """The profile in a file, None if there is none; ValueError or OSError if it cannot be read."""
    return msgspec.json.decode(path.read_bytes(), type=BodyProfile) if path.exists() else None


def save_profile(path: Path, profile: BodyProfile) -> None:
    """Write a profile so that a power cut leaves the old one or the new one."""
    write_whole(path, msgspec.json.encode(profile))


def with_profile(settings: BodySettings, profile: BodyProfile) -> BodySettings:
    """Settings that begin with what is known of the person."""
    sigma = max(_LEAST_SIGMA, profile.scale_sigma)
    length = msgspec.structs.replace(
        settings.length, scale=profile.scale, common_sigma_share=sigma, refinement=profile.refinement
    )
    return msgspec.structs.replace(settings, length=length, deviations=profile.deviations)


class EnginePart(RememberingPart):
    """The engine's core, its state saved every few seconds, its person's profile every minute and at the end."""

    def __init__(self, core: EngineCore, path: Path, memory: Memory | None = None) -> None:
        super().__init__(core, memory)
        self._engine, self._path = core, path
        self._profiled_ns: int | None = None
        self._unprofiled = 0

    def figures(self) -> Figures:
        """The core's own, and how often the profile could not be saved."""
        figures = super().figures()
        return replace(figures, counters=figures.counters | {"profile_unsaved": self._unprofiled})

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        """Save when it is time."""
        if self._profiled_ns is None or now_ns - self._profiled_ns >= SAVE_EVERY_NS:
            self._profiled_ns = now_ns
            self._save_profile()
        return super().tick(now_ns)

    def close(self) -> Iterable[Envelope]:
        """Save, and let the core say its last words."""
        self._save_profile()
        return super().close()

    def _save_profile(self) -> None:
        found = self._engine.person
        if found is None:
            return
        try:
            save_profile(self._path, self._profile(found))
        except OSError:
            self._unprofiled += 1  # a full disk costs the profile, not the soldier

    def _profile(self, person: Person) -> BodyProfile:
        return BodyProfile(
            scale=person.scale,
            scale_sigma=person.sigma,
            refinement=person.refinement,
            deviations=self._engine.deviations,
        )
