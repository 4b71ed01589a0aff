"""Quick turns, and the way back laid on the way out."""

import math

import numpy as np
import pytest

from pdr_engine.body.length.turns import MOST_SHRINK, stride_share
from pdr_engine.body.track.retrace import Retrace

LEG_M = 0.7


class Walker:
    """Walks by a compass whose error grows by ``drift_deg`` a step and has ``noise_deg`` in each."""

    def __init__(self, drift_deg: float = 0.0, noise_deg: float = 0.0) -> None:
        self.retrace = Retrace()
        self._drift_deg, self._noise_deg, self._error_deg = drift_deg, noise_deg, 0.0
        self._rng = np.random.default_rng(0)

    def go(self, azimuths_deg: list[float]) -> list[np.ndarray]:
        """Steps of 0.7 m; the places."""
        places = []
        for azimuth in azimuths_deg:
            self._error_deg += self._drift_deg
            seen = azimuth + self._error_deg + self._rng.normal(0.0, self._noise_deg)
            places.append(self.retrace.step(LEG_M, math.radians(seen)))
        return places


OUT = [20.0] * 200 + [95.0] * 150 + [40.0] * 150
BACK = [azimuth + 180.0 for azimuth in reversed(OUT)]


def test_a_stride_shrinks_by_the_rate_of_turn() -> None:
    assert stride_share(math.radians(30.0), 0.5) == 1.0  # 60 °/s: a corner
    assert stride_share(-math.radians(47.5), 0.5) == pytest.approx(1.0 - 0.5 * MOST_SHRINK)  # 95 °/s
    assert stride_share(math.radians(90.0), 0.5) == pytest.approx(0.2)
    assert stride_share(1.0, 0.0) == 1.0


def test_the_way_back_undoes_a_drifting_azimuth() -> None:
    """0.02° a step: 20° at the end of 1000 steps, some 60 m off by dead reckoning alone."""
    walker = Walker(drift_deg=0.02, noise_deg=4.0)
    walker.go(OUT + BACK)
    plain = LEG_M * np.sum(
        [
            [math.sin(math.radians(a + 0.02 * n)), math.cos(math.radians(a + 0.02 * n))]
            for n, a in enumerate(OUT + BACK, start=1)
        ],
        axis=0,
    )
    assert np.hypot(*plain) > 20.0
    assert np.hypot(*walker.retrace.place_m) < 1.0
    assert walker.retrace.left == 0


def test_the_turn_may_take_some_steps() -> None:
    walker = Walker()
    walker.go([0.0] * 250 + [60.0, 120.0] + [180.0] * 60)
    retrace = walker.retrace
    assert retrace.active
    assert abs(retrace.place_m[0]) < 0.1  # on the way out, though the turn led aside
    assert retrace.place_m[1] == pytest.approx(190 * LEG_M, abs=1.0)


def test_who_branches_off_is_let_go_where_they_did() -> None:
    walker = Walker(noise_deg=4.0)
    walker.go([0.0] * 250 + [180.0] * 50)
    retrace = walker.retrace
    assert retrace.active
    at_branch = retrace.place_m
    places = walker.go([225.0] * 30)
    assert not retrace.active
    assert retrace.left == 1
    expected = at_branch + 30 * LEG_M * np.array(
        [math.sin(math.radians(225.0)), math.cos(math.radians(225.0))]
    )
    assert np.hypot(*(retrace.place_m - expected)) < 2.5
    # Gone within eight steps, and never further off than these.
    assert np.hypot(*(places[8] - places[7])) == pytest.approx(LEG_M)


def test_further_back_than_out_is_a_new_way() -> None:
    walker = Walker()
    walker.go([0.0] * 250 + [180.0] * 290)
    assert not walker.retrace.active
    assert walker.retrace.place_m == pytest.approx([0.0, -40 * LEG_M], abs=1.0)


def test_a_corner_is_no_turn_about_and_neither_is_a_wide_loop() -> None:
    corner, loop = Walker(), Walker()
    corner.go([0.0] * 250 + [90.0] * 50)
    loop.go([0.0] * 250 + [90.0] * 15 + [180.0] * 50)
    assert not corner.retrace.active
    assert not loop.retrace.active
    assert loop.retrace.place_m == pytest.approx([15 * LEG_M, 200 * LEG_M], abs=1e-6)


def test_who_bears_away_by_little_is_let_go_later() -> None:
    """20° aside: too little for the short window's noise, not for the long one's."""
    walker = Walker(noise_deg=4.0)
    walker.go([0.0] * 300 + [200.0] * 120)
    assert walker.retrace.left == 1
    back = 120 * LEG_M * np.array([math.sin(math.radians(200.0)), math.cos(math.radians(200.0))])
    assert np.hypot(*(walker.retrace.place_m - [0.0, 300 * LEG_M] - back)) < 4.0


def test_a_short_way_out_is_too_good_to_be_bent_to() -> None:
    walker = Walker()
    walker.go([0.0] * 150 + [180.0] * 20)
    assert not walker.retrace.active
    assert walker.retrace.place_m == pytest.approx([0.0, 130 * LEG_M], abs=1e-6)


def test_published_steps_add_up_to_the_places() -> None:
    places, published = Walker(noise_deg=3.0), Walker(noise_deg=3.0)
    walk = [0.0] * 250 + [180.0] * 80 + [230.0] * 40
    end, total = places.go(walk)[-1], np.zeros(2)
    rng = np.random.default_rng(0)
    for azimuth in walk:
        seen = math.radians(azimuth + rng.normal(0.0, 3.0))
        length, led = published.retrace.published(LEG_M, seen)
        total += length * np.array([math.sin(led), math.cos(led)])
    assert places.retrace.left == 1
    assert total == pytest.approx(end, abs=1e-6)


def test_what_is_learned_of_step_length_does_not_make_the_way_back_longer() -> None:
    """On the way out steps are told 10 % too short; on the way back it is known that they are not."""
    retrace = Retrace()
    for _ in range(300):
        retrace.step(0.9 * LEG_M, 0.0, 0.9)
    for _ in range(300):
        retrace.step(LEG_M, math.pi, 1.0)
    assert np.hypot(*retrace.place_m) < 0.5 * LEG_M


def test_instruments_that_differ_slowly_are_no_other_way() -> None:
    """15° within 150 m, as iron on the person makes a compass differ out and back."""
    walker = Walker(noise_deg=3.0)
    walker.go([0.0] * 500)
    walker.go([180.0 + min(15.0, 0.07 * step) for step in range(480)])
    assert walker.retrace.left == 0
    assert walker.retrace.active
    assert walker.retrace.place_m[1] == pytest.approx(20 * LEG_M, abs=2.0)
