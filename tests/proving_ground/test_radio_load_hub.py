"""Load tests of real hubs: what a straight walker costs, that runs repeat, and that a cheat is found out."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from bootprint.errors import ConfigError
from proving_ground.exercises.sweep import sweep_locally
from proving_ground.radio_load.command import register
from proving_ground.radio_load.contest import contest, play, row_of
from proving_ground.radio_load.hub_squad import HubSquad
from proving_ground.radio_load.load import Load
from proving_ground.radio_load.load_sweep import load_of, play_load_seed
from proving_ground.radio_load.squad_tracks import SquadTracks
from sa_hub.radio.budget import TokenBucket

SILENT = Load(soldiers=4, bitrate=60, feedback=False, duration_s=240.0)


def squad(duration_s: float, turn_every_s: float = 1e9) -> SquadTracks:
    """Four soldiers, 10 m apart, walking abreast at 1.3 m/s, to the right by 90° now and then."""
    time_s = np.arange(0.0, duration_s, 0.2)
    turns = np.floor(time_s / turn_every_s)
    velocity = 1.3 * np.column_stack([np.cos(-turns * np.pi / 2.0), np.sin(-turns * np.pi / 2.0)])
    way = np.concatenate([np.zeros((1, 2)), np.cumsum(0.2 * velocity[:-1], axis=0)])
    place = np.zeros((4, len(time_s), 3))
    place[..., :2] = way + np.array([[0.0, 10.0 * index] for index in range(4)])[:, None]
    return SquadTracks("abreast", 1, time_s, place, np.broadcast_to(velocity, (4, *velocity.shape)).copy())


def test_straight_walkers_are_shown_better_for_less() -> None:
    straight = HubSquad(SILENT, squad(240.0)).run()
    winding = HubSquad(SILENT, squad(240.0, turn_every_s=20.0)).run()
    # The budget is there to be spent: who walks as predicted is shown the better for it.
    assert straight.bits < winding.bits
    assert straight.errors.missing_pct < 20.0
    p95_m, winding_p95_m = straight.errors.percentile_m(95.0), winding.errors.percentile_m(95.0)
    assert p95_m is not None
    assert winding_p95_m is not None
    assert p95_m < winding_p95_m
    # What damping leaves in 12 s is 1.3·(12 − 60·(1 − e^(−0.2))) = 1.5 m, and as much for a cell.
    assert p95_m < 3.0


def test_a_run_can_be_repeated() -> None:
    tracks, load = squad(120.0, 15.0), Load(soldiers=4, loss=0.3, feedback=False, duration_s=120.0)
    first, again = (HubSquad(load, tracks).run() for _ in range(2))
    assert first.frames == again.frames
    np.testing.assert_array_equal(np.concatenate(first.errors.added_m), np.concatenate(again.errors.added_m))


def test_the_budget_is_kept_and_a_cheat_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    tracks, load = squad(120.0, 15.0), Load(soldiers=4, bitrate=40, feedback=False, duration_s=120.0)
    honest = HubSquad(load, tracks).run()
    assert not honest.budget_exceeded
    assert honest.bits <= 40 * 122
    monkeypatch.setattr(TokenBucket, "take", lambda *_args: True)
    assert HubSquad(load, tracks).run().budget_exceeded


def test_receivers_report_only_with_feedback() -> None:
    tracks = squad(60.0)
    assert play("bootprint", SILENT, tracks).feedback_bits == 0
    with_feedback = Load(soldiers=4, bitrate=60, tracks="building", duration_s=60.0)
    assert play("bootprint", with_feedback, tracks).feedback_bits > 0


def test_posts_that_tell_only_what_they_hear_make_foresight_needless() -> None:
    """Over three nets, for in one of them it is a matter of luck which frames are lost at the start."""
    tracks, p95_m, deaf_p95_m = squad(180.0, 15.0), list[float](), list[float]()
    for seed in (1, 2, 3):
        load = Load(soldiers=4, bitrate=60, loss=0.3, posts=True, foreseen=False, duration_s=180.0, seed=seed)
        heard, deaf = HubSquad(load, tracks).run(), HubSquad(replace(load, feedback=False), tracks).run()
        p95_m.append(heard.errors.percentile_m(95.0) or 0.0)
        deaf_p95_m.append(deaf.errors.percentile_m(95.0) or 0.0)
        # Three posts, each at most about a quarter of its rate: they report nobody.
        assert 0 < heard.feedback_bits < 3 * 0.4 * 60 * 180
        assert deaf.feedback_bits == 0
    assert 0.0 < np.mean(p95_m) < 0.5 * np.mean(deaf_p95_m)


def test_a_wider_link_costs_its_headers() -> None:
    tracks = squad(60.0)
    raw, udp = (
        HubSquad(Load(soldiers=4, bitrate=400, link=link, feedback=False), tracks).run()
        for link in ("raw", "udp")
    )
    assert min(size for _, size in udp.frames) >= 28 + min(size for _, size in raw.frames)


def test_others_are_squeezed_only_beyond_the_budget() -> None:
    tracks = squad(120.0)
    cot = play("cot-xml", SILENT, tracks)
    # 1.3 m/s: a message of some 670 bytes every 18.8 s, four soldiers.
    assert cot.bits / cot.duration_s == pytest.approx(4 * 670 * 8 / 18.8, rel=0.1)
    assert cot.budget_exceeded
    assert cot.squeezed is not None
    assert cot.squeezed.missing_pct > cot.errors.missing_pct
    vmf = play("vmf", SILENT, tracks)
    assert vmf.squeezed is None
    assert not vmf.budget_exceeded
    # Shown where last heard, at 1.3 m/s for up to 18.7 s and the way over the radio.
    p99_m = cot.errors.percentile_m(99.0)
    assert p99_m == pytest.approx(1.3 * 20.0, abs=1.5)


def test_a_row_has_the_contracts_columns() -> None:
    (row,) = contest(Load(soldiers=2, duration_s=30.0), ["vmf"], [1])
    contract = (
        "format bits_per_s bytes_per_report added_error_p50_m added_error_p95_m added_error_p99_m age_p95_s"
        " budget_exceeded"
    )
    assert list(row)[:8] == contract.split()
    assert row["bytes_per_report"] == 21.0


def test_rows_pool_their_seeds() -> None:
    tracks = squad(60.0)
    one = play("vmf", SILENT, tracks)
    p95_m = row_of("vmf", [one])["added_error_p95_m"]
    assert row_of("vmf", [one, one])["added_error_p95_m"] == pytest.approx(p95_m, rel=0.01)
    assert row_of("vmf", [one, one])["bits_per_s"] == pytest.approx(row_of("vmf", [one])["bits_per_s"])


def test_a_sweeps_job_gives_figures_for_every_combination() -> None:
    grid = [{"format": "vmf", "bitrate": rate, "duration_s": 40, "soldiers": 2} for rate in (50, 200)]
    slow, fast = play_load_seed("building", 1, grid)
    assert slow["bits_per_s"] == pytest.approx(50.0, rel=0.25)
    assert fast["bits_per_s"] == pytest.approx(200.0, rel=0.25)
    assert fast["floor_bits_per_s"] is not None


def test_the_sweep_runner_plays_load_tests() -> None:
    grid = [{"format": "vmf", "bitrate": 100, "duration_s": 40, "soldiers": 2}]
    shares: list[float] = []
    found = sweep_locally("building", [1, 2], grid, 1, shares.append, play_load_seed)
    assert found == {seed: play_load_seed("building", seed, grid) for seed in (1, 2)}
    assert shares == [0.5, 1.0]


@pytest.mark.parametrize("wrong", [{"bitrat": 3}, {"bitrate": "fast"}, {"loss": True}, {"format": "xml"}])
def test_a_sweeps_wrong_setting_is_said(wrong: dict[str, object]) -> None:
    with pytest.raises(ConfigError, match=r"want a value such as|known"):
        load_of("patrol", wrong)


def cli() -> typer.Typer:
    app = typer.Typer()
    register(app)
    return app


def test_the_command_writes_rows(tmp_path: Path) -> None:
    target = tmp_path / "rows.json"
    options = ["--tracks", "building", "--duration", "30", "--soldiers", "2", "--json", str(target)]
    result = CliRunner().invoke(cli(), ["radio", "loadtest", *options, "--format=vmf", "--format=mavlink2"])
    assert result.exit_code == 0, result.output
    assert [row["format"] for row in json.loads(target.read_text())] == ["vmf", "mavlink2"]
    assert "added error" in result.output


def test_the_command_refuses_what_it_does_not_know() -> None:
    for options, known in (
        (["--format", "cot"], "cot-xml"),
        (["--tracks", "patro"], "patrol"),
        (["--link", "vhf"], "vhf-"),
        (["--tag", "6"], "8 or 4"),
    ):
        result = CliRunner().invoke(cli(), ["radio", "loadtest", *options])
        assert isinstance(result.exception, ConfigError)
        assert known in str(result.exception)
