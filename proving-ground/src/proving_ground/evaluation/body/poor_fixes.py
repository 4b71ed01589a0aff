"""Poor satellite fixes (METHODS C4): they must never make a track worse than dead reckoning alone.

phone-gps as it was recorded; and the walks of msindoor20, whose way-points are known, with fixes as that phone's:
its stated accuracies, errors as stated or several times as large, or fixes that state a good accuracy and lie.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from pdr_engine.body import BodySettings, BodyStepEstimate
from pdr_engine.body.pieces import FloatArray
from proving_ground.evaluation.alignment import Track, fit_rigid, interpolated
from proving_ground.evaluation.body.pns_gps import filtered
from proving_ground.evaluation.body.recorded_run import BODY, BodyWalk, body_track, walk_body
from proving_ground.evaluation.scoring import score_track
from proving_ground.sensors.randomness import gauss_markov
from sensor_gateway.recordings.run import GnssSeries, Run, Truth

_ORIGIN = Origin(latitude_deg=47.0, longitude_deg=8.0)
_NS_PER_S = 1e9
_START_SIGMA_M = 2.0
_ALIKE_S = 30.0  # for which errors of fixes last
_WORSE_M = 0.1


@dataclass(frozen=True, slots=True)
class Receiver:
    """``stated_m`` of each fix (None: as phone-gps says, over and over), ``error`` in what is stated."""

    name: str
    stated_m: float | None
    error: float


RECEIVERS = (
    Receiver("as phone-gps", None, 1.0),
    Receiver("as phone-gps, errs three times as much", None, 3.0),
    Receiver("5 m, honest", 5.0, 1.0),
    Receiver("5 m, errs four times as much", 5.0, 4.0),
)


def pns_walk(run: Run, settings: BodySettings) -> tuple[BodyWalk, Track]:
    """The steps of a run without its fixes, and the track of C4's filter, which has them."""
    walk = walk_body(replace(run, gnss=None), settings)
    return walk, _pns_track(run, walk.steps)


def _pns_track(run: Run, steps: Sequence[BodyStepEstimate]) -> Track:
    track = body_track(steps, run.imus[BODY])
    fixes = _fixes(run.gnss) if run.gnss is not None else []
    if not fixes or not steps:
        return track
    times_s = np.array([steps[0].start_ns, *(step.time_ns for step in steps)]) / _NS_PER_S
    lengths, azimuths = (
        np.array([getattr(step, name) for step in steps]) for name in ("length_m", "track_azimuth_rad")
    )
    start = _first_place(fixes, track)
    places, _ = filtered(times_s, start, lengths, azimuths, fixes)
    return Track(times_s, np.column_stack([np.vstack([start, places]), np.full(len(times_s), np.nan)]))


def _fixes(gnss: GnssSeries) -> list[tuple[float, FloatArray, float, int | None]]:
    """Time, place east, north of the first (2,), stated accuracy."""
    known = np.flatnonzero(np.isfinite(gnss.lat_deg) & np.isfinite(gnss.lon_deg) & np.isfinite(gnss.h_acc_m))
    if not len(known):
        return []
    first = known[0]
    frame = LocalFrame(
        Origin(latitude_deg=float(gnss.lat_deg[first]), longitude_deg=float(gnss.lon_deg[first]))
    )
    return [
        (
            float(gnss.time_s[k]),
            np.array(frame.to_enu(float(gnss.lat_deg[k]), float(gnss.lon_deg[k]), 0.0)[:2]),
            float(gnss.h_acc_m[k]),
            int(gnss.satellites[k]) if np.isfinite(gnss.satellites[k]) else None,
        )
        for k in known.tolist()
    ]


def _first_place(fixes: Sequence[tuple[float, FloatArray, float, int | None]], track: Track) -> FloatArray:
    """Where the steps begin, by the best fix and what was walked until then."""
    at_s, place, _, _ = min(fixes, key=lambda fix: fix[2])
    return np.asarray(place - track.at(np.array([at_s]))[0, :2])


def with_fixes(run: Run, receiver: Receiver, like: GnssSeries, seed: int) -> Run:
    """A walk with truth, and fixes around it at the times of ``like``, in the frame of its own dead reckoning."""
    rng = np.random.default_rng(seed)
    truth, time_s = run.truth[BODY], like.time_s[like.time_s < run.duration_s]
    stated = (
        like.h_acc_m[: len(time_s)] if receiver.stated_m is None else np.full(len(time_s), receiver.stated_m)
    )
    alike = gauss_markov(len(time_s), float(np.median(np.diff(time_s))), 1.0, _ALIKE_S, rng, columns=2)
    place = _in_own_frame(run, truth, time_s) + receiver.error * stated[:, None] / np.sqrt(2.0) * alike
    frame = LocalFrame(_ORIGIN)
    geodetic = np.array([frame.to_geodetic(float(east), float(north), 0.0) for east, north in place])
    unknown = np.full(len(time_s), np.nan)
    gnss = GnssSeries(
        time_s, geodetic[:, 0], geodetic[:, 1], unknown, stated, unknown, unknown, unknown, unknown
    )
    return replace(run, gnss=gnss)


def _in_own_frame(run: Run, truth: Truth, time_s: FloatArray) -> FloatArray:
    """True places (n, 2) as seen in the frame of the steps' azimuths."""
    track = body_track(walk_body(run, BodySettings()).steps, run.imus[BODY])
    fit = fit_rigid(track.at(truth.time_s)[:, :2], truth.position_m[:, :2])
    places = interpolated(time_s, truth.time_s, truth.position_m[:, :2])
    return np.asarray((places - fit.offset_m) @ fit.rotation)


def phone_table(run: Run) -> str:
    """Markdown: phone-gps with and without its fixes, by the engine and by C4's filter."""
    assert run.gnss is not None
    alone = walk_body(replace(run, gnss=None), BodySettings()).steps
    heard = walk_body(run, BodySettings()).steps
    stated = run.gnss.h_acc_m[np.isfinite(run.gnss.h_acc_m)]
    filter_m = _apart(pns_walk(run, BodySettings())[1], body_track(alone, run.imus[BODY]))
    return (
        "| fixes | stated accuracy m | steps | walked m | engine with fixes apart from dead reckoning m, most "
        "| C4 filter apart m, most |\n|--:|---|--:|--:|--:|--:|\n"
        f"| {len(stated)} | {stated.min():.0f} to {stated.max():.0f} | {len(alone)} | {_walked_m(alone):.0f} "
        f"| {_apart(body_track(heard, run.imus[BODY]), body_track(alone, run.imus[BODY])):.2f} | {filter_m:.2f} |\n"
    )


def _walked_m(steps: Sequence[BodyStepEstimate]) -> float:
    return sum(step.length_m for step in steps)


def _apart(track: Track, other: Track) -> float:
    """The largest distance of two tracks that begin in one place."""
    begun = track.position_m[:, :2] - track.position_m[0, :2]
    apart = begun - (other.at(track.time_s)[:, :2] - other.at(track.time_s[:1])[:, :2])
    return float(np.linalg.norm(apart, axis=1).max())


def fixes_table(walks: Sequence[Run], phone: Run) -> str:
    """Markdown: the walks with each receiver's fixes against the same without."""
    assert phone.gnss is not None
    lines = [
        "| fixes | walks | dead reckoning alone: RMSE m, mean | worst | engine with fixes: mean | worst "
        "| walks worse | C4 filter: mean | worst | walks worse |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    alone = np.array(
        [_rmse(run, body_track(walk_body(run, BodySettings()).steps, run.imus[BODY])) for run in walks]
    )
    for receiver in RECEIVERS:
        fixed = [with_fixes(run, receiver, phone.gnss, seed) for seed, run in enumerate(walks)]
        engine = np.array(
            [_rmse(run, body_track(walk_body(run, BodySettings()).steps, run.imus[BODY])) for run in fixed]
        )
        pns = np.array([_rmse(run, pns_walk(run, BodySettings())[1]) for run in fixed])
        cells = " | ".join(
            f"{rmse.mean():.2f} | {rmse.max():.2f} | {int((rmse > alone + _WORSE_M).sum())}"
            for rmse in (engine, pns)
        )
        lines.append(f"| {receiver.name} | {len(walks)} | {alone.mean():.2f} | {alone.max():.2f} | {cells} |")
    return "\n".join(lines) + "\n"


def _rmse(run: Run, track: Track) -> float:
    """After the rigid fit."""
    return score_track(track, run.truth[BODY]).score.rmse_m or 0.0
