"""Movement classes: from trunks that move as the sources say, not as the simulator does."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bootprint.messages import Direction
from pdr_engine.body.movement.classes import Climb, MovementClassifier
from pdr_engine.body.movement.direction import DirectionFilter
from pdr_engine.body.movement.posture import Posture
from pdr_engine.body.movement.settlement import Settlement
from pdr_engine.body.movement.side_step import USUAL_ROTATION_RAD, SideStepRotation
from pdr_engine.body.movement.surge import surge_of
from pdr_engine.body.pieces import Stride
from pdr_engine.body.steps.attitude import Rows

RATE_HZ = 100.0


def pendulum(
    way_rad: float,
    number: int = 0,
    hz: float = 1.8,
    bounce: float = 3.0,
    surge: float = 0.9,
    cut: float = 0.0,
) -> Stride:
    """A step of an inverted pendulum towards ``way_rad`` (counter-clockwise from ahead), cut at phase ``cut``.

    Height is h·cos(φ), so its acceleration is −b·cos(φ). From φ = 0 to π the body sinks and so speeds up: its
    acceleration along the way is +s·sin(φ).
    """
    time_s = np.arange(0.0, 1.0 / hz, 1.0 / RATE_HZ)
    phase = 2.0 * np.pi * (hz * time_s + cut)
    along = surge * np.sin(phase)
    accel = np.column_stack([along * math.cos(way_rad), along * math.sin(way_rad), -bounce * np.cos(phase)])
    start_ns = round(number / hz * 1e9)
    return Stride(start_ns, start_ns + round(1e9 / hz), accel, np.zeros_like(accel), time_s, None, 0.0, None)


@pytest.mark.parametrize("cut", [0.0, 0.3, 0.77])
def test_the_surge_points_the_way_wherever_the_step_was_cut(cut: float) -> None:
    for way in np.radians([0.0, 60.0, 90.0, 180.0, 260.0]):
        surge = surge_of(pendulum(way, cut=cut))
        assert math.hypot(surge.ahead_m_s2, surge.left_m_s2) == pytest.approx(0.9, rel=0.02)
        turned = math.atan2(surge.left_m_s2, surge.ahead_m_s2) - way
        assert math.remainder(turned, 2.0 * math.pi) == pytest.approx(0.0, abs=0.03)
        assert surge.bounce_m_s2 == pytest.approx(3.0, rel=0.02)


def test_a_knock_of_the_heel_or_a_tilt_of_the_unit_makes_no_surge() -> None:
    """What goes in time with the vertical, either way, is no quarter of a step ahead of it."""
    time_s = np.arange(0.0, 0.5, 0.01)
    up = np.cos(4.0 * np.pi * time_s)
    accel = np.column_stack([-0.8 * up, 0.5 * up, 3.0 * up])
    surge = surge_of(Stride(0, 500_000_000, accel, accel, time_s, None, 0.0, None))
    assert abs(surge.ahead_m_s2) < 1e-9
    assert abs(surge.left_m_s2) < 1e-9


def test_too_few_samples_are_no_step() -> None:
    none = np.zeros((3, 3))
    assert surge_of(Stride(0, 500_000_000, none, none, np.zeros(3), None, 0.0, None)).stir_m_s2 == 0.0


@pytest.mark.parametrize(
    ("way_deg", "name"), [(0.0, "forward"), (180.0, "backward"), (90.0, "left"), (-90.0, "right")]
)
def test_each_direction_is_known_after_two_steps(way_deg: float, name: str) -> None:
    classifier = MovementClassifier()
    for number in range(3):
        found = classifier.update(pendulum(math.radians(way_deg), number))
    assert (found.name, found.direction, found.motion) == (name, name, "walking")
    assert found.probability[found.name] > 0.9
    assert sum(found.probability.values()) == pytest.approx(1.0)


def test_one_odd_step_does_not_turn_a_walker_round() -> None:
    classifier = MovementClassifier()
    ways = [0.0] * 12 + [2.5] + [0.0] * 5
    assert {classifier.update(pendulum(way, n)).name for n, way in enumerate(ways)} == {"forward"}


def test_a_unit_that_points_aside_is_learned_and_is_no_side_step() -> None:
    """25° aside for long; then 25° more are still nearer to forward than to left."""
    classifier = MovementClassifier()
    ways = np.radians([25.0] * 80 + [50.0] * 10)
    names = [classifier.update(pendulum(way, n)).name for n, way in enumerate(ways)]
    assert set(names) == {"forward"}
    skew = math.atan2(*classifier.directions.surge_m_s2[::-1])
    assert math.degrees(skew) == pytest.approx(28.0, abs=7.0)


def test_steps_without_surge_fall_back_to_forward() -> None:
    classifier = MovementClassifier()
    for number in range(5):
        classifier.update(pendulum(math.pi, number))
    assert classifier.directions.decided == "backward"
    for number in range(5, 9):
        classifier.update(pendulum(0.0, number, surge=0.05))
    assert classifier.directions.decided == "forward"


def test_a_run_needs_bounce_and_cadence() -> None:
    fast = MovementClassifier()
    # A runner's surge points back by the pendulum's rule (Cavagna): it must not be taken for backward.
    names = [fast.update(pendulum(math.pi, n, hz=2.8, bounce=14.0, surge=1.9)).name for n in range(6)]
    assert set(names[1:]) == {"running"}
    jolted = MovementClassifier()
    assert jolted.update(pendulum(0.0, hz=1.9, bounce=14.0)).name == "forward"
    hurried = MovementClassifier()
    assert hurried.update(pendulum(0.0, hz=2.7, bounce=5.0)).name == "forward"


def test_still_stairs_and_crawling() -> None:
    classifier = MovementClassifier()
    assert classifier.update(pendulum(0.0, bounce=0.1, surge=0.05)).motion == "standing"
    up = classifier.update(pendulum(0.0, 1), Climb(0.9, True))
    assert (up.name, up.motion, up.direction) == ("stairs_up", "stairs", "forward")
    assert classifier.update(pendulum(0.0, 2), Climb(0.9, False)).name == "stairs_down"
    assert classifier.update(pendulum(0.0, 3), Climb(0.1, False)).name == "forward"
    assert classifier.update(pendulum(0.0, 4), tilt_rad=math.radians(75.0)).motion == "crawling"


def test_nobody_climbs_stairs_sideways() -> None:
    """A gust while somebody steps aside: as likely stairs as not by pressure alone."""
    classifier = MovementClassifier()
    for number in range(4):
        classifier.update(pendulum(0.5 * math.pi, number))
    assert classifier.update(pendulum(0.5 * math.pi, 4), Climb(0.8, True)).name == "left"
    ahead = MovementClassifier()
    assert ahead.update(pendulum(0.0), Climb(0.8, True)).name == "stairs_up"


def test_corrections_are_those_of_the_source() -> None:
    rotation = SideStepRotation(math.radians(15.0))
    degrees = {
        way: math.degrees(rotation.correction_rad(way)) for way in ("forward", "backward", "left", "right")
    }
    # Who steps left has turned left by 15°: the unit's azimuth is 15° too small already.
    assert degrees == pytest.approx({"forward": 0.0, "backward": 180.0, "left": -75.0, "right": 75.0})
    assert math.degrees(SideStepRotation(1.0).rotation_rad) == pytest.approx(20.0)


def walk_on(
    rotation: SideStepRotation,
    ways: list[tuple[Direction, float, int]],
    drift_deg_s: float = 0.0,
    at_s: float = 0.0,
) -> None:
    """Stretches of (direction, where the body faces in degrees, steps), half a second a step; the gyro drifts."""
    for direction, facing_deg, steps in ways:
        for _ in range(steps):
            rotation.update(direction, math.radians(facing_deg + drift_deg_s * at_s), at_s)
            at_s += 0.5


def test_the_rotation_is_learned_where_side_steps_begin_and_end() -> None:
    """Of 6 ± 10° a scalar Kalman filter makes, of changes by 13° seen with 2.02, 2.02 and 2.31° (its noise):

    12.729 (gain 0.961), 12.877 (0.547) and 12.924° (0.377).
    """
    rotation = SideStepRotation()
    assert rotation.rotation_rad == USUAL_ROTATION_RAD
    # Forward, left (the body turns left, the heading grows), forward again; a change is seen a step late.
    walk_on(rotation, [("forward", 0.0, 12), ("forward", 13.0, 1), ("left", 13.0, 30), ("left", 0.0, 1)])
    assert math.degrees(rotation.rotation_rad) == pytest.approx(12.729, abs=1e-3)
    walk_on(rotation, [("forward", 0.0, 12), ("right", -13.0, 12)], at_s=22.0)
    assert (rotation.observations, math.degrees(rotation.rotation_rad)) == (
        3,
        pytest.approx(12.924, abs=1e-3),
    )


def test_a_gyro_s_drift_is_no_rotation() -> None:
    """0.4°/s would show as 2 to 5° of rotation, and a halt that looks like two steps forward hides no change."""
    rotation = SideStepRotation()
    ways: list[tuple[Direction, float, int]] = [("left", 8.0, 30), ("forward", 4.0, 2), ("backward", 0.0, 30)]
    walk_on(rotation, [("forward", 0.0, 20), *ways, ("right", -8.0, 30)], drift_deg_s=0.4)
    assert rotation.observations == 3
    assert math.degrees(rotation.rotation_rad) == pytest.approx(8.0, abs=1.0)


def test_a_real_turn_teaches_no_rotation() -> None:
    rotation = SideStepRotation()
    walk_on(rotation, [("forward", 0.0, 9), ("left", 86.0, 9)])
    assert rotation.observations == 0


def test_the_next_steps_carry_what_the_first_was_wrong_by() -> None:
    """Two steps forward, then aside: however late that is seen, the track ends where it should."""
    directions, settlement = DirectionFilter(), Settlement()
    ways = {"forward": (1.0, 0.0), "backward": (-0.7, 0.0), "left": (0.0, 0.4), "right": (0.0, -0.4)}
    vectors = {name: np.array(way) for name, way in ways.items()}
    place, late = np.zeros(2), 0
    for number in range(12):
        stride = pendulum(0.0 if number < 8 else 0.5 * math.pi, number)
        directions.update(surge_of(stride), 0.0, stride.start_ns, stride.end_ns)
        late += number >= 8 and directions.decided != "left"
        place += settlement.step(vectors, directions)
    assert late >= 1
    np.testing.assert_allclose(place, [8.0, 4 * 0.4], atol=1e-12)


def test_a_unit_fixed_to_the_trunk_tells_a_crawl_and_one_in_the_hand_does_not() -> None:
    """Upright at first, then leaning 8° more, then level: the usual vertical follows the lean and not the crawl."""
    fixed, loose = Posture(), Posture()
    for _ in range(60):
        leaning = fixed.tilt_rad(rows_leaning(8.0), on_trunk=True)
    assert leaning == pytest.approx(0.0, abs=1e-3)
    for _ in range(100):
        level = fixed.tilt_rad(rows_leaning(83.0), on_trunk=True)
    assert level == pytest.approx(math.radians(75.0), abs=1e-3)
    assert fixed.tilt_rad(rows_leaning(8.0), on_trunk=True) == pytest.approx(0.0, abs=1e-3)
    assert loose.tilt_rad(rows_leaning(83.0), on_trunk=False) is None


def rows_leaning(degrees: float) -> Rows:
    s, c = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    return ((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c))


def test_a_twist_that_shakes_the_unit_to_and_fro_turns_no_direction() -> None:
    """Side steps to the right with a left shove at every second step: one by one they point anywhere."""
    directions = DirectionFilter()
    for number in range(12):
        shove = 0.8 if number % 2 else -0.8
        stride = pendulum(-0.5 * math.pi, number, hz=2.0)
        surge = surge_of(stride)
        shoved = replace(surge, left_m_s2=surge.left_m_s2 + shove)
        directions.update(shoved, 0.0, stride.start_ns, stride.end_ns)
        assert number < 2 or directions.decided == "right"
