"""Comparing results, sweeping over seeds and parameters, and the commands around them."""

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from bootprint.errors import ConfigError
from proving_ground.exercises.commands import run as run_command
from proving_ground.exercises.scoring.comparison import compare_results, read_result
from proving_ground.exercises.scoring.statistics import mean_of
from proving_ground.exercises.sweep import aggregate, combinations, parse_values, play_seed, sweep_locally


def result(errors: list[float], inside: list[float]) -> dict[str, object]:
    return {
        "soldiers": [
            {"soldier": f"a{n}", "position_error_p95_m": error, "inside_95_pct": share}
            for n, (error, share) in enumerate(zip(errors, inside, strict=True))
        ]
    }


def verdicts(first: dict[str, object], second: dict[str, object]) -> dict[str, str]:
    return {row["figure"]: row["verdict"] for row in compare_results(first, second)}


def test_an_interval_is_students() -> None:
    """n = 3, values 1, 2, 3: s = 1, t(0.975, 2) = 4.3027, half width 4.3027 / √3."""
    mean = mean_of([1.0, 2.0, 3.0])
    assert (mean.mean, mean.n) == (2.0, 3)
    assert mean.half_width == pytest.approx(4.30265 / 3**0.5, rel=1e-5)
    assert not mean.is_beyond_noise
    assert mean_of([1.0]).half_width is None


def test_what_everybody_suffers_is_worse_and_what_scatters_is_not() -> None:
    before = result([1.0, 2.0, 3.0], [95.0, 95.0, 95.0])
    worse = result([1.5, 2.6, 3.5], [90.0, 91.0, 89.0])
    assert verdicts(before, worse) == {
        "soldiers.position_error_p95_m": "worse",
        "soldiers.inside_95_pct": "worse",
    }
    assert verdicts(worse, before)["soldiers.position_error_p95_m"] == "better"
    scattered = result([2.0, 1.0, 3.1], [95.0, 95.0, 95.0])
    assert set(verdicts(before, scattered).values()) == {"same"}


def test_soldiers_are_paired_by_name_and_unknown_figures_left_out() -> None:
    before = result([1.0, 2.0, 3.0], [95.0, 95.0, 95.0])
    after = result([1.0, 2.0, 3.0], [95.0, 95.0, 95.0])
    after["soldiers"] = list(reversed(after["soldiers"]))  # type: ignore[call-overload]
    after["soldiers"][0]["position_error_p95_m"] = None  # type: ignore[index]
    row = compare_results(before, after)[0]
    assert (row["n"], row["first"], row["second"]) == (2, 1.5, 1.5)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{", ":1: not valid JSON"),
        ("[]", "no result of an exercise"),
        ('{"a": 1}', "no result of an exercise"),
    ],
)
def test_what_is_no_result_is_told_in_a_line(tmp_path: Path, text: str, expected: str) -> None:
    file = tmp_path / "result.json"
    file.write_text(text)
    with pytest.raises(ConfigError, match=expected):
        read_result(tmp_path)
    with pytest.raises(ConfigError, match="no such file"):
        read_result(tmp_path / "nowhere.json")


def test_parameters_span_a_grid() -> None:
    parameters = dict(parse_values(text) for text in ("net.loss=0,0.3", "hub.role=soldier"))
    assert parameters == {"net.loss": [0, 0.3], "hub.role": ["soldier"]}
    assert combinations(parameters) == [
        {"net.loss": 0, "hub.role": "soldier"},
        {"net.loss": 0.3, "hub.role": "soldier"},
    ]
    assert combinations({}) == [{}]
    with pytest.raises(ConfigError, match="want key=value,value"):
        parse_values("net.loss")


def test_figures_of_seeds_become_means_with_intervals() -> None:
    grid = [{"net.loss": 0.0}, {"net.loss": 0.5}]
    by_seed = {1: [{"age": 4.0}, {"age": 8.0}], 2: [{"age": 6.0}, {"age": None}]}
    rows = aggregate(grid, by_seed)  # type: ignore[arg-type]
    assert [(row["net.loss"], row["n"], row["mean"]) for row in rows] == [(0.0, 2, 5.0), (0.5, 1, 8.0)]
    assert rows[1]["half_width_95"] is None


def test_a_sweep_plays_what_a_seed_plays_alone_and_loss_shows_in_it() -> None:
    grid = [{"net.loss": 0.0}, {"net.loss": 0.3}]
    shares: list[float] = []
    found = sweep_locally("four-walks", [1], grid, workers=1, on_done=shares.append)
    assert found == {1: play_seed("four-walks", 1, grid)}
    assert shares == [1.0]
    clear, lossy = found[1]
    assert clear["position_error_p95_m"] == lossy["position_error_p95_m"]
    # Ages would not do: a net that loses frames sends more of them, and who is missing has no age.
    assert float(lossy["everyone_added_error_p95_m"] or 0.0) > float(
        clear["everyone_added_error_p95_m"] or 0.0
    )


@pytest.fixture
def app() -> typer.Typer:
    app = typer.Typer()
    run_command.add_to(app)
    return app


def test_commands_compare_two_reports(app: typer.Typer, tmp_path: Path) -> None:
    for name, errors in (("before", [1.0, 2.0, 3.0]), ("after", [2.0, 3.1, 4.0])):
        (tmp_path / name).mkdir()
        (tmp_path / name / "result.json").write_text(json.dumps(result(errors, [95.0] * 3)))
    done = CliRunner().invoke(
        app, ["compare", str(tmp_path / "before"), str(tmp_path / "after"), "--json", "-"]
    )
    assert done.exit_code == 0
    rows = {row["figure"]: row for row in json.loads(done.stdout)}
    assert rows["soldiers.position_error_p95_m"]["verdict"] == "worse"


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["run", "four-walks", "--mode", "inprocess", "--speed", "2"], "only for --mode processes"),
        (["run", "four-walks", "--mode", "inprocess", "--serial", "pty"], "needs --mode processes"),
        (["run", "four-walks", "--serial", "pty", "--speed", "2"], "--speed must be 1"),
        (["run", "four-walks", "--set", "net.loss=0,1"], "one value to run with"),
        (["run", "four-walks", "--duration", "-1"], "positive number of seconds"),
    ],
)
def test_wrong_arguments_are_told_before_anything_runs(
    app: typer.Typer, tmp_path: Path, arguments: list[str], expected: str
) -> None:
    done = CliRunner().invoke(app, [*arguments, "--report", str(tmp_path)])
    assert isinstance(done.exception, ConfigError)
    assert expected in str(done.exception)
