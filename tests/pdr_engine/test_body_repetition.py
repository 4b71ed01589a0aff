"""What repeats and what does not, what speed is lost and gained: walks told from rides, changes from going on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from pdr_engine.body.movement.classes import Climb
from pdr_engine.body.movement.direction import DIRECTIONS, USUAL, WALKING
from pdr_engine.body.movement.feet import Feet, Settled
from pdr_engine.body.movement.impetus import Impetus
from pdr_engine.body.pieces import Stride
from pdr_engine.body.settings import StepSettings
from pdr_engine.body.steps.footfalls import Footfalls
from pdr_engine.body.steps.grid import CELL_NS, CELL_S
from pdr_engine.body.steps.likeness import likeness

STEP_S = 0.5
STEP_NS = 500_000_000


def stride_motion(cells: int, rate_sign: float = 1.0) -> np.ndarray:
    """A stride in so many cells (n, 6): bounce twice, sway and twist once."""
    turn = 2.0 * np.pi * (np.arange(cells) + 0.5) / cells
    still = np.zeros(cells)
    return np.column_stack(
        [still, np.cos(turn), 3.0 * np.cos(2.0 * turn), still, still, rate_sign * np.sin(turn)]
    )


def test_a_stride_is_like_itself_at_any_speed_and_height() -> None:
    assert likeness(stride_motion(52), stride_motion(44)) == pytest.approx(1.0, abs=0.01)
    assert likeness(stride_motion(52), 1.3 * stride_motion(52) + 9.8) == pytest.approx(1.0)
    # Accelerations and rates weigh the same: the ones alike, the others opposite.
    assert likeness(stride_motion(52), stride_motion(52, -1.0)) == pytest.approx(0.0, abs=1e-9)
    assert likeness(stride_motion(52), -stride_motion(52)) == pytest.approx(-1.0)


def test_a_unit_at_rest_is_like_nothing() -> None:
    assert likeness(np.zeros((50, 6)), stride_motion(50)) == 0.0


@dataclass
class Told:
    """Strides of which it is told how alike they are, by peak."""

    alike: Sequence[float]

    def likeness(self, peaks_ns: Sequence[int]) -> float:
        return self.alike[min(peaks_ns[-1] // STEP_NS, len(self.alike) - 1)]


def steps_where(alike: Sequence[float], seconds: float) -> list[tuple[int, int]]:
    """Steps told of perfectly even bounces, two a second, whose strides are as alike as this says, by peak."""

    footfalls = Footfalls(StepSettings(), Told(alike))
    times = range(round(seconds / CELL_S))
    bounce = [4.0 * math.sin(2.0 * math.pi * k * CELL_S / STEP_S) for k in times]
    return [step for k, value in enumerate(bounce) for step in footfalls.take(k * CELL_NS, value)]


def test_an_even_rhythm_whose_strides_differ_is_no_walk_for_long() -> None:
    assert abs(len(steps_where([0.8], 60.0)) - 120) <= 2
    assert len(steps_where([0.05], 60.0)) < 15


def test_a_walk_after_a_ride_is_told_whole_once_it_is_believed() -> None:
    """A minute of each: of the walk's 120 steps only those are lost whose strides reach back into the ride."""
    steps = steps_where([0.05] * 120 + [0.8], 120.0)
    walked = [end_ns for _, end_ns in steps if end_ns >= 120 * STEP_NS]
    assert len(walked) >= 112


def test_a_spoilt_stretch_does_not_end_a_walk_that_has_been_one() -> None:
    """Ten strides that are like nothing (a turn, a stumble), after and before twenty good ones."""
    assert abs(len(steps_where([0.8] * 20 + [0.1] * 10 + [0.8], 60.0)) - 120) <= 2


def moved(number: int, gained: tuple[float, float], way_rad: float = 0.0, bounce: float = 3.0) -> Stride:
    """A step that gains this speed, m/s ahead and left, of a pendulum that goes this way."""
    time_s = np.arange(0.0, STEP_S, 0.01)
    phase = 2.0 * np.pi * time_s / STEP_S
    along = 0.3 * bounce * np.sin(phase)
    accel = np.column_stack([along * math.cos(way_rad), along * math.sin(way_rad), -bounce * np.cos(phase)])
    accel[:, :2] += np.array(gained) / STEP_S
    start_ns = number * STEP_NS
    return Stride(start_ns, start_ns + STEP_NS, accel, 0.0 * accel, time_s, None, 0.0, None)


def change_after(gained: tuple[float, float], before: str) -> dict[str, float]:
    """How likely each direction is against going on, of one who gains this in three steps."""
    impetus = Impetus()
    for number in range(3):
        impetus.take(moved(number, (gained[0] / 3.0, gained[1] / 3.0)))
    change = impetus.transition(WALKING, USUAL)
    assert change is not None
    row = [name == before for name in DIRECTIONS].index(True)
    return dict(zip(DIRECTIONS, (change[row] / change[row, row]).tolist(), strict=True))


@pytest.mark.parametrize(
    ("gained", "before", "after", "other"),
    [
        ((-1.25, 0.4), "forward", "left", "right"),
        ((-1.25, -0.4), "forward", "right", "left"),
        ((-2.05, 0.0), "forward", "backward", "left"),
        ((0.8, 0.4), "backward", "left", "right"),
    ],
)
def test_speed_lost_and_gained_tells_a_change(
    gained: tuple[float, float], before: str, after: str, other: str
) -> None:
    kept, lost = change_after((0.0, 0.0), before), change_after(gained, before)
    assert kept[after] == pytest.approx(0.006 * 0.04, rel=0.4)  # as rare as without knowing speeds
    assert lost[after] > 25.0 * kept[after]
    assert lost[after] > 1.8 * lost[other]


def test_nothing_is_said_of_speed_before_three_steps_in_a_row() -> None:
    impetus = Impetus()
    for number in range(2):
        impetus.take(moved(number, (0.0, 0.0)))
    assert impetus.transition(WALKING, USUAL) is None
    impetus.take(moved(2, (0.0, 0.0)))
    assert impetus.transition(WALKING, USUAL) is not None
    impetus.restart()
    assert impetus.transition(WALKING, USUAL) is None


def test_a_tilted_unit_gains_no_speed_for_ever() -> None:
    impetus = Impetus()
    for number in range(200):
        impetus.take(moved(number, (0.1, 0.0)))  # 0.2 m/s², a tilt of one degree
    change = impetus.transition(WALKING, USUAL)
    assert change is not None
    assert change[0, 0] > 0.9


def settled_of(strides: Sequence[Stride], climb: Climb | None) -> tuple[list[str], dict[int, Settled]]:
    """What each step was told to be at once, and by its end what it settled to be; ``climb`` is known later."""
    feet, told, settled = Feet(), [], {}
    for stride in strides:
        told.append(feet.judge(stride, 0.0, None, None, facing_known=True).name)
        if (known := feet.settled(lambda _: climb)) is not None:
            settled[known.time_ns] = known
    return told, settled


def test_the_first_step_aside_settles_to_be_one() -> None:
    """Its surge is seen together with the step before, so at once it is still one forward."""
    ways = [0.0] * 8 + [0.5 * math.pi] * 8
    strides = [moved(number, (0.0, 0.0), way) for number, way in enumerate(ways)]
    told, settled = settled_of(strides, None)
    assert told[8] == "forward"
    assert told[12] == "left"
    assert len(settled) == len(strides) - 4
    assert settled[strides[7].end_ns].direction == "forward"
    # The eighth shows half of both; from the ninth on it is surely left.
    assert settled[strides[9].end_ns].direction == "left"
    assert settled[strides[9].end_ns].motion == "walking"


def test_stairs_that_pressure_shows_later_settle_forward_steps_only() -> None:
    ahead = [moved(number, (0.0, 0.0)) for number in range(12)]
    aside = [moved(number, (0.0, 0.0), 0.5 * math.pi) for number in range(12)]
    told, settled = settled_of(ahead, Climb(0.9, True))
    assert set(told) == {"forward"}
    assert {one.name for one in settled.values()} == {"stairs_up"}
    assert {one.motion for one in settled.values()} == {"stairs"}
    _, settled = settled_of(aside, Climb(0.9, True))
    assert settled[aside[7].end_ns].name == "left"


def limping(alike: float) -> list[tuple[int, int]]:
    """Steps told of thirty bounces that come after 0.4 and 1.2 s by turns, as heavy steps of one foot make them."""
    at_s = np.cumsum([0.4, 1.2] * 15)
    time_s = np.arange(0.0, 26.0, CELL_S)
    bounce = sum(4.0 * np.exp(-0.5 * ((time_s - at) / 0.06) ** 2) for at in at_s)
    footfalls = Footfalls(StepSettings(), Told([alike]))
    vertical = np.asarray(bounce).tolist()
    return [step for k, value in enumerate(vertical) for step in footfalls.take(k * CELL_NS, value)]


def test_a_limp_is_a_walk_if_its_strides_are_alike() -> None:
    assert abs(len(limping(0.8)) - 30) <= 1
    assert limping(0.1) == []
