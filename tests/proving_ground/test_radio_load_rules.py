"""Others' update rules, against intervals worked out by hand from their sources."""

import itertools
import math
from collections.abc import Callable, Iterable

import pytest

from proving_ground.radio_load.formats.format import Moment, Rule
from proving_ground.radio_load.formats.rules import AtakDynamic, DeadReckoning, FixedInterval, SmartDistance

PERIOD_S = 0.2


def straight(speed_m_s: float, duration_s: float) -> list[Moment]:
    """A walk to the east at constant speed."""
    return [
        Moment(step * PERIOD_S, speed_m_s * step * PERIOD_S, 0.0, 0.0, speed_m_s, 0.0)
        for step in range(round(duration_s / PERIOD_S))
    ]


def spoken_s(rule: Rule, walk: Iterable[Moment]) -> list[float]:
    return [moment.time_s for moment in walk if rule.due(moment)]


def gaps_s(times_s: list[float]) -> list[float]:
    return [after - before for before, after in itertools.pairwise(times_s)]


@pytest.mark.parametrize(
    ("speed_m_s", "interval_s"),
    [
        (0.0, 30.0),  # standing
        (0.4, 30.0),  # below a mile an hour is standing
        (1.3, 18.735),  # 20 − 18·(0.44704 + 100·(1.3 − 0.44704)/12.96416)/100
        (13.5, 2.0),  # above thirty miles an hour
    ],
)
def test_atak_reports_the_less_often_the_slower(speed_m_s: float, interval_s: float) -> None:
    rule = AtakDynamic(number=1)
    assert rule.interval_s(speed_m_s) == pytest.approx(interval_s, abs=0.001)
    gaps = gaps_s(spoken_s(rule, straight(speed_m_s, 400.0)))
    assert all(interval_s - 1e-6 <= gap <= interval_s + PERIOD_S for gap in gaps)


def test_atak_does_not_see_a_turn_but_a_change_of_speed() -> None:
    walk = straight(1.3, 120.0)
    turned = [
        moment._replace(east_m=78.0, north_m=moment.east_m - 78.0, east_m_s=0.0, north_m_s=1.3)
        if moment.time_s >= 60.0
        else moment
        for moment in walk
    ]
    assert spoken_s(AtakDynamic(1), turned) == spoken_s(AtakDynamic(1), walk)
    ran_off = [moment._replace(east_m_s=4.5) if moment.time_s >= 50.0 else moment for moment in walk]
    assert 50.0 in spoken_s(AtakDynamic(1), ran_off)


@pytest.mark.parametrize(
    ("speed_m_s", "interval_s"),
    [
        (1.3, 300.0),  # 100 m are gone after 77 s, but five minutes must pass
        (0.2, 500.0),  # after five minutes only 60 m are gone
        (0.0, 3600.0),
    ],
)
def test_meshtastic_wants_distance_and_time(speed_m_s: float, interval_s: float) -> None:
    gaps = gaps_s(spoken_s(SmartDistance(3), straight(speed_m_s, 2.2 * interval_s)))
    assert gaps
    assert gaps == pytest.approx([interval_s] * len(gaps), abs=1.01 * PERIOD_S)


def test_dis_lets_a_straight_walker_be_heard_by_heartbeat_only() -> None:
    gaps = gaps_s(spoken_s(DeadReckoning(2), straight(1.3, 60.0)))
    assert gaps == pytest.approx([5.0] * len(gaps))
    assert len(gaps) >= 10


def test_dis_reports_a_turn_of_three_degrees_and_a_metre() -> None:
    def bent(by_deg: float) -> list[Moment]:
        east, north = 1.3 * math.cos(math.radians(by_deg)), 1.3 * math.sin(math.radians(by_deg))
        return [
            Moment(
                one.time_s, 26.0 + east * (one.time_s - 20.0), north * (one.time_s - 20.0), 0.0, east, north
            )
            if one.time_s >= 20.0
            else one
            for one in straight(1.3, 30.0)
        ]

    assert 20.0 in spoken_s(DeadReckoning(2), bent(4.0))
    assert 20.0 not in spoken_s(DeadReckoning(2), bent(2.0))
    # Stopping without turning: at 1.3 m/s the prediction runs a metre ahead after 0.77 s.
    stopped = [
        Moment(one.time_s, 26.0, 0.0, 0.0, 0.0, 0.0) if one.time_s >= 20.0 else one
        for one in straight(1.3, 30.0)
    ]
    after = [time_s for time_s in spoken_s(DeadReckoning(2), stopped) if time_s > 20.0]
    last = max(time_s for time_s in spoken_s(DeadReckoning(2), stopped) if time_s <= 20.0)
    assert after[0] == pytest.approx(min(20.8, last + 5.0))


@pytest.mark.parametrize(
    "make", [AtakDynamic, SmartDistance, DeadReckoning, lambda n: FixedInterval(30.0, n)]
)
def test_devices_do_not_all_speak_at_once(make: Callable[[int], Rule]) -> None:
    firsts = [spoken_s(make(number), straight(0.0, 40.0))[0] for number in range(1, 9)]
    assert len(set(firsts)) == 8


def test_a_fixed_interval_is_kept_on_average() -> None:
    times = spoken_s(FixedInterval(1.3, 4), straight(1.0, 260.2))
    assert len(times) == 200
