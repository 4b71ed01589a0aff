"""The smoother against the batch solution, on drifting feet, across placing and joining; and what it writes."""

import csv
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from typer.testing import CliRunner

from bootprint.bus import Envelope
from bootprint.cli import build_app
from bootprint.errors import RecordingError
from bootprint.geodesy import LocalFrame
from bootprint.messages import Fix, FootStep, upper_triangle
from bootprint.recording import Recorder, read_envelopes
from fusion.boots import Boots
from fusion.config import FeetConfig, FusionConfig
from fusion.engine import FusionCore
from fusion.filter import Measurement, StateFilter
from fusion.smoother import Moment, Smoother, body_track, smooth
from fusion.state import Layout
from fusion.tape import Tape
from proving_ground.evaluation.smoothed import smoothed_walks
from support.foot_walks import (
    EAST,
    LEFT,
    NS,
    ORIGIN,
    RIGHT,
    T0,
    WHO,
    SimulatedWalk,
    envelope,
    in_time_order,
    rectangle,
    straight,
)

Way = Callable[[float], tuple[float, float, float]]
FRAME = LocalFrame(ORIGIN)


def test_it_is_the_least_squares_solution_of_a_linear_walk() -> None:
    """A foot goes along a line, seen at two places: all its places at once by weighted least squares."""
    layout = Layout.of(("left_foot",))
    state_filter = StateFilter(layout, (np.zeros(layout.size), np.diag([1.0] + [0.0] * (layout.size - 1))))
    state_filter.tape = Tape()
    block = layout.blocks[0]
    variances = [0.04, 0.01, 0.09, 0.02]
    seen = {2: (2.5, 0.05), 4: (3.7, 0.03)}
    rows, values, weights = [np.eye(5)[0]], [0.0], [1.0]
    for count, variance in enumerate(variances, start=1):
        step = FootStep(
            time_ns=T0 + count * NS,
            start_time_ns=T0 + (count - 1) * NS,
            displacement_m=(1.0, 0.0, 0.0),
            heading_change_rad=0.0,
            covariance=upper_triangle(np.zeros((4, 4))),
        )
        state_filter.propagate(block, step, np.diag([variance, 0.0, 0.0, 0.0]))
        rows.append(np.eye(5)[count] - np.eye(5)[count - 1])
        values.append(1.0)
        weights.append(1.0 / variance)
        if count in seen:
            place, noise = seen[count]
            jacobian = np.zeros((1, layout.size))
            jacobian[0, 0] = 1.0
            residual = np.array([place - state_filter.state[0]])
            state_filter.update(Measurement("test", residual, jacobian, np.array([[noise]])))
            rows.append(np.eye(5)[count])
            values.append(place)
            weights.append(1.0 / noise)
    design, weight = np.array(rows), np.diag(weights)
    covariance = np.linalg.inv(design.T @ weight @ design)
    expected = covariance @ design.T @ weight @ np.array(values)
    moments = smooth(state_filter.tape.changes, Moment(state_filter.state, state_filter.covariance), layout)
    np.testing.assert_allclose([moment.state[0] for moment in moments], expected, atol=1e-9)
    np.testing.assert_allclose(
        [moment.covariance[0, 0] for moment in moments], np.diag(covariance), atol=1e-9
    )


def walked(path: Way, drift_deg_per_min: float) -> tuple[SimulatedWalk, FusionCore, Smoother]:
    """A dual walk whose feet drift, placed by its start, with a person's word for the place at its end."""
    walk = SimulatedWalk(path, 180.0)
    drift = math.radians(drift_deg_per_min) / 60
    feet = [replace(foot, drift_rad_s=drift) for foot in (LEFT, RIGHT)]
    boots = FeetConfig(heading_walk_rad_sqrt_s=0.007)  # 3 deg/min at a minute
    core = FusionCore(FusionConfig(gnss_sources=(), start=EAST, boots=boots), WHO, ORIGIN, patient=True)
    smoother = Smoother(core.estimator.boots)
    for one in in_time_order(*(walk.messages(foot) for foot in feet), [word(walk, 179.0)]):
        core.handle(one)
    core.close()
    return walk, core, smoother


def word(walk: SimulatedWalk, time_s: float) -> Envelope:
    east, north = walk.body(LEFT, RIGHT, time_s=time_s)
    latitude, longitude, _ = FRAME.to_geodetic(east, north, 0.0)
    stamp = T0 + round(time_s * NS)
    return envelope(
        "fix",
        "user",
        Fix(time_ns=stamp, sequence=0, latitude_deg=latitude, longitude_deg=longitude, accuracy_m=0.3),
    )


def errors_m(walk: SimulatedWalk, track_time_s: np.ndarray, position_m: np.ndarray) -> np.ndarray:
    truth = [walk.body(LEFT, RIGHT, time_s=time_s - T0 / NS) for time_s in track_time_s]
    return np.linalg.norm(position_m[:, :2] - np.array(truth), axis=1)


def test_what_is_known_at_the_end_mends_the_middle() -> None:
    walk, _, smoother = walked(straight(0.0), 3.0)
    smoothed = body_track(smoother.smoothed(), 5.0)
    causal = body_track(smoother.causal(), 5.0)
    assert smoothed is not None
    assert causal is not None
    half = smoothed.time_s - T0 / NS > 90.0
    before = errors_m(walk, causal.time_s[half], causal.position_m[half])
    after = errors_m(walk, smoothed.time_s[half], smoothed.position_m[half])
    assert np.sqrt(np.mean(after**2)) < 0.4 * np.sqrt(np.mean(before**2))


def test_the_whole_walk_is_in_one_frame_from_its_first_step() -> None:
    """Before the placing and before the second foot joined, too."""
    walk, core, smoother = walked(rectangle(30, 20), 0.0)
    assert core.counters["feet_joined"] == 1
    tracks = smoother.smoothed()
    for foot in (LEFT, RIGHT):
        track = tracks[foot.place]
        assert track.time_s[0] - T0 / NS < 2.0
        truth = [walk.foot_at(foot, time_s - T0 / NS) for time_s in track.time_s]
        assert np.linalg.norm(track.position_m[:, :2] - np.array(truth), axis=1).max() < 0.6


def test_a_foot_without_any_step_has_no_track() -> None:
    smoother = Smoother(Boots(FusionConfig(), Counter()))
    assert smoother.smoothed() == {}
    assert body_track({}, 5.0) is None


def recorded(folder: Path) -> Path:
    walk = SimulatedWalk(rectangle(30, 20), 60.0)
    path = folder / "walk.mcap"
    words = [word(walk, time_s) for time_s in (0.5, 20.0, 50.0)]
    with Recorder(path) as recorder:
        for one in in_time_order(walk.messages(LEFT), walk.messages(RIGHT), words):
            recorder.write(one)
    return path


@pytest.mark.parametrize("suffix", ["csv", "gpx", "mcap"])
def test_smooth_writes_a_track_that_others_can_read(tmp_path: Path, suffix: str) -> None:
    out = tmp_path / f"out.{suffix}"
    result = CliRunner().invoke(build_app(), ["smooth", str(recorded(tmp_path)), "-o", str(out)])
    assert result.exit_code == 0, result.output
    if suffix == "csv":
        places = [float(row["latitude_deg"]) for row in csv.DictReader(out.read_text().splitlines())]
    elif suffix == "gpx":
        points = ElementTree.parse(out).iter("{http://www.topografix.com/GPX/1/1}trkpt")
        places = [float(point.attrib["lat"]) for point in points]
    else:
        places = [one.message.latitude_deg for _, one in read_envelopes(out)]  # type: ignore[attr-defined]
    assert len(places) > 250
    assert places[0] == pytest.approx(58.4, abs=2e-5)  # the walk begins at the origin


def test_a_recording_that_tells_no_place_is_refused_in_words(tmp_path: Path) -> None:
    path = tmp_path / "walk.mcap"
    with Recorder(path) as recorder:
        for one in SimulatedWalk(rectangle(30, 20), 20.0).messages(LEFT):
            recorder.write(one)
    with pytest.raises(RecordingError, match="--config"):
        smoothed_walks(path, None, None)
    with pytest.raises(RecordingError, match="'b9'"):
        smoothed_walks(path, None, "b9")
