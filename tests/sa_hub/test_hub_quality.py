"""How well a net keeps the picture right, as reports show it, and the doubt that tracks carry for it."""

import math

import pytest

from bootprint.display import RADIUS_95, Held, free_sigma_m, shown
from bootprint.geodesy import moved_place
from bootprint.prediction import moved_m
from sa_hub.awareness.quality import NetQuality, innovation_m
from sa_hub.radio.content import Report
from support.hub_squad import ORIGIN, START_NS, Air, S, Walk, hub, link

HOME = ORIGIN.latitude_deg, ORIGIN.longitude_deg


def report(at_s: float, east_m: float, east_m_s: float = 0.0) -> Report:
    """A report of a soldier on an east-west line."""
    latitude_deg, longitude_deg = moved_place(HOME, east_m, 0.0)
    return Report(1, START_NS + round(at_s * S), latitude_deg, longitude_deg, 1.0, east_m_s=east_m_s)


def test_an_innovation_is_what_the_prediction_missed() -> None:
    reached_m = moved_m(1.2, 0.0, 10.0)[0]
    assert innovation_m(report(0.0, 0.0, 1.2), report(10.0, reached_m)) == pytest.approx(0.0, abs=1e-3)
    assert innovation_m(report(0.0, 0.0, 1.2), report(10.0, 0.0)) == pytest.approx(reached_m, abs=1e-3)


def observed(quality: NetQuality, misses_m: range, late_s: float = 0.0) -> Held | None:
    """Reports every 10 s, each of them so far from where it was expected."""
    for miss_m in misses_m:
        arrived_ns = START_NS + round((10.0 + late_s) * S)
        quality.observe(report(0.0, 0.0), report(10.0, float(miss_m)), arrived_ns)
    return quality.held


def test_nothing_is_told_before_enough_was_heard() -> None:
    assert observed(NetQuality(), range(15)) is None
    assert observed(NetQuality(), range(16)) is not None


def test_what_95_percent_of_reports_did_not_exceed_is_held() -> None:
    held = observed(NetQuality(), range(1, 65))
    assert held is not None
    # The 61st of 64 is the first that 95 % do not exceed.
    assert held.sigma_m == pytest.approx(61.0 / RADIUS_95, rel=1e-4)
    assert held.silence_s == 10.0


def test_what_happened_while_a_report_was_on_its_way_counts_as_free() -> None:
    quality = NetQuality()
    for _ in range(16):
        observed(quality, range(1), late_s=4.0)
    assert quality.held is not None
    assert quality.held.sigma_m == pytest.approx(free_sigma_m(4.0), rel=1e-3)
    assert quality.held.silence_s == 14.0


def test_old_reports_are_forgotten() -> None:
    quality = NetQuality()
    observed(quality, range(100, 164))
    held = observed(quality, range(1, 65))
    assert held is not None
    assert held.sigma_m == pytest.approx(61.0 / RADIUS_95, rel=1e-4)


@pytest.mark.parametrize("loss", [0.0, 0.25])
def test_walkers_are_inside_the_circle_that_their_tracks_tell(loss: float) -> None:
    net = link("squad", 4800)
    walks = {f"a{n}": Walk(east_m=15.0 * n, turn_deg=40.0 + 37.0 * n) for n in range(1, 6)}
    air = Air({name: hub(name, net) for name in walks}, loss=loss, seed=11)
    inside: list[bool] = []
    free: list[float] = []
    told: list[float] = []

    def look(now_ns: int) -> None:
        if now_ns % S or now_ns < START_NS + 90 * S:
            return
        for (receiver, soldier), track in air.tracks.items():
            if receiver == soldier:
                continue
            view = shown(track, now_ns)
            east_m, north_m, _, _ = walks[soldier].at((now_ns - START_NS) / S)
            offset_m = math.hypot(
                (view.longitude_deg - ORIGIN.longitude_deg) * 56_891.0 - east_m,
                (view.latitude_deg - ORIGIN.latitude_deg) * 111_405.0 - north_m,
            )
            inside.append(offset_m <= view.radius_95_m)
            told.append(view.sigma_m)
            free.append(math.hypot(track.accuracy_m, free_sigma_m(view.age_s)))

    air.run(240.0, walks, look)
    assert all(track.held_m is not None for (who, of), track in air.tracks.items() if who != of)
    assert len(inside) > 2000
    assert sum(inside) / len(inside) > 0.93
    assert sum(told) < 0.97 * sum(free)
