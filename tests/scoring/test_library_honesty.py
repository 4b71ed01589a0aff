"""Shares inside the ellipse, long gaps, and squads in lockstep: the figures of fusion's page, by hand."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from bootprint.clock import NS_PER_S
from bootprint.messages import Position, Range
from fusion.config import FusionConfig, StartConfig
from proving_ground.evaluation.fusion.cooperation import Seat, SquadPlay
from proving_ground.evaluation.fusion.library_honesty import honesty, table
from proving_ground.evaluation.fusion.lines import Heard
from proving_ground.evaluation.fusion.long_gap import gap
from proving_ground.exercises.exercise import Exercise, Soldier
from proving_ground.exercises.squad import squad_of
from sensor_gateway.recordings.run import Run, Truth
from support.foot_walks import LEFT, NS, RIGHT, SimulatedWalk, envelope, in_time_order, straight
from support.foot_walks import T0 as WALK_NS


def soldier(name: str, number: int, truth: Truth) -> Soldier:
    return Soldier(
        name, number, name, Run(name, "dual", Path(), {}), truth, {"east_m": 0.0, "north_m": 0.0}, True
    )


def heard_on(truth: Truth) -> Heard:
    exercise = squad_of((soldier("a1", 1, truth),), "straight")
    one = exercise.soldiers[0]
    return Heard(exercise, one, exercise.identity("a1"), exercise.origin, FusionConfig(), ())


def told(heard: Heard, time_s: float, east_m: float, north_m: float, variance_m2: float = 1.0) -> Position:
    return Position(
        time_ns=heard.begins_ns + round(time_s * NS_PER_S),
        mode="boots",
        latitude_deg=0.0,
        longitude_deg=0.0,
        height_m=0.0,
        east_m=east_m,
        north_m=north_m,
        up_m=0.0,
        covariance_m2=(variance_m2, 0.0, 0.0, variance_m2, 0.0, 1.0),
    )


def walked(duration_s: float) -> Truth:
    """East at 1 m/s, after standing for a tenth of the time."""
    return Truth(
        np.array([0.0, 0.1 * duration_s, duration_s]),
        np.array([[0.0, 0, 0], [0, 0, 0], [0.9 * duration_s, 0, 0]]),
    )


def test_drawn_errors_are_inside_as_often_as_their_covariance_says() -> None:
    rng, heard = np.random.default_rng(6), heard_on(walked(4000.0))
    times = np.arange(1.0, 3999.0)
    east = np.maximum(0.0, times - 400.0)
    miss = rng.normal(size=(len(times), 2))
    positions = [told(heard, t, e + m[0], m[1]) for t, e, m in zip(times, east, miss, strict=True)]
    fair = honesty(heard, positions)
    assert 100.0 * fair.inside.mean() == pytest.approx(95.0, abs=1.5)
    assert fair.squared.mean() == pytest.approx(2.0, rel=0.06)
    bold = honesty(
        heard, [msgspec.structs.replace(p, covariance_m2=(0.25, 0, 0, 0.25, 0, 1.0)) for p in positions]
    )
    assert 100.0 * bold.inside.mean() == pytest.approx(52.7, abs=3.0)  # 1 − exp(−5.99/8)


def test_soldiers_count_alike_in_the_table() -> None:
    heard = heard_on(walked(100.0))
    good = honesty(heard, [told(heard, t, max(0.0, t - 10.0), 0.0) for t in range(1, 99)])
    bad = honesty(heard, [told(heard, t, max(0.0, t - 10.0), 9.0) for t in range(1, 20)])
    last = table([good, bad])[-1]
    assert last.startswith("| all | 2 | 4.5 | 50.0 |")


def test_the_gap_counts_its_last_minute_of_the_way_in_it() -> None:
    truth = Truth(np.array([0.0, 1320.0]), np.array([[0.0, 0, 0], [1320.0, 0, 0]]))
    heard = heard_on(truth)
    found = gap(
        heard, [told(heard, t, t, 6.0 if t == 1290 else 50.0 if t == 600 else 0.0) for t in range(100, 1321)]
    )
    assert found.walked_m == pytest.approx(1200.0)
    assert found.error_pct == pytest.approx(0.5)


def test_a_squad_in_lockstep_hears_of_each_other_over_the_radio() -> None:
    """One knows the start, the other is 8 m off and unsure; they walk side by side and range.

    40 m apart: within 8 m of doubt a range bends so much at 10 m that it would hardly be a line.
    """
    walk = SimulatedWalk(straight(0.0), 25.0)
    times = np.arange(0.0, 27.0, 0.2)
    way = np.array([[*walk.body(LEFT, RIGHT, time_s=t), 0.0] for t in times])
    ways = [way + np.array([0.0, by, 0.0]) for by in (0.0, 40.0)]
    exercise = squad_of(
        tuple(soldier(f"a{n + 1}", n + 1, Truth(times, way)) for n, way in enumerate(ways)), "two"
    )
    starts = (
        StartConfig(east_m=0.0, north_m=0.0, sigma_m=0.2, azimuth_deg=90.0),
        StartConfig(east_m=0.0, north_m=48.0, sigma_m=8.0, azimuth_deg=90.0),
    )
    seats = [seat(exercise, walk, number, start) for number, start in enumerate(starts)]
    positions = SquadPlay(seats).run()
    assert set(Counter(positions)) == {"a1", "a2"}
    assert positions["a2"][-1].north_m == pytest.approx(40.0, abs=2.0)
    deaf = [replace(one, hears=lambda each: each.address.subject != "range") for one in seats]
    assert SquadPlay(deaf).run()["a2"][-1].north_m == pytest.approx(48.0, abs=0.5)


def seat(exercise: Exercise, walk: SimulatedWalk, number: int, start: StartConfig) -> Seat:
    """A soldier who hears the walk's boots and, once a second, how far the other one is."""
    by_ns = exercise.begins_ns - WALK_NS
    ranges = [
        envelope(
            "range",
            "uwb",
            Range(time_ns=WALK_NS + s * NS, sequence=s, peer=f"a{2 - number}", distance_m=40.0),
        )
        for s in range(1, 25)
    ]
    heard = []
    for one in in_time_order(walk.messages(LEFT), walk.messages(RIGHT), ranges):
        at_ns = one.message.time_ns + by_ns
        changes = {"time_ns": at_ns}
        if hasattr(one.message, "start_time_ns"):
            changes["start_time_ns"] = one.message.start_time_ns + by_ns
        heard.append((at_ns, replace(one, message=msgspec.structs.replace(one.message, **changes))))
    who = exercise.soldiers[number]
    config = FusionConfig(gnss_sources=(), start=start)
    return Seat(
        Heard(exercise, who, exercise.identity(who.id), exercise.origin, config, tuple(heard)), config
    )
