"""Bent fields: each sign alone, and all of them on a walk past iron."""

import math

import numpy as np
import pytest

from bootprint.geomagnetism import EarthField
from pdr_engine.body.azimuth.disturbance import (
    SOURCE_RATE_RAD_S,
    SOURCE_STRENGTH_RMS_UT,
    STRENGTH_RMS_UT,
    TURN_RATE_RAD_S,
    DisturbanceDetector,
    Field,
    Verdict,
    field_of,
)

EARTH = EarthField(0.0, 20.0, -45.0)
STRENGTH = math.hypot(20.0, 45.0)
DIP = math.atan2(45.0, 20.0)
STEP_S = 0.5


def clean(
    azimuth_rad: float = 0.3, strength: float = STRENGTH, dip: float = DIP, spread: float = 0.5
) -> Field:
    """A step's field as the earth makes it, but for what is said."""
    return Field(strength, spread**2, dip, azimuth_rad)


def walked(detector: DisturbanceDetector, fields: list[Field], turn_rad: float = 0.0) -> list[Verdict]:
    """The verdicts of steps one after the other."""
    return [detector.update(field, turn_rad, STEP_S) for field in fields]


def test_a_step_s_field_by_hand() -> None:
    """Facing east, the field points north, that is to the left, and down."""
    field = field_of(np.tile([0.0, 20.0, -45.0], (10, 1)))
    assert field.strength_ut == pytest.approx(STRENGTH)
    assert field.strength_variance_ut2 == pytest.approx(0.0)
    assert field.dip_rad == pytest.approx(DIP)
    assert field.azimuth_rad == pytest.approx(0.5 * math.pi)


def test_the_source_s_thresholds_are_evidence_and_half_of_them_is_not() -> None:
    assert STRENGTH_RMS_UT.evidence(SOURCE_STRENGTH_RMS_UT) > 0.5
    assert STRENGTH_RMS_UT.evidence(0.5 * SOURCE_STRENGTH_RMS_UT) < 0.0
    assert TURN_RATE_RAD_S.evidence(SOURCE_RATE_RAD_S) > 1.0
    assert TURN_RATE_RAD_S.evidence(0.25 * SOURCE_RATE_RAD_S) < 0.0
    assert TURN_RATE_RAD_S.evidence(SOURCE_RATE_RAD_S, doubt=SOURCE_RATE_RAD_S) < 0.5


@pytest.mark.parametrize("earth", [EARTH, None])
def test_a_clean_walk_is_clean_also_in_turns(earth: EarthField | None) -> None:
    rng = np.random.default_rng(0)
    detector = DisturbanceDetector(earth)
    azimuth = 0.0
    for step in range(200):
        turn = 0.5 if step % 20 < 3 else 0.0  # clockwise
        azimuth += turn
        noise = rng.normal(0.0, [0.02, 0.8, 0.02])
        field = clean(azimuth + noise[0], STRENGTH + noise[1], DIP + noise[2])
        assert not detector.update(field, turn, STEP_S).disturbed


@pytest.mark.parametrize(
    ("sign", "field", "steps"),
    [
        ("strength", clean(strength=STRENGTH + 12.0), 1),
        ("dip", clean(dip=DIP - math.radians(15.0)), 1),
        ("rate", clean(azimuth_rad=0.3 + math.radians(20.0)), 1),  # 40 °/s and the gyro sees none
        ("steadiness", clean(spread=6.0), 3),
    ],
)
def test_each_sign_is_seen(sign: str, field: Field, steps: int) -> None:
    detector = DisturbanceDetector(EARTH)
    walked(detector, [clean()] * 10)
    verdict = walked(detector, [field] * steps)[-1]
    assert max(verdict.evidence, key=lambda name: verdict.evidence[name]) == sign
    assert verdict.probability > 0.4
    assert sum(verdict.evidence.values()) > 2.0


def test_the_carried_azimuth_tells_a_steady_wrong_field() -> None:
    """A field bent by 40° without change of strength, entered slowly: only the gyro's azimuth shows it."""
    detector = DisturbanceDetector(EARTH)
    for _ in range(10):
        detector.update(clean(0.3), 0.0, STEP_S, (0.3, 0.05))
    for step in range(20):
        bent = 0.3 + math.radians(min(40.0, 2.0 * step))
        verdict = detector.update(clean(bent), 0.0, STEP_S, (0.3, 0.05))
    assert verdict.disturbed
    assert verdict.evidence["azimuth"] > 3.0
    assert detector.update(clean(bent), 0.0, STEP_S, (0.3, 2.0)).evidence["azimuth"] < 0.1  # an unsure gyro


def test_it_recovers_after_the_iron() -> None:
    detector = DisturbanceDetector(EARTH)
    walked(detector, [clean()] * 10)
    assert walked(detector, [clean(strength=80.0, spread=8.0)] * 6)[-1].probability > 0.99
    assert not walked(detector, [clean()] * 8)[-1].disturbed


def test_a_compass_with_iron_of_its_own_comes_round() -> None:
    """5 µT stronger than the model for ever: suspicious at first, the walk's habit in the end."""
    detector = DisturbanceDetector(EARTH)
    verdicts = walked(detector, [clean(strength=STRENGTH + 5.0)] * 300)
    assert not verdicts[-1].disturbed


def test_doubt_widens_an_azimuth_until_it_is_worthless() -> None:
    sure, half, bad = (Verdict(p, {}).sigma_rad(0.1) for p in (0.0, 0.5, 0.99))
    assert sure == pytest.approx(0.1)
    assert half == pytest.approx(0.5)
    assert bad is None


def test_unevenness_is_what_the_field_is_off_its_habit() -> None:
    """Begun as in a building; even it is none, and with strengths 10 % up and down 0.1."""
    even, uneven = DisturbanceDetector(EARTH, 0.14), DisturbanceDetector(EARTH, 0.14)
    assert even.unevenness == pytest.approx(0.14)
    walked(even, [clean()] * 400)
    walked(uneven, [clean(strength=STRENGTH * (1.1 if k % 2 else 0.9)) for k in range(400)])
    assert even.unevenness < 0.02
    assert uneven.unevenness == pytest.approx(0.1, abs=0.02)
