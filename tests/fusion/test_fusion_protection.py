"""Protection figures by hand."""

import math
from collections import Counter

import numpy as np
import pytest

from fusion.boots import Boots
from fusion.config import FusionConfig
from fusion.protection import Protector, radius_m
from fusion.shadows import Shadows


def test_radius_holds_95_percent_of_the_long_axis() -> None:
    assert radius_m(np.diag([4.0, 1.0, 9.0])) == pytest.approx(2.0 * math.sqrt(5.991), rel=1e-3)


def test_a_heading_error_of_two_degrees_is_added_since_the_last_place() -> None:
    protector = Protector(Shadows(30.0))
    protector.know((100.0, 0.0, 0.0))
    found = protector.protect((100.0, 300.0, 0.0), np.eye(3), 0, by_satellites=False)
    assert found.external_m == pytest.approx(300.0 * math.radians(2.0))
    assert found.radius_m == pytest.approx(found.external_m + math.sqrt(5.991), rel=1e-3)


def test_beside_satellites_the_oldest_shadow_is_held_to_be_right() -> None:
    counters: Counter[str] = Counter()
    boots = Boots(FusionConfig(), counters)
    boots.adopt(0)
    shadows = Shadows(30.0)
    shadows.split_off(boots, counters, 0)
    boots.carry(np.array([6.0, 8.0, 0.0]), np.zeros((3, 3)))  # satellites pulled by 10 m
    shadow = next(iter(shadows))
    shadow.boots.filter.widen_together(np.eye(3))
    found = Protector(shadows).protect((6.0, 8.0, 0.0), np.eye(3), 0, by_satellites=True)
    assert found.radius_m == pytest.approx(10.0 + math.sqrt(5.991), rel=1e-3)


def test_shadows_of_every_age_are_kept_and_not_too_many() -> None:
    counters: Counter[str] = Counter()
    boots = Boots(FusionConfig(), counters)
    shadows = Shadows(30.0)
    for second in range(1200):
        shadows.split_off(boots, counters, second * 10**9)
    ages_s = [1199 - shadow.born_ns / 1e9 for shadow in shadows]
    assert ages_s == sorted(ages_s, reverse=True)
    assert len(ages_s) <= 6
    assert ages_s[-1] < 30.0
    assert 120.0 <= ages_s[0] < 240.0
