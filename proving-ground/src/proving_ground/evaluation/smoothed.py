"""Recorded walks through fusion again and back through the smoother: positions as known afterwards."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bootprint.bus import Envelope
from bootprint.config import Origin, load_computer
from bootprint.errors import RecordingError
from bootprint.messages import Fix, GnssFix, Position
from bootprint.recording import read_envelopes
from bootprint.topics import Identity
from fusion.config import FusionConfig
from fusion.engine import SUBJECTS, FusionCore
from fusion.output import Estimate, Publisher, horizontal_sigma_m
from fusion.smoother import FootTrack, Smoother, body_track

SOURCE = "smoothed"
_NS_PER_S = 1_000_000_000


@dataclass(frozen=True)
class Walk:
    """One soldier's smoothed positions, in order of time."""

    identity: Identity
    positions: tuple[Position, ...]

    @property
    def duration_s(self) -> float:
        """From the first position to the last."""
        return (self.positions[-1].time_ns - self.positions[0].time_ns) / _NS_PER_S

    @property
    def median_sigma_m(self) -> float:
        """Of the horizontal error's larger axis."""
        return float(np.median([_sigma_m(position) for position in self.positions]))


def smoothed_walks(recording: Path, config: Path | None, soldier: str | None) -> list[Walk]:
    """The walk of every soldier in a recording, or of one; RecordingError if there is none to be had.

    ``config``: whose ``[fusion]`` and realm count; without one, defaults, and a frame around the first fix.
    """
    heard = _by_soldier(recording, soldier)
    if not heard:
        whose = "" if soldier is None else f" of {soldier!r}"
        raise RecordingError(f"{recording}: no steps of feet{whose}: nothing to smooth")
    walks = [
        _walk(recording, identity, envelopes, config)
        for identity, envelopes in sorted(heard.items(), key=str)
    ]
    return [walk for walk in walks if walk is not None]


def _by_soldier(recording: Path, soldier: str | None) -> dict[Identity, list[Envelope]]:
    heard: dict[Identity, list[Envelope]] = defaultdict(list)
    walked: set[Identity] = set()
    for _, envelope in read_envelopes(recording):
        address = envelope.address
        if address.subject in SUBJECTS and soldier in (None, address.soldier):
            identity = Identity(address.realm, address.unit, address.soldier)
            heard[identity].append(envelope)
            walked |= {identity} if address.subject == "foot_step" else set()
    return {identity: envelopes for identity, envelopes in heard.items() if identity in walked}


def _walk(recording: Path, identity: Identity, envelopes: Sequence[Envelope], config: Path | None) -> Walk:
    settings, origin = _settings(recording, envelopes, config)
    core = FusionCore(settings, identity, origin, patient=True)
    smoother = Smoother(core.estimator.boots)
    for envelope in envelopes:
        core.handle(envelope)
    core.close()
    if not core.estimator.placed:
        raise RecordingError(
            f"{recording}: {identity.soldier} was never placed (no start, fix or satellites long enough); "
            "give --config with [fusion.start]"
        )
    track = body_track(smoother.smoothed(), settings.rate_hz)
    positions = () if track is None else tuple(_positions(track, Publisher(origin, settings.floor_height_m)))
    return Walk(identity, positions)


def _settings(
    recording: Path, envelopes: Sequence[Envelope], config: Path | None
) -> tuple[FusionConfig, Origin]:
    if config is not None:
        computer = load_computer(config)
        return computer.section("fusion", FusionConfig), computer.realm.origin
    for envelope in envelopes:
        fix = envelope.message
        if isinstance(fix, GnssFix | Fix) and fix.latitude_deg is not None and fix.longitude_deg is not None:
            return FusionConfig(), Origin(fix.latitude_deg, fix.longitude_deg, fix.height_m or 0.0)
    raise RecordingError(
        f"{recording}: no satellites and no fix tell where it was; give --config with [fusion.start]"
    )


def _positions(track: FootTrack, publisher: Publisher) -> Iterator[Position]:
    velocity = (
        np.gradient(track.position_m, track.time_s, axis=0)
        if len(track.time_s) > 1
        else track.position_m * 0.0
    )
    for time_s, point, covariance, speed in zip(
        track.time_s, track.position_m, track.covariance_m2, velocity, strict=True
    ):
        yield publisher.position(
            round(time_s * _NS_PER_S),
            Estimate(
                mode="boots",
                enu=(float(point[0]), float(point[1]), float(point[2])),
                covariance=covariance,
                velocity=(float(speed[0]), float(speed[1]), float(speed[2])),
                speed_m_s=float(np.hypot(speed[0], speed[1])),
                sources=(SOURCE,),
            ),
        )


def _sigma_m(position: Position) -> float:
    ee, en, _, nn, _, _ = position.covariance_m2
    return horizontal_sigma_m(np.array([[ee, en], [en, nn]]))
