"""The person's step length from satellite fixes: learned from good ones, never led astray by bad ones."""

import math

import pytest

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from bootprint.messages import GnssFix, Pressure
from bootprint.topics import Identity
from pdr_engine.body.length.personal import MOST_LOG, PRIOR_SIGMA, PersonalScale
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore

SECOND_NS = 1_000_000_000


def walked(true_factor: float, accuracy_m: float = 2.0, seconds: int = 600) -> PersonalScale:
    """1.4 m/s east as satellites see it; the steps, headed north, are short by the factor until it is known."""
    scale = PersonalScale()
    for second in range(seconds):
        scale.fix(second * SECOND_NS, 1.4 * second, 0.0, accuracy_m)
        scale.walk(1.4 / true_factor * scale.factor, 0.0)
    return scale


@pytest.mark.parametrize("true_factor", [0.92, 1.0, 1.08])
def test_good_fixes_tell_the_factor_whatever_the_heading(true_factor: float) -> None:
    scale = walked(true_factor)
    assert scale.factor == pytest.approx(true_factor, rel=0.02)
    assert scale.sigma < 0.5 * PRIOR_SIGMA
    assert scale.stretches > 10


def test_one_stretch_by_hand() -> None:
    scale = PersonalScale()
    scale.fix(0, 0.0, 0.0, 2.0)
    scale.walk(57.0, 1.0)
    scale.fix(40 * SECOND_NS, 60.0, 0.0, 2.0)
    prior = PRIOR_SIGMA**2 + 0.003**2
    noise = 8.0 / 3600.0 + 0.02**2
    gain = prior / (prior + noise)
    assert scale.factor == pytest.approx(math.exp(gain * math.log(60.0 / 57.0)))
    assert scale.sigma == pytest.approx(math.sqrt(prior * (1.0 - gain)))


def test_bad_fixes_and_wild_distances_change_nothing() -> None:
    assert walked(1.2, accuracy_m=30.0).factor == 1.0
    wild = walked(2.0)
    assert (wild.factor, wild.stretches) == (1.0, 0)
    assert wild.refused > 5


def test_the_factor_stays_within_its_bounds() -> None:
    scale = walked(1.1, seconds=300)
    for k in range(60):
        drift = 1.1 * 1.03 ** (k + 1)
        scale.fix((400 + 40 * k) * SECOND_NS, 0.0, 0.0, 1.0)
        scale.walk(60.0 / drift * scale.factor, 0.0)
        scale.fix((430 + 40 * k) * SECOND_NS, 60.0, 0.0, 1.0)
    assert abs(math.log(scale.factor)) <= MOST_LOG + 1e-12


def test_the_engine_hears_fixes_and_pressure_for_the_body() -> None:
    me, frame = Identity("bp", "alpha", "a1"), LocalFrame(Origin(latitude_deg=59.0, longitude_deg=18.0))
    core = EngineCore(PdrConfig(places=("body",)), me)
    for second in range(5):
        latitude, longitude, height = frame.to_geodetic(1.4 * second, 0.0, 0.0)
        fix = GnssFix(
            time_ns=second * SECOND_NS,
            fix_kind="3d",
            latitude_deg=latitude,
            longitude_deg=longitude,
            height_m=height,
            horizontal_accuracy_m=3.0,
        )
        assert list(core.handle(Envelope(me.address("gnss", "body"), fix))) == []
    pressure = Pressure(time_ns=0, pressure_pa=101_325.0)
    assert list(core.handle(Envelope(me.address("pressure", "body"), pressure))) == []
    assert core.figures().counters["other_places"] == 0


def test_fixes_refine_the_weights_of_a_gait_and_leave_another_alone() -> None:
    """Steps of two gaits, whose features are +1 and -1; only the first are 6 % longer than told."""
    scale = PersonalScale(refinement=(0.0,))
    east = 0.0
    for second in range(1200):
        is_long = second // 60 % 2 == 0
        scale.fix(second * SECOND_NS, east, 0.0, 2.0)
        scale.meet([1.0 if is_long else -1.0])
        scale.walk(1.4 * scale.factor, 0.5)
        east += 1.4 * (1.06 if is_long else 1.0)
    scale.meet([1.0])
    assert scale.factor == pytest.approx(1.06, abs=0.015)
    scale.meet([-1.0])
    assert scale.factor == pytest.approx(1.0, abs=0.015)
    again = PersonalScale(scale.person.scale, scale.person.sigma, scale.person.refinement)
    again.meet([-1.0])
    assert again.factor == pytest.approx(scale.factor)


def test_what_walking_shows_says_nothing_of_runs() -> None:
    """Walked steps are 10 % longer than told, runs as long as told; fixes see both, by turns."""
    scale = PersonalScale()
    east = 0.0
    for second in range(1200):
        runs = second // 60 % 2 == 1
        scale.fix(second * SECOND_NS, east, 0.0, 2.0)
        if second == 60:
            scale.meet((), "running")
            assert scale.factor == 1.0  # nobody has run yet
        scale.meet((), "running" if runs else "walking")
        scale.walk(1.4 * scale.factor, 0.5)
        east += 1.4 * (1.0 if runs else 1.1)
    assert scale.factor == pytest.approx(1.0, abs=0.02)
    scale.meet(())
    assert scale.factor == pytest.approx(1.1, abs=0.02)


def test_no_feature_makes_a_refined_factor_run_away() -> None:
    scale = PersonalScale(refinement=(0.9, -0.9))
    scale.meet([1e6, 0.0])
    assert math.log(scale.factor) == pytest.approx(MOST_LOG)
    scale.meet([0.0, 1e6])
    assert math.log(scale.factor) == pytest.approx(-MOST_LOG)
