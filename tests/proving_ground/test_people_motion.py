"""Simulated people: legs last what they promise, feet fall where the way goes, and nothing jumps."""

from dataclasses import replace

import numpy as np
import pytest

from bootprint.errors import ConfigError
from proving_ground.people import INSTEP_M, Itinerary, Leg, Person, leg_duration_s, move
from support.people_walks import acceleration, turn_rate, velocity, walked, yaw_of

L_SHAPE = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 8.0, 0.0]]
STAIRS = [[0.0, 0.0, 0.0], [4.5, 0.0, 2.72]]
EVERYTHING = (
    Leg("stand", [[0, 0, 0]], 1.5),
    Leg("walk", [[0, 0, 0], [8, 0, 0], [8, 6, 0]]),
    Leg("turn", [[8, 6, 0]], facing_rad=-0.5 * np.pi),
    Leg("run", [[8, 6, 0], [8, -20, 0]]),
    Leg("sprint", [[8, -20, 0], [40, -20, 0]]),
    Leg("stairs", [[40, -20, 0], [44.5, -20, 2.72]]),
    Leg("lift", [[44.5, -20, 2.72], [44.5, -20, 0]]),
    Leg("kneel", [[44.5, -20, 0]], 5.0),
    Leg("crawl", [[44.5, -20, 0], [48, -20, 0]]),
    Leg("prone", [[48, -20, 0]], 6.0),
    Leg("side_step_left", [[48, -20, 0], [48, -17, 0]]),
    Leg("side_step_right", [[48, -17, 0], [48, -20, 0]]),
    Leg("backward", [[48, -20, 0], [42, -20, 0]]),
    Leg("stand", [[42, -20, 0]], 1.5),
)


@pytest.fixture(scope="module")
def busy():
    """A person who does everything there is."""
    return move(Person.drawn(np.random.default_rng(7)), Itinerary(EVERYTHING, start_s=0.5), seed=3)


def test_legs_last_exactly_as_long_as_they_are_said_to(busy) -> None:
    durations = [leg_duration_s(busy.person, leg) for leg in EVERYTHING]
    done = [(activity.gait, activity.end_s - activity.start_s) for activity in busy.activities[1:]]
    assert [gait for gait, _ in done] == [leg.gait for leg in EVERYTHING]
    np.testing.assert_allclose([duration for _, duration in done], durations, atol=1e-9)
    assert busy.duration_s == pytest.approx(0.5 + sum(durations))


@pytest.mark.parametrize("part", ["left_foot", "right_foot", "torso"])
def test_velocity_and_acceleration_are_continuous(busy, part: str) -> None:
    motion = getattr(busy, part)
    time_s = np.arange(0.3, busy.duration_s, 0.0017)
    jumps = []
    for step_s in (1e-3, 2.5e-4):
        before, after = (acceleration(motion, time_s + shift, 2e-4) for shift in (0.0, step_s))
        jumps.append(np.linalg.norm(after - before, axis=1).max())
        assert np.linalg.norm(velocity(motion, time_s + step_s) - velocity(motion, time_s), axis=1).max() < (
            600.0 * step_s
        )
    # What is continuous changes four times less in a quarter of the time; a jump would stay.
    assert jumps[1] < 0.4 * jumps[0]


def test_the_same_seed_gives_the_same_motion_and_another_does_not() -> None:
    time_s = np.linspace(0.0, 15.0, 500)
    one, same, other = (walked("walk", seed=seed).left_foot.at(time_s) for seed in (1, 1, 2))
    assert np.array_equal(one[0], same[0])
    assert np.array_equal(one[1].as_quat(), same[1].as_quat())
    assert not np.allclose(one[0], other[0], atol=1e-3)


def test_footfalls_follow_the_way_points_and_end_on_the_last() -> None:
    motion = walked("walk", L_SHAPE)
    for falls in motion.footfalls.values():
        x, y, _ = falls.place_m.T
        aside = np.minimum(np.abs(y) + np.maximum(x - 10.0, 0.0), np.abs(x - 10.0) + np.maximum(-y, 0.0))
        assert aside.max() < 0.25
        assert len(x) == pytest.approx(18.0 / 1.45, abs=2)
    ends = [falls.place_m[-1] for falls in motion.footfalls.values()]
    np.testing.assert_allclose(np.mean(ends, axis=0), L_SHAPE[-1], atol=0.04)
    np.testing.assert_allclose(motion.truth().position_m[-1], L_SHAPE[-1], atol=0.04)


@pytest.mark.parametrize("gait", ["walk", "backward", "side_step_left", "run", "stairs", "crawl"])
def test_the_sole_stands_still_where_it_fell(gait: str) -> None:
    person = replace(Person(), creep=0.0, sink=0.0)
    motion = walked(gait, STAIRS if gait == "stairs" else [[0, 0, 0], [6, 0, 0]], person=person)
    for place, falls in motion.footfalls.items():
        inner = slice(1, -1)
        middle = 0.5 * (falls.begin_s[inner] + falls.end_s[inner])
        at, _ = getattr(motion, place).at(middle)
        assert np.linalg.norm(at - falls.place_m[inner], axis=1).max() < 0.03


def test_the_heel_rises_while_the_ball_of_the_foot_still_stands() -> None:
    motion = walked("walk")
    foot, falls = motion.right_foot, motion.footfalls["right_foot"]
    time_s = (falls.end_s[2:-2, None] + np.linspace(-0.25, 0.0, 50)).ravel()
    pitch = foot.at(time_s)[1].as_euler("ZYX")[:, 1]
    rolling = time_s[(pitch > np.radians(5.0)) & (pitch < np.radians(20.0))]
    ball = np.linalg.norm(velocity(foot, rolling), axis=1)
    lever = foot.at(rolling)[1].apply(np.cross(turn_rate(foot, rolling), INSTEP_M))
    instep = np.linalg.norm(velocity(foot, rolling) + lever, axis=1)
    pitch_rate = turn_rate(foot, rolling)[:, 1]
    assert np.median(pitch_rate) > 1.0
    assert np.median(ball) < 0.06
    assert np.median(instep) > 2.0 * np.median(ball)


def test_a_standing_foot_hardly_trembles_and_the_torso_sways_by_millimetres() -> None:
    motion = move(Person(), Itinerary((Leg("stand", [[0, 0, 0]], 60.0),)), seed=2)
    time_s = np.arange(0.0, 60.0, 0.02)
    foot, attitude = motion.left_foot.at(time_s)
    assert np.ptp(foot, axis=0).max() < 2e-3
    assert np.degrees((attitude[0].inv() * attitude).magnitude().max()) < 0.3
    sway = np.ptp(motion.torso.at(time_s)[0], axis=0)
    assert 3e-3 < sway[0] < 0.04
    assert sway[2] < 4e-3


@pytest.mark.parametrize("gait", ["walk", "run", "sprint", "backward", "side_step_right", "stairs"])
def test_feet_stay_within_the_reach_of_the_legs(gait: str) -> None:
    motion = walked(gait, STAIRS if gait == "stairs" else None)
    time_s = np.arange(0.0, motion.duration_s, 0.01)
    hip = motion.torso.at(time_s)[0]
    for foot in (motion.left_foot, motion.right_foot):
        assert np.linalg.norm(foot.at(time_s)[0] - hip, axis=1).max() < 1.5 * motion.person.leg_length_m


def test_walkers_have_a_foot_on_the_ground_and_runners_fly() -> None:
    airborne = {}
    for gait in ("walk", "run"):
        motion = walked(gait)
        time_s = np.arange(4.0, motion.duration_s - 4.0, 0.005)
        standing = [
            ((time_s >= falls.begin_s[:, None]) & (time_s < falls.end_s[:, None])).any(axis=0)
            for falls in motion.footfalls.values()
        ]
        airborne[gait] = (~np.logical_or(*standing)).mean()
    assert airborne["walk"] < 0.1
    assert airborne["run"] > 0.12


def test_a_heel_strike_shakes_the_foot_by_several_g_and_has_gone_at_mid_stance() -> None:
    motion = walked("walk")
    falls = motion.footfalls["left_foot"]
    landing = (falls.begin_s[2:-2, None] + np.linspace(0.0, 0.05, 60)).ravel()
    stance = 0.5 * (falls.begin_s[2:-2] + falls.end_s[2:-2])
    shaken = np.linalg.norm(acceleration(motion.left_foot, landing), axis=1).reshape(-1, 60).max(axis=1)
    assert 20.0 < np.median(shaken) < 120.0
    assert np.linalg.norm(acceleration(motion.left_foot, stance), axis=1).max() < 1.5


def test_feet_turn_in_opposite_directions_while_they_stand() -> None:
    person = replace(Person(), stance_turn_rad_s=0.1)
    motion = walked("walk", person=person)
    rates = {}
    for place, foot in (("left_foot", motion.left_foot), ("right_foot", motion.right_foot)):
        strides = foot.strides
        rates[place] = float(np.mean(turn_rate(foot, strides.end_s[1:-2])[:, 2]))
    assert rates["right_foot"] > 0.05
    assert rates["left_foot"] < -0.05


def test_steps_differ_from_each_other_and_left_from_right() -> None:
    person = replace(Person(), asymmetry=0.05, time_variability=0.02)
    falls = walked("walk", [[0, 0, 0], [60, 0, 0]], person=person).footfalls
    begins = np.sort(np.concatenate([falls[place].begin_s[2:-2] for place in falls]))
    steps = np.diff(begins)
    assert 0.01 < np.std(steps[::2]) / np.mean(steps) < 0.06
    assert abs(np.mean(steps[::2]) - np.mean(steps[1::2])) / np.mean(steps) == pytest.approx(0.1, abs=0.03)


def test_stairs_are_climbed_riser_by_riser() -> None:
    motion = walked("stairs", STAIRS)
    heights = np.unique(np.round([z for f in motion.footfalls.values() for z in f.place_m[:, 2]], 6))
    np.testing.assert_allclose(np.diff(heights), 2.72 / 17, atol=1e-6)
    assert 0.14 < 2.72 / 17 < 0.2
    down = walked("stairs", STAIRS[::-1])
    assert down.truth().position_m[-1, 2] == pytest.approx(0.0)


def test_slopes_tilt_the_feet_and_slow_the_walker() -> None:
    slope = [[0.0, 0.0, 0.0], [20.0, 0.0, 4.0]]
    up, level = walked("walk", slope), walked("walk")
    assert up.duration_s > 1.2 * level.duration_s
    foot = up.left_foot
    middles = foot.strides.end_s[2:-2]
    pitch = foot.at(middles)[1].as_euler("ZYX")[:, 1]
    np.testing.assert_allclose(pitch, -np.arctan(0.2), atol=0.03)


def test_a_lift_carries_feet_and_torso_alike() -> None:
    legs = (Leg("lift", [[0, 0, 0], [0, 0, 9.0]]), Leg("stand", [[0, 0, 9.0]], 1.0))
    motion = move(Person(), Itinerary(legs), seed=1)
    time_s = np.arange(0.0, motion.duration_s, 0.01)
    foot, torso = (part.at(time_s)[0][:, 2] for part in (motion.left_foot, motion.torso))
    np.testing.assert_allclose(torso - torso[0], foot - foot[0], atol=5e-3)
    assert foot[-1] == pytest.approx(9.0, abs=2e-3)
    assert 0.5 < np.abs(acceleration(motion.left_foot, time_s, 0.01)[:, 2]).max() < 2.0


def test_a_quick_turn_faces_about_on_the_spot() -> None:
    legs = (Leg("turn", [[1, 2, 0]], facing_rad=np.pi), Leg("stand", [[1, 2, 0]], 1.0))
    motion = move(Person(), Itinerary(legs), seed=1)
    time_s = np.arange(0.0, motion.duration_s, 0.01)
    turned = yaw_of(motion.torso.at(time_s)[1])
    assert abs(turned[-1] - turned[0]) == pytest.approx(np.pi, abs=0.03)
    assert np.abs(np.gradient(turned, time_s)).max() > np.radians(100.0)
    assert np.linalg.norm(motion.truth().position_m[:, :2] - [1, 2], axis=1).max() < 0.1


@pytest.mark.parametrize(("gait", "height"), [("kneel", 0.58), ("prone", 0.13)])
def test_going_down_lowers_the_torso_and_rising_puts_the_feet_together(gait: str, height: float) -> None:
    legs = (Leg(gait, [[0, 0, 0]], 8.0), Leg("stand", [[0, 0, 0]], 1.0))
    motion = move(Person(), Itinerary(legs), seed=1)
    low = motion.torso.at(np.array([4.0]))[0][0, 2]
    assert low == pytest.approx(height * motion.person.belt_height_m, abs=0.02)
    ends = [foot.at(np.array([8.5]))[0][0] for foot in (motion.left_foot, motion.right_foot)]
    assert np.linalg.norm(ends[0] - ends[1]) == pytest.approx(motion.person.step_width_m, abs=0.01)
    assert motion.right_foot.at(np.array([4.0]))[1].as_euler("ZYX")[0, 1] > 0.8


@pytest.mark.parametrize(
    ("leg", "says"),
    [
        (lambda: Leg("hop", [[0, 0, 0], [1, 0, 0]]), "unknown gait"),
        (lambda: Leg("walk", [[0, 0, 0]]), "way-points"),
        (lambda: Leg("stand", [[0, 0, 0]]), "duration_s"),
        (lambda: Leg("turn", [[0, 0, 0]]), "facing_rad"),
        (lambda: Leg("lift", [[0, 0, 0]]), "two points"),
        (lambda: Leg("walk", [[0, 0, np.nan], [1, 0, 0]]), "finite"),
        (lambda: Leg("walk", [[0, 0, 0], [9, 0, 0]], speed_m_s=-1.0), "above zero"),
        (lambda: Itinerary(()), "at least one leg"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(leg, says: str) -> None:
    with pytest.raises(ConfigError, match=says) as error:
        leg()
    assert "\n" not in str(error.value)


def test_legs_must_join() -> None:
    legs = (Leg("walk", [[0, 0, 0], [5, 0, 0]]), Leg("walk", [[7, 0, 0], [9, 0, 0]]))
    with pytest.raises(ConfigError, match=r"leg 2 \(walk\) starts 2.0 m from"):
        move(Person(), Itinerary(legs), seed=1)


def test_each_foot_stands_on_its_own_side_with_its_toes_out() -> None:
    motion = walked("walk", person=replace(Person(), toe_out_rad=0.2))
    left, right = (motion.footfalls[place] for place in ("left_foot", "right_foot"))
    assert np.mean(left.place_m[:, 1]) == pytest.approx(0.5 * motion.person.step_width_m, abs=0.02)
    assert np.mean(right.place_m[:, 1]) == pytest.approx(-0.5 * motion.person.step_width_m, abs=0.02)
    assert np.mean(left.yaw_rad) == pytest.approx(0.2, abs=0.05)
    assert np.mean(right.yaw_rad) == pytest.approx(-0.2, abs=0.05)


def test_the_left_foot_swings_as_the_right_one_in_a_mirror() -> None:
    motion = walked("walk", [[0, 0, 0], [60, 0, 0]])
    rolls = {}
    for side, foot in ((1.0, motion.left_foot), (-1.0, motion.right_foot)):
        strides = foot.strides
        phase = np.linspace(0.35, 0.7, 30)
        time_s = strides.start_s[2:-2, None] + phase * (strides.end_s - strides.start_s)[2:-2, None]
        roll = foot.at(time_s.ravel())[1].as_euler("ZYX")[:, 2].reshape(time_s.shape).mean(axis=0)
        rolls[side] = roll
    assert np.abs(rolls[1.0]).max() > 0.05
    np.testing.assert_allclose(rolls[1.0], -rolls[-1.0], atol=0.03)
