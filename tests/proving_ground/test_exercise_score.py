"""Figures of an exercise against values derived by hand."""

import math
from pathlib import Path

import numpy as np
import pytest

from bootprint.clock import NS_PER_S
from bootprint.geodesy import LocalFrame
from bootprint.messages import LinkReport, Position, Track
from proving_ground.exercises.exercise import ORIGIN, Soldier
from proving_ground.exercises.score import compare, link_row, picture_row, sample_picture, soldier_row
from sensor_gateway.recordings.run import Run, Truth

START_NS = 1_000 * NS_PER_S
FRAME = LocalFrame(ORIGIN)


def soldier(simulated: bool, truth_m: np.ndarray) -> Soldier:
    truth = Truth(np.arange(len(truth_m), dtype=float), truth_m)
    run = Run("walk", "dual", Path("walk"), {}, {"body": truth})
    return Soldier("a1", 1, "Adler", run, truth, {}, simulated)


def position(
    time_s: float, east: float, north: float, mode: str = "boots", variance: float = 1.0, up: float = 0.0
) -> Position:
    latitude, longitude, height = FRAME.to_geodetic(east, north, up)
    return Position(
        time_ns=START_NS + round(time_s * NS_PER_S),
        mode=mode,  # type: ignore[arg-type]
        latitude_deg=latitude,
        longitude_deg=longitude,
        height_m=height,
        east_m=east,
        north_m=north,
        up_m=up,
        covariance_m2=(variance, 0.0, 0.0, variance, 0.0, variance),
        floor=round(up / 3.0),
    )


def track(time_s: float, east: float, north: float, velocity: tuple[float, float]) -> Track:
    latitude, longitude, height = FRAME.to_geodetic(east, north, 0.0)
    return Track(
        time_ns=START_NS + round(time_s * NS_PER_S),
        soldier="a1",
        number=1,
        state="fresh",
        latitude_deg=latitude,
        longitude_deg=longitude,
        height_m=height,
        accuracy_m=1.0,
        east_velocity_m_s=velocity[0],
        north_velocity_m_s=velocity[1],
    )


WALK = np.column_stack([np.arange(11.0), np.zeros(11), np.zeros(11)])  # east at 1 m/s for 10 s


def test_a_simulated_walk_is_scored_where_it_stands() -> None:
    one = soldier(True, WALK)
    row = soldier_row(one, compare(one, [position(t, t + 3.0, 4.0) for t in range(11)], START_NS))
    assert row["distance_m"] == pytest.approx(10.0)
    for name in ("position_error_p50_m", "position_error_p95_m", "final_error_m"):
        assert row[name] == pytest.approx(5.0)
    assert row["height_error_p95_m"] == pytest.approx(0.0)
    assert row["floor_correct_pct"] == 100.0


def test_a_recorded_walk_is_fitted_first() -> None:
    turned = [position(t, 7.0, 2.0 - t) for t in range(11)]  # the same walk, turned to the south and shifted
    one = soldier(False, WALK)
    row = soldier_row(one, compare(one, turned, START_NS))
    assert row["position_error_p95_m"] == pytest.approx(0.0, abs=1e-6)


def test_errors_beyond_the_ellipse_are_outside_it() -> None:
    one = soldier(True, WALK)
    # 2 m off for the first half, 3 m off for the second: the 95 % radius at unit variance is 2.45 m.
    positions = [position(t, float(t), 2.0 if t < 5 else 3.0) for t in range(11)]
    row = soldier_row(one, compare(one, positions, START_NS))
    assert row["inside_95_pct"] == pytest.approx(100.0 * 5 / 11)


def test_a_wrong_floor_counts_but_stairs_do_not() -> None:
    truth = WALK.copy()
    truth[:, 2] = [0, 0, 0, 0, 1.5, 3, 3, 3, 3, 3, 3]
    one = soldier(True, truth)
    row = soldier_row(one, compare(one, [position(t, float(t), 0.0) for t in range(11)], START_NS))
    assert row["floor_correct_pct"] == pytest.approx(40.0)


def test_unplaced_positions_do_not_count_and_nothing_is_null() -> None:
    one = soldier(True, WALK)
    row = soldier_row(one, compare(one, [position(t, 0.0, 0.0, "unplaced") for t in range(11)], START_NS))
    assert row["position_error_p50_m"] is None
    assert row["inside_95_pct"] is None


def test_a_picture_is_what_the_receiver_predicts() -> None:
    one = soldier(True, WALK)
    compared = compare(one, [position(t, float(t), 0.0) for t in range(11)], START_NS)
    assert compared is not None
    # One report of t = 1, heard at t = 2, that claims 0.5 m/s: at t the receiver believes 1 + 0.5 (t - 1).
    heard = [(START_NS + 2 * NS_PER_S, track(1.0, 1.0, 0.0, (0.5, 0.0)))]
    picture = sample_picture(heard, [compared], START_NS, FRAME)
    seconds = np.arange(2.0, 10.0)
    np.testing.assert_allclose(picture.age_s, seconds - 1.0)
    np.testing.assert_allclose(picture.added_m, 0.5 * (seconds - 1.0), atol=1e-6)
    np.testing.assert_allclose(picture.against_truth_m, picture.added_m, atol=1e-6)
    row = picture_row("cp", picture)
    assert row["age_p95_s"] == pytest.approx(np.percentile(seconds - 1.0, 95))


def test_a_picture_never_heard_is_null() -> None:
    row = picture_row("cp", sample_picture([], [], START_NS, FRAME))
    assert row["added_error_p95_m"] is None
    assert row["samples"] == 0


def test_link_rates_are_bytes_over_the_whole_exercise() -> None:
    report = LinkReport(
        time_ns=0,
        link="squad",
        budget_bits_per_s=600.0,
        bits_per_s=1.0,
        frames_sent=5,
        frames_received=7,
        frames_rejected=0,
        frames_lost=2,
        bytes_sent=300,
        bytes_received=0,
    )
    row = link_row("a1", report, 60.0)
    assert row["bits_per_s"] == pytest.approx(40.0)
    assert row["link"] == "a1/squad"
    assert math.isclose(float(row["lost"] or 0), 2)
