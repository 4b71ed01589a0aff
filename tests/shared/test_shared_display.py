"""What is shown of a track: where, how sure, and in which words."""

import math

import pytest

from bootprint.display import AGES, Held, age_words, free_sigma_m, shown, sigma_m
from bootprint.geodesy import ground_offset
from bootprint.messages import Track, TrackState
from bootprint.prediction import moved_m

S = 1_000_000_000
TRACK = Track(
    time_ns=1_790_000_000 * S,
    soldier="a1",
    number=1,
    state="fresh",
    latitude_deg=59.35,
    longitude_deg=18.07,
    height_m=52.0,
    accuracy_m=2.0,
    east_velocity_m_s=1.0,
    north_velocity_m_s=-0.5,
    floor=1,
)


def at(age_s: float) -> int:
    """A time so long after the track's report."""
    return TRACK.time_ns + round(age_s * S)


@pytest.mark.parametrize("age_s", [-0.5, 0.0, 3.0, 30.0, 500.0])
def test_the_place_is_the_reports_moved_on_as_senders_predict(age_s: float) -> None:
    view = shown(TRACK, at(age_s))
    offset = ground_offset((59.35, 18.07), (view.latitude_deg, view.longitude_deg))
    assert offset == pytest.approx(moved_m(1.0, -0.5, age_s), abs=1e-4)
    assert (view.height_m, view.floor, view.age_s) == (52.0, 1, age_s)


def test_a_new_report_is_as_sure_as_its_sender() -> None:
    assert shown(TRACK, at(0.0)).sigma_m == 2.0
    assert shown(TRACK, at(0.0)).radius_95_m == pytest.approx(2.0 * 2.4477, abs=1e-3)
    assert shown(TRACK, at(-1.0)).sigma_m == 2.0


def test_doubt_grows_at_a_walkers_pace_and_then_more_slowly() -> None:
    # 0.6 m/s for a second; after 200 s a factor of root two less; four times as long, then twice as much at last.
    assert free_sigma_m(1.0) == pytest.approx(0.6, rel=0.01)
    assert free_sigma_m(200.0) == pytest.approx(120.0 / math.sqrt(2.0))
    assert free_sigma_m(4e6) / free_sigma_m(1e6) == pytest.approx(2.0, rel=1e-3)
    assert shown(TRACK, at(10.0)).sigma_m == pytest.approx(math.hypot(2.0, free_sigma_m(10.0)))


def test_what_the_net_holds_bounds_the_doubt_until_a_silence_longer_than_ever() -> None:
    held = Held(sigma_m=2.0, silence_s=30.0)
    assert sigma_m(1.0, 1.0, held) == pytest.approx(math.hypot(1.0, free_sigma_m(1.0)))
    assert sigma_m(1.0, 30.0, held) == pytest.approx(math.hypot(1.0, 2.0))
    assert sigma_m(1.0, 45.0, held) == pytest.approx(math.hypot(1.0, 1.0 + 0.5 * free_sigma_m(45.0)))
    assert sigma_m(1.0, 60.0, held) == pytest.approx(math.hypot(1.0, free_sigma_m(60.0)))
    assert sigma_m(1.0, 90.0, held) == sigma_m(1.0, 90.0)
    assert sigma_m(1.0, 20.0, held) < sigma_m(1.0, 20.0)


def test_the_tracks_own_fields_tell_what_the_net_holds() -> None:
    fields = {name: getattr(TRACK, name) for name in TRACK.__struct_fields__}
    held = Track(**(fields | {"held_m": 1.5, "held_s": 20.0}))
    assert shown(held, at(20.0)).sigma_m == pytest.approx(math.hypot(2.0, 1.5))


@pytest.mark.parametrize(
    ("told", "age_s", "state"),
    [
        ("fresh", 10.0, "fresh"),
        ("fresh", 75.0, "stale"),
        ("fresh", 180.0, "lost"),
        ("stale", 10.0, "stale"),
        ("lost", 100.0, "lost"),
    ],
)
def test_the_state_is_the_worse_of_what_the_hub_said_and_the_age(
    told: TrackState, age_s: float, state: TrackState
) -> None:
    fields = {name: getattr(TRACK, name) for name in TRACK.__struct_fields__}
    assert shown(Track(**(fields | {"state": told})), at(age_s), AGES).state == state


@pytest.mark.parametrize(
    ("state", "age_s", "words"),
    [
        ("fresh", -0.2, "now"),
        ("fresh", 1.9, "now"),
        ("fresh", 12.7, "12 s ago"),
        ("fresh", 65.0, "1:05 ago"),
        ("stale", 80.0, "silent for 1:20"),
        ("lost", 220.0, "lost for 3:40"),
        ("lost", 3723.0, "lost for 1:02:03"),
        ("lost", 40.0, "lost for 40 s"),
    ],
)
def test_words_for_people(state: TrackState, age_s: float, words: str) -> None:
    assert age_words(state, age_s) == words
