"""Receivers that are dragged away are found out and undone; honest ones are not accused (METHODS D9)."""

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import convert
from bootprint.geodesy import LocalFrame
from bootprint.messages import FootPose, GnssFix
from bootprint.topics import Identity
from fusion.config import FusionConfig, TrustConfig
from fusion.engine import FusionCore
from fusion.trust import Receiver
from pdr_engine.config import PdrConfig
from proving_ground.evaluation.fusion.dual_walks import ORIGIN as WALKS_ORIGIN
from proving_ground.evaluation.fusion.dual_walks import UNIT, dual_walk
from proving_ground.evaluation.fusion.spoofing import Trial, play
from proving_ground.inprocess import play_run, positions_of
from support.foot_walks import (
    EAST,
    LEFT,
    ORIGIN,
    RIGHT,
    T0,
    WHO,
    SimulatedWalk,
    envelope,
    in_time_order,
    rectangle,
)


@pytest.mark.parametrize("seed", [3, 11])
def test_a_slow_drag_is_noticed_and_undone(seed: int) -> None:
    outcome = play(Trial(seed, duration_s=300.0, drag_m_s=0.5, from_s=180.0))
    assert outcome.false_alarms == 0
    assert outcome.detected_after_s < 35.0
    assert outcome.worst_after_m < 15.0  # the spoofer pulls by 60 m in this time
    assert outcome.error_m[-1] < 10.0


def test_an_honest_receiver_is_believed_to_the_end() -> None:
    outcome = play(Trial(5, duration_s=300.0, drag_m_s=0.0, from_s=math.inf))
    assert outcome.alarms_s == ()
    assert outcome.inside.mean() > 0.9


def test_a_runner_s_boots_accuse_no_honest_receiver() -> None:
    """Gyros of 350 °/s cut off every stride's peak, so that the boots turn; the satellites are right."""
    unit = replace(UNIT, gyro=replace(UNIT.gyro, limit=math.radians(350.0)))
    way = [(0.0, 0.0), (0.0, 150.0), (100.0, 150.0)]
    run = dual_walk(way, seed=4, gait="run", unit=unit, satellites=True).run
    fusion = convert({"start": {"east_m": 0.0, "north_m": 0.0, "azimuth_deg": 0.0}}, FusionConfig, "test")
    pdr = convert({}, PdrConfig, "test")
    identity = Identity("bp", "alpha", "a1")
    positions = list(positions_of(play_run(run, identity, WALKS_ORIGIN, pdr, fusion, start_ns=0)))
    assert not any("spoofed" in position.rejections.values() for position in positions)
    last, true = positions[-1], run.truth["body"].position_m[-1]
    assert math.hypot(last.east_m - true[0], last.north_m - true[1]) < 10.0


def test_scatter_is_about_a_line_so_that_a_drag_is_none() -> None:
    """Fixes on a line have no scatter however steep it is; ±1 m beside it alternately has one metre."""
    steady, shaky = Receiver(), Receiver()
    for second in range(20):
        miss = np.array([0.5 * second, -0.2 * second])
        beside = np.array([1.0, 1.0]) * (1.0 if second % 2 else -1.0)
        still = steady.scatter_m(miss, second * NS_PER_S, 30.0)
        shaken = shaky.scatter_m(miss + beside, second * NS_PER_S, 30.0)
    assert still == pytest.approx(0.0, abs=1e-9)
    assert shaken == pytest.approx(1.0, abs=0.1)


def test_one_outlier_is_no_stray_and_a_lasting_one_is() -> None:
    receiver = Receiver()
    found = [receiver.strays(second == 2, second * NS_PER_S, 4.0) for second in range(6)]
    assert not any(found)
    assert any(receiver.strays(True, second * NS_PER_S, 4.0) for second in range(6, 12))


def test_agreement_has_to_last_and_a_break_begins_anew() -> None:
    receiver = Receiver()
    agreeing = [True] * 8 + [False] + [True] * 12
    found = [receiver.agrees(one, second * NS_PER_S, 10.0) for second, one in enumerate(agreeing, start=1)]
    assert found.index(True) == 8 + 1 + 10


def test_shadows_of_a_foot_that_went_astray_accuse_nobody() -> None:
    """At 30 s the right foot's poses fly off; satellites are honest all the time."""
    walk = SimulatedWalk(rectangle(40.0, 25.0), 40.0)
    right = [_flown_off(one) for one in walk.messages(RIGHT)]
    fixes = [_fix(walk, second) for second in range(1, 40)]
    trust = TrustConfig(shadow_interval_s=10.0)
    core = FusionCore(FusionConfig(start=EAST, trust=trust), WHO, ORIGIN)
    dropped_ns = None
    for each in in_time_order(walk.messages(LEFT), right, fixes):
        list(core.handle(each))
        if dropped_ns is None and core.counters["feet_dropped"]:
            dropped_ns = each.message.time_ns
            assert list(core.estimator._aid.shadows) == []
    assert dropped_ns is not None
    assert core.counters["gnss_distrusted"] == 0


def _flown_off(told: Envelope) -> Envelope:
    if not isinstance(told.message, FootPose) or not 30 <= (told.message.time_ns - T0) / NS_PER_S < 32:
        return told
    return replace(told, message=msgspec.structs.replace(told.message, displacement_m=(10.0, 0.0, 0.0)))


def _fix(walk: SimulatedWalk, second: int) -> Envelope:
    east, north = walk.body(LEFT, RIGHT, time_s=float(second))
    latitude, longitude, _ = LocalFrame(ORIGIN).to_geodetic(east, north, 0.0)
    message = GnssFix(
        time_ns=T0 + second * NS_PER_S,
        sequence=second,
        fix_kind="3d",
        latitude_deg=latitude,
        longitude_deg=longitude,
        horizontal_accuracy_m=2.0,
    )
    return envelope("gnss", "gnss", message)
