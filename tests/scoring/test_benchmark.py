"""`bootprint benchmark foot`: it measures, judges by its limits, and its textbook filter is a working one.

Speed itself is asserted by the command (``--check``), never here.
"""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from bootprint.cli import main
from bootprint.errors import BootprintError
from proving_ground.evaluation.foot.textbook import (
    GRAVITY_M_S2,
    TextbookFilter,
    TextbookSettings,
    levelled,
    shoe_stances,
    skew,
    textbook_track,
    turned,
)
from proving_ground.performance import commands, foot_benchmark, fresh_engine, limits
from proving_ground.performance.cores import one_core
from proving_ground.performance.foot_benchmark import LIMITS, FootFigures, measure_process, walk_of
from support.walking_foot import REST_S, STANCE_S, SWING_S, walking_foot, write_run_folder

GOOD = FootFigures(1000, 12, 1.0, 0.5, 50.0, 100.0, 0.5, 100.0)
SETTINGS = TextbookSettings()
CORES = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()


def test_the_textbook_filter_walks_a_known_way() -> None:
    """Four legs of five strides, each after a quarter turn: back where it began."""
    foot = walking_foot(strides=20)
    track = textbook_track(foot.time_s, foot.imu[:, :3], foot.imu[:, 3:])
    error = np.linalg.norm(track - foot.position_m, axis=1)
    assert np.ptp(foot.position_m[:, 0]) > 6.0
    assert error.max() < 0.15


def test_the_textbook_detector_finds_rest_and_swing() -> None:
    foot = walking_foot(strides=5)
    still = shoe_stances(foot.imu[:, :3], foot.imu[:, 3:], SETTINGS)
    since = foot.time_s - REST_S
    into = np.mod(since, STANCE_S + SWING_S)
    swing = (since > 0) & (since < 5 * (STANCE_S + SWING_S)) & (into > 0.1) & (into < SWING_S - 0.1)
    assert still[foot.time_s < REST_S - 0.1].all()
    assert not still[swing].any()
    assert np.flatnonzero(np.diff(still.astype(int)) == 1).size == 5


def test_the_textbook_propagates_its_error_as_its_mechanisation_does() -> None:
    """F·δx is the difference between two mechanisations that start δx apart."""
    rng = np.random.default_rng(5)
    attitude = levelled(np.array([0.5, -1.0, 9.7]))
    accel, gyro, dt = np.array([3.0, -2.0, 12.0]), np.array([0.4, -0.8, 0.2]), 0.005
    error = rng.normal(size=9) * 1e-5
    filters = [TextbookFilter(attitude, SETTINGS) for _ in range(2)]
    one, other = filters
    other.position, other.velocity = error[0:3].copy(), error[3:6].copy()
    other.attitude = turned(attitude, attitude.T @ error[6:9])
    one.P = np.zeros((9, 9))
    one.Q = np.zeros((6, 6))
    one.P = np.outer(error, error)
    for each in filters:
        each.predict(accel, gyro, dt)
    turn = other.attitude @ one.attitude.T
    grown = np.concatenate(
        [
            other.position - one.position,
            other.velocity - one.velocity,
            [turn[2, 1], turn[0, 2], turn[1, 0]],
        ]
    )
    np.testing.assert_allclose(one.P, np.outer(grown, grown), atol=2e-13)


def test_the_textbook_update_stops_the_foot_and_shrinks_its_doubt() -> None:
    ins = TextbookFilter(np.eye(3), SETTINGS)
    ins.P = np.diag([1e-2] * 9)
    ins.velocity = np.array([0.3, -0.2, 0.1])
    ins.zero_velocity()
    assert np.linalg.norm(ins.velocity) < 0.01 * np.linalg.norm([0.3, -0.2, 0.1])
    assert np.diag(ins.P)[3:6] == pytest.approx(1.0 / (1.0 / 1e-2 + 1.0 / 1e-4), rel=1e-6)


def test_levelling_and_turning() -> None:
    force = np.array([1.0, -2.0, 9.0])
    np.testing.assert_allclose(levelled(force) @ force, [0.0, 0.0, np.linalg.norm(force)], atol=1e-12)
    np.testing.assert_allclose(
        turned(np.eye(3), np.array([0.0, 0.0, np.pi / 2])) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12
    )
    np.testing.assert_array_equal(skew(np.array([1.0, 2.0, 3.0])) @ [4.0, 5.0, 6.0], [-3.0, 6.0, -3.0])
    assert pytest.approx(9.8, abs=0.01) == GRAVITY_M_S2


def bootprint(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["bootprint", "benchmark", "foot", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


@pytest.fixture
def short_walk(tmp_path: Path) -> Path:
    return write_run_folder(tmp_path / "walk", {"right_foot": walking_foot(strides=2)})


def test_the_command_measures_a_walk_and_a_fresh_engine(
    short_walk: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    assert bootprint(monkeypatch, short_walk, "--turns", 1, "--json", "-") == 0
    figures: dict[str, Any] = json.loads(capfd.readouterr().out)
    assert list(figures) == list(FootFigures.__dataclass_fields__)
    assert figures["samples"] == len(walking_foot(strides=2).time_s)
    assert all(value > 0 for value in figures.values())
    assert figures["times_textbook"] == pytest.approx(figures["us_textbook"] / figures["us_one_pass"])
    assert 20.0 < figures["resident_mb"] < 120.0


def run_with(monkeypatch: pytest.MonkeyPatch, figures: FootFigures, *arguments: str) -> tuple[int, str]:
    """The command where the measurement gives these figures."""
    monkeypatch.setattr(foot_benchmark, "measure", lambda *_: figures)
    monkeypatch.setattr(foot_benchmark, "walk_of", lambda _: None)
    app = typer.Typer()
    commands.register(app)
    result = CliRunner().invoke(app, ["benchmark", "foot", *arguments], env={"COLUMNS": "200"})
    return result.exit_code, result.output


@pytest.mark.parametrize("limit", LIMITS, ids=lambda limit: limit.figure)
def test_check_fails_on_each_missed_limit(limit: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    worse = limit.bound * (0.99 if limit.at_least else 1.01)
    bad = replace(GOOD, **{limit.figure: worse})
    assert run_with(monkeypatch, bad, "--check")[0] == limits.MISSED
    assert run_with(monkeypatch, bad)[0] == 0
    code, output = run_with(monkeypatch, GOOD, "--check")
    assert (code, output.count("holds"), output.count("missed")) == (0, len(LIMITS), 0)


def test_an_engine_that_dies_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fresh_engine, "RESULT", "something else")
    with pytest.raises(BootprintError, match="instead of 'something else'"):
        measure_process(walk_of_two_seconds())


def walk_of_two_seconds() -> Any:
    imu = walk_of(None)
    few = slice(0, 400)
    return replace(
        imu, time_s=imu.time_s[few], accel_m_s2=imu.accel_m_s2[few], gyro_rad_s=imu.gyro_rad_s[few]
    )


@pytest.mark.skipif(not CORES, reason="no say in cores here")
def test_one_core_is_given_back() -> None:
    with one_core():
        assert len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == CORES
