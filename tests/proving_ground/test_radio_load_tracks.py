"""Squad tracks: the same for the same seed, as many soldiers as asked for, without leaps that nobody makes."""

from pathlib import Path

import numpy as np
import pytest

from bootprint.errors import ConfigError, RecordingError
from proving_ground.radio_load.scenario_walks import turned
from proving_ground.radio_load.squad_tracks import SquadTracks, squad_tracks
from proving_ground.radio_load.telling import INDOORS, OUTDOORS, PERIOD_S, told
from support.recorded import recorded_data


def longest_step_m(tracks: SquadTracks) -> float:
    return float(np.linalg.norm(np.diff(tracks.place_m[..., :2], axis=1), axis=2).max())


def test_one_seed_gives_one_track() -> None:
    first, again, other = (squad_tracks("building", 9, seed, longest_s=60.0) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.place_m, again.place_m)
    np.testing.assert_array_equal(first.velocity_m_s, again.velocity_m_s)
    assert not np.allclose(first.place_m, other.place_m)


def test_more_soldiers_than_the_scenario_has_are_other_squads() -> None:
    tracks = squad_tracks("building", 20, 3, longest_s=300.0)
    assert tracks.place_m.shape == (20, 1500, 3)
    assert tracks.velocity_m_s.shape == (20, 1500, 2)
    # Nobody walks in somebody else's steps: all pairs are metres apart most of the time.
    ways = tracks.place_m[:, ::25, :2]
    apart = np.linalg.norm(ways[:, None] - ways[None], axis=3)
    assert np.median(apart[np.triu_indices(20, 1)], axis=1).min() > 0.5


def test_a_short_scenario_is_walked_there_and_back_without_a_leap() -> None:
    tracks = squad_tracks("straight-100m", 1, 1, longest_s=400.0)  # one way takes some 90 s
    assert tracks.duration_s == pytest.approx(400.0, abs=PERIOD_S + 1e-6)
    speeds = np.linalg.norm(np.diff(tracks.place_m[0, :, :2], axis=0), axis=1)
    assert np.mean(speeds > 1.2) < 0.002  # nobody walks 6 m/s; fixes jump now and then
    assert np.ptp(tracks.place_m[0, :, :2], axis=0).max() < 115.0
    assert np.linalg.norm(np.diff(tracks.place_m[0, ::25, :2], axis=0), axis=1).sum() > 300.0


def test_patrols_jump_only_when_a_fix_is_believed_again() -> None:
    tracks = squad_tracks("patrol", 4, 2, longest_s=1800.0)
    steps = np.linalg.norm(np.diff(tracks.place_m[..., :2], axis=1), axis=2)
    assert np.mean(steps > 1.2) < 0.002
    assert 1.1 < np.linalg.norm(tracks.velocity_m_s, axis=2).mean() < 1.6


@pytest.mark.parametrize("telling", [INDOORS, OUTDOORS])
def test_told_errors_are_as_large_as_said_and_wander(telling: object) -> None:
    still = np.zeros((9000, 3))
    errors = np.stack(
        [told(still, telling, np.random.default_rng(seed))[0][:, :2] for seed in range(60)]  # type: ignore[arg-type]
    )
    sigma = errors[:, ::500].std()
    assert sigma == pytest.approx(telling.error_m, rel=0.25)  # type: ignore[attr-defined]
    second = np.median(np.linalg.norm(errors[:, 5:] - errors[:, :-5], axis=2))
    assert second < 0.2 * sigma


def test_velocity_is_the_last_strides_mean_and_late() -> None:
    time_s = PERIOD_S * np.arange(300)
    walk = np.zeros((300, 3))
    walk[:, 0] = np.maximum(0.0, time_s - 20.0) * 1.5  # stands 20 s, then walks east
    _, velocity = told(walk, INDOORS, np.random.default_rng(1))
    assert np.all(velocity[:100] == 0.0)
    at = round(21.0 / PERIOD_S)  # half of the stride of 1 s that ended 0.5 s ago was walked
    assert velocity[at, 0] == pytest.approx(0.75, abs=0.25)
    np.testing.assert_allclose(velocity[120:].mean(axis=0), [1.5, 0.0], atol=0.03)


def test_turning_keeps_shape_and_height() -> None:
    walk = np.random.default_rng(1).normal(0.0, 5.0, (2, 10, 3))
    other = turned(walk, walk[0, 0], np.pi / 2.0, np.array([100.0, 50.0]))
    np.testing.assert_allclose(other[0, 0], [100.0, 50.0, walk[0, 0, 2]])
    np.testing.assert_allclose(
        np.linalg.norm(other[1, 3] - other[0, 7]), np.linalg.norm(walk[1, 3] - walk[0, 7])
    )
    # A quarter turn to the left takes east to north.
    step, turned_step = walk[0, 1] - walk[0, 0], other[0, 1] - other[0, 0]
    np.testing.assert_allclose(turned_step, [-step[1], step[0], step[2]], atol=1e-12)


def test_any_scenario_of_the_library_goes_by_its_name() -> None:
    assert squad_tracks("stairs-and-lift", 2, 1, longest_s=30.0).soldiers == 2


def test_unknown_tracks_name_the_nearest() -> None:
    with pytest.raises(ConfigError, match="did you mean 'patrol'"):
        squad_tracks("patrl", 4, 1)


def test_recorded_tracks_want_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("BOOTPRINT_DATA", raising=False)
    with pytest.raises(ConfigError, match="--data"):
        squad_tracks("recorded", 4, 1)
    with pytest.raises(ConfigError, match="no such folder"):
        squad_tracks("recorded", 4, 1, tmp_path / "nowhere")
    with pytest.raises(RecordingError, match="no recorded walks"):
        squad_tracks("recorded", 4, 1, tmp_path)


def test_way_points_become_walks(tmp_path: Path) -> None:
    lines = [f"{1000 * second}\tTYPE_WAYPOINT\t{1.2 * second}\t0.0" for second in range(0, 100, 8)]
    (tmp_path / "walk.txt").write_text("\n".join(["#\tstart", *lines]))
    tracks = squad_tracks("recorded", 2, 1, tmp_path, longest_s=200.0)
    speeds = np.linalg.norm(tracks.velocity_m_s, axis=2)
    assert np.median(speeds[speeds > 0.5]) == pytest.approx(1.2, abs=0.05)
    assert longest_step_m(tracks) < 1.2


@pytest.mark.recorded
def test_recorded_walks_are_joined_without_a_leap() -> None:
    tracks = squad_tracks("recorded", 12, 1, recorded_data())
    assert tracks.soldiers == 12
    assert tracks.duration_s > 900.0
    assert longest_step_m(tracks) < 1.2
