"""The factor that a covariance still needs is found, and it is tried on runs that it was not found on."""

from dataclasses import replace

import numpy as np
import pytest

from proving_ground.evaluation.consistency import StepChain
from proving_ground.evaluation.foot.honesty import Judged, by_motion, factor_for, mean_inside_pct
from sensor_gateway.recordings.run import Truth

STRIDES = 60
SIGMA = np.array([0.03, 0.02, 0.004])


def run(rng: np.random.Generator, claimed: float, motion: str = "walking") -> Judged:
    """A straight walk whose steps claim this part of their true variance."""
    exact = StepChain(
        time_s=np.arange(STRIDES + 1.0),
        displacement_m=np.tile([1.4, 0.0], (STRIDES, 1)),
        heading_change_rad=np.zeros(STRIDES),
        covariance=np.tile(np.diag(SIGMA**2) * claimed, (STRIDES, 1, 1)),
    )
    error = rng.normal(size=(STRIDES, 3)) * SIGMA
    noisy = replace(
        exact, displacement_m=exact.displacement_m + error[:, :2], heading_change_rad=error[:, 2].copy()
    )
    truth_m = np.column_stack([exact.position_m, np.zeros(STRIDES + 1)])
    return Judged("walk", motion, noisy, Truth(exact.time_s, truth_m))


@pytest.mark.parametrize("claimed", [0.25, 1.0, 2.0])
def test_the_factor_makes_up_for_what_is_claimed(claimed: float) -> None:
    rng = np.random.default_rng(3)
    runs = [run(rng, claimed) for _ in range(24)]
    factor = factor_for(runs)
    assert factor * claimed == pytest.approx(1.0, rel=0.2)
    assert mean_inside_pct(runs, factor) == pytest.approx(95.0, abs=0.8)


def test_classes_are_judged_apart_and_each_half_by_the_other() -> None:
    rng = np.random.default_rng(4)
    crawled = [run(rng, claimed, "crawling") for claimed in (0.25, 1.0) * 12]
    found = by_motion([*crawled, run(rng, 1.0)])
    even, odd = found["crawling"].factors or (0.0, 0.0)
    assert even == pytest.approx(4.0, rel=0.35)
    assert odd == pytest.approx(1.0, rel=0.35)
    assert len(found["crawling"].runs) == 24
    assert (found["crawling"].held_out_inside_pct or 100.0) < 92.0  # each half's factor misfits the other
    assert found["walking"].factors is None
