"""When warnings begin, last and end: spells of probability in, messages out."""

from collections.abc import Iterable
from itertools import pairwise

from bootprint.awareness import FriendlyWarning, Reason
from bootprint.messages import TrackState
from sa_hub.awareness.danger import Place
from sa_hub.awareness.settings import WarningSettings
from sa_hub.awareness.warner import Danger, FriendlyWarner

S = 1_000_000_000
HALF = S // 2


def danger(probability: float, reason: Reason = "in_aim", state: TrackState = "fresh") -> Danger:
    """A friendly 30 m to the east."""
    return Danger("a2", Place(30.0, 0.0, 2.0), {reason: probability}, state, 1.0, None)


def told(dangers: Iterable[Danger], **options: float) -> list[tuple[float, FriendlyWarning]]:
    """What is told of a friendly whose danger is given for every half second, and when."""
    warner = FriendlyWarner("a1", WarningSettings(**options))  # type: ignore[arg-type]
    return [
        (step / 2, warning)
        for step, each in enumerate(dangers)
        for warning in warner.judge([each], step * HALF)
    ]


def test_a_warning_begins_at_once_is_repeated_and_ends_when_held() -> None:
    warnings = told([danger(0.0)] * 2 + [danger(0.3)] * 16 + [danger(0.0)] * 10)
    assert [(at_s, warning.reasons) for at_s, warning in warnings] == [
        (1.0, ("in_aim",)),
        (6.0, ("in_aim",)),
        (10.0, ()),
    ]
    first, _, last = (warning for _, warning in warnings)
    assert (first.soldier, first.friendly, first.distance_m, first.time_ns) == ("a1", "a2", 30.0, S)
    assert (first.probability_pct, round(first.azimuth_rad, 3)) == (30.0, 1.571)
    assert last.is_over
    assert not first.is_over


def test_a_probability_that_wavers_about_the_limit_does_not_flicker() -> None:
    wavering = [danger(0.11 if step % 6 == 0 else 0.06) for step in range(9)]
    assert [warning.reasons for _, warning in told(wavering)] == [("in_aim",)]
    gaps = [danger(0.2 if step % 3 == 0 else 0.0) for step in range(10)]
    assert [warning.reasons for _, warning in told(gaps)] == [("in_aim",)]


def test_below_the_limit_nothing_begins() -> None:
    assert told([danger(0.09)] * 30) == []


def test_people_who_stay_near_are_familiar_after_a_minute_and_news_again_after_as_long() -> None:
    company = [danger(1.0, "near")] * 200
    away = [danger(0.0, "near")] * 122
    warnings = [(at_s, w.reasons) for at_s, w in told([*company, *away, danger(1.0, "near")])]
    changes = [each for before, each in pairwise([(0.0, ()), *warnings]) if each[1] != before[1]]
    assert changes == [(0.0, ("near",)), (60.0, ()), (161.0, ("near",))]


def test_what_a_weapon_points_at_never_becomes_familiar() -> None:
    assert not told([danger(1.0, "in_aim")] * 400)[-1][1].is_over
    assert told([danger(1.0, "in_facing")] * 400)[-1][1].is_over


def test_a_companion_who_falls_silent_is_warned_of() -> None:
    together = [danger(1.0, "near")] * 130
    silent = [danger(1.0, "near", "stale")] * 4
    warnings = told([*together, *silent])
    assert warnings[-2][1].is_over
    assert (warnings[-1][0], warnings[-1][1].reasons, warnings[-1][1].state) == (65.0, ("near",), "stale")


def test_a_new_reason_or_state_is_told_at_once() -> None:
    both = Danger("a2", Place(9.0, 0.0, 2.0), {"near": 0.9, "in_aim": 0.8}, "fresh", 1.0, 2)
    warnings = told([danger(0.5), both, danger(0.5, state="lost")])
    assert [(w.reasons, w.state) for _, w in warnings] == [
        (("in_aim",), "fresh"),
        (("near", "in_aim"), "fresh"),
        (("near", "in_aim"), "lost"),
    ]
    assert warnings[1][1].floor == 2


def test_the_clock_set_back_ends_nothing_and_begins_nothing() -> None:
    warner = FriendlyWarner("a1", WarningSettings())
    assert [w.reasons for w in warner.judge([danger(1.0)], 1000 * S)] == [("in_aim",)]
    warner.set_back(600 * S)
    assert list(warner.judge([danger(1.0)], 400 * S + HALF)) == []
    assert [w.reasons for w in warner.judge([danger(0.0)], 402 * S)] == [()]
