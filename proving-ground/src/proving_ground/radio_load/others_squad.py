"""Others' formats: every soldier's device speaks for itself by its rule, on the one link that all share.

What the rule asks for is offered to the radio as it is at its full rate. A format that asks for more than the
budget is also played over a link no faster than the budget: what then does not fit is queued and dropped.
"""

from collections import defaultdict
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from scipy.signal import lfilter

from bootprint.clock import NS_PER_S
from bootprint.geodesy import LocalFrame
from proving_ground.radio_load.budget_check import exceeds_budget
from proving_ground.radio_load.formats.format import Format, Moment, Place, Shown
from proving_ground.radio_load.load import BEGINS_NS, ORIGIN, SETTLE_S, Load, Outcome
from proving_ground.radio_load.picture_error import Errors, Seen
from proving_ground.radio_load.shared_link import SharedLink, air_bytes
from proving_ground.radio_load.squad_tracks import SquadTracks
from proving_ground.radio_load.telling import DELAY_S, PERIOD_S, FloatArray

_SMOOTHING_S: Final = 1.5  # as our own hubs smooth a velocity before they tell it
_FRAME: Final = LocalFrame(ORIGIN)


class Message(NamedTuple):
    """What a soldier's device says at ``at_s``; soldiers count from 0."""

    at_s: float
    soldier: int
    data: bytes


def play_format(how: Format, load: Load, tracks: SquadTracks) -> Outcome:
    """One of others' formats in one load test."""
    said = sorted(
        message for soldier in range(load.soldiers) for message in _said(how, load, tracks, soldier)
    )
    frames = [
        (BEGINS_NS + round(message.at_s * NS_PER_S), air_bytes(load.medium, message.data)) for message in said
    ]
    exceeded = exceeds_budget(frames, load.bitrate, BEGINS_NS)
    errors, dropped = _heard(how, load, tracks, said)
    squeezed = _heard(how, load, tracks, said, load.bitrate)[0] if exceeded else None
    return Outcome(
        errors,
        tracks.duration_s,
        frames,
        reports=len(said),
        dropped=dropped,
        budget_exceeded=exceeded,
        squeezed=squeezed,
    )


def _said(how: Format, load: Load, tracks: SquadTracks, soldier: int) -> Iterator[Message]:
    """What one soldier's device says."""
    rule = how.rule(load, soldier + 1)
    columns = (tracks.time_s, *tracks.place_m[soldier].T, *smoothed(tracks.velocity_m_s[soldier]).T)
    for moment in map(Moment, *(column.tolist() for column in columns)):
        if rule.due(moment):
            yield Message(moment.time_s + DELAY_S, soldier, how.encode(_place(moment, soldier + 1)))


def smoothed(velocity_m_s: FloatArray) -> FloatArray:
    """First-order low-pass of a velocity (T, 2) told every `PERIOD_S`."""
    keep = np.exp(-PERIOD_S / _SMOOTHING_S)
    start = keep * velocity_m_s[:1]
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], velocity_m_s, axis=0, zi=start)[0])


def _place(moment: Moment, number: int) -> Place:
    geodetic = _FRAME.to_geodetic(moment.east_m, moment.north_m, moment.up_m)
    time_ns = BEGINS_NS + round(moment.time_s * NS_PER_S)
    return Place(number, time_ns, *geodetic, moment.east_m_s, moment.north_m_s)


def _heard(
    how: Format,
    load: Load,
    tracks: SquadTracks,
    said: list[Message],
    rate_bits_per_s: float | None = None,
) -> tuple[Errors, int]:
    """The receivers' errors over the radio, or over one of this rate; how many messages did not get on it."""
    names = [f"s{index + 1}" for index in range(load.soldiers)]
    link = SharedLink(load, load.receivers, rate_bits_per_s)
    for message in said:
        link.send(names[message.soldier], message.soldier, message.data, message.at_s)
    seen: dict[tuple[str, int], Seen] = defaultdict(Seen)
    decoded: dict[bytes, Shown] = {}
    for heard in link.arrived(tracks.duration_s + SETTLE_S):
        shown = decoded.get(heard.message)
        if shown is None:
            shown = decoded[heard.message] = how.decode(heard.message)
        _see(seen[heard.member, heard.sender], shown, heard.at_s)
    errors = Errors()
    for receiver in load.receivers:
        for soldier in range(load.soldiers):
            errors.take(seen[receiver, soldier], tracks, soldier, how.moving)
    return errors, link.dropped


def _see(seen: Seen, shown: Shown, at_s: float) -> None:
    east_m, north_m, _ = _FRAME.to_enu(shown.latitude_deg, shown.longitude_deg, ORIGIN.height_m)
    stamp_s = at_s if shown.time_ns is None else (shown.time_ns - BEGINS_NS) / NS_PER_S
    seen.add(at_s, stamp_s, (east_m, north_m), (shown.east_m_s, shown.north_m_s))
