"""`bootprint evaluate` through the real estimator, on walks whose every position is known."""

import json
import sys
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from bootprint.cli import main
from proving_ground.evaluation.command import show
from support.recorded import recorded_data
from support.walking_foot import STRIDE_M, walking_foot, write_run_folder

COLUMNS = """
run kind method duration_s distance_m rmse_m p95_m final_m final_pct distance_error_pct height_final_m
height_rmse_m heading_drift_deg_per_min inside_95_pct nees floors_right_pct samples us_per_sample strides
strides_true
"""
WALK = walking_foot(strides=20)


@pytest.fixture(scope="module")
def walk_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_run_folder(tmp_path_factory.mktemp("walks") / "square", {"right_foot": WALK})


def bootprint(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    """The command as typed; returns its exit code."""
    monkeypatch.setattr(sys, "argv", ["bootprint", "evaluate", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def rows_of(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: object) -> Any:
    assert bootprint(monkeypatch, *arguments, "--json", "-") == 0
    return json.loads(capsys.readouterr().out)


def test_a_known_walk_is_found_again(
    walk_folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (row,) = rows_of(monkeypatch, capsys, walk_folder)
    assert list(row) == COLUMNS.split()
    assert (row["run"], row["kind"], row["samples"]) == ("square", "foot", len(WALK.time_s))
    assert row["duration_s"] == pytest.approx(WALK.time_s[-1])
    assert row["distance_m"] == pytest.approx(20 * STRIDE_M, rel=0.002)
    assert row["rmse_m"] < 0.25
    assert row["final_pct"] == pytest.approx(100.0 * row["final_m"] / row["distance_m"])
    assert abs(row["distance_error_pct"]) < 2.0
    assert row["height_final_m"] < 0.3
    assert abs(row["heading_drift_deg_per_min"]) < 5.0
    assert row["strides"] == 20
    assert row["strides_true"] is None  # a run folder's truth is the person's, not the foot's
    assert 0.0 < row["us_per_sample"] < 1000.0
    assert row["nees"] > 0.0


def test_all_methods_have_a_row_each(
    walk_folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from pdr_engine.foot import METHODS

    rows = rows_of(monkeypatch, capsys, walk_folder, "--method", "all")
    assert [row["method"] for row in rows] == list(METHODS)
    (named,) = rows_of(monkeypatch, capsys, walk_folder, "--method", METHODS[-1])
    assert named["rmse_m"] == rows[-1]["rmse_m"]


def test_two_feet_have_a_row_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    feet = {"left_foot": walking_foot(8), "right_foot": walking_foot(8, seed=1, offset_m=-0.2)}
    folder = write_run_folder(tmp_path / "pair", feet)
    rows = rows_of(monkeypatch, capsys, folder, "--kind", "foot")
    assert [(row["run"], row["kind"]) for row in rows] == [("pair/left", "foot"), ("pair/right", "foot")]
    rows = rows_of(monkeypatch, capsys, folder)
    assert {"pair/left", "pair/right"} <= {row["run"] for row in rows}
    assert {row["kind"] for row in rows} == {"dual"}


def test_only_two_feet_are_smoothed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    feet = {"left_foot": walking_foot(8), "right_foot": walking_foot(8, seed=1, offset_m=-0.2)}
    folder = write_run_folder(tmp_path / "pair", feet)
    rows = rows_of(monkeypatch, capsys, folder, "--smoothed", "--method", "all")
    assert {"pair/left", "pair/right", "pair/fused"} == {row["run"] for row in rows}
    assert "joint-18" not in {row["method"] for row in rows}
    assert bootprint(monkeypatch, folder, "--kind", "foot", "--smoothed") == 2
    assert "two feet" in capsys.readouterr().err


def test_start_alignment_is_never_better_than_the_best_fit(
    walk_folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (best,) = rows_of(monkeypatch, capsys, walk_folder)
    (start,) = rows_of(monkeypatch, capsys, walk_folder, "--align", "start")
    assert start["rmse_m"] > best["rmse_m"]
    assert start["distance_error_pct"] == best["distance_error_pct"]


def test_table_summary_plots_and_json_file(
    walk_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code = bootprint(monkeypatch, walk_folder, "--plot", tmp_path / "plots", "--json", tmp_path / "rows.json")
    assert code == 0
    out = capsys.readouterr().out
    assert "square" in out
    assert "n 1" in out
    (row,) = json.loads((tmp_path / "rows.json").read_text())
    assert f"{row['rmse_m']:.3f}" in out
    assert "…" not in out
    (picture,) = (tmp_path / "plots").glob("*.png")
    assert picture.name == f"square-{row['method']}.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size > 20_000


def test_a_run_without_truth_has_a_row_and_a_picture(
    walk_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "blind"
    folder.mkdir()
    (folder / "right_foot.csv").write_bytes((walk_folder / "right_foot.csv").read_bytes())
    (row,) = rows_of(monkeypatch, capsys, folder, "--plot", tmp_path)
    assert (row["distance_m"], row["rmse_m"], row["nees"], row["strides_true"]) == (None, None, None, None)
    assert row["strides"] == 20
    assert len(list(tmp_path.glob("blind*.png"))) == 1


def test_a_narrow_terminal_gets_the_most_telling_columns_whole() -> None:
    row: dict[str, str | float | int | None] = dict.fromkeys(COLUMNS.split(), 12.345)
    row |= {"run": "somewhere", "kind": "foot", "method": "adaptive"}
    for width, seen in ((200, ("RMSE m", "strides", "°/min")), (60, ("RMSE m", "end %"))):
        console = Console(file=StringIO(), force_terminal=True, width=width)
        show([row], console)
        table = console.file.getvalue().splitlines()[:2]  # type: ignore[attr-defined]
        assert all(heading in table[0] for heading in seen)
        assert "…" not in "".join(table)
        assert ("strides" in table[0]) == (width == 200)


def test_a_camera_s_recorded_motions_make_a_row_but_not_by_a_foot_s_method(
    walk_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    camera = tmp_path / "camera"
    camera.mkdir()
    motion = "start_time_s,time_s,tx_m,ty_m,tz_m,rx_rad,ry_rad,rz_rad\n0,0.1,0.1,0,0,0,0,0\n"
    (camera / "camera_motion.csv").write_text(motion)
    assert bootprint(monkeypatch, walk_folder, camera, "--json", "-") == 0
    captured = capsys.readouterr()
    rows = {row["run"]: row["kind"] for row in json.loads(captured.out)}
    assert rows == {"square": "foot", "camera": "camera"}
    assert bootprint(monkeypatch, camera, "--method", "shoe") == 2
    assert "no estimator for kind camera" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["nowhere"], "nowhere: no such file"),
        (["{walk}", "--method", "dowsing"], "dowsing"),
        (["{walk}", "--kind", "body"], "no run of kind body"),
        (["{walk}", "--json", "{walk}"], "cannot be written"),
        (["{walk}", "--plot", "{walk}/right_foot.csv"], "cannot be made"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(
    walk_folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    complaint: str,
) -> None:
    code = bootprint(monkeypatch, *(argument.format(walk=walk_folder) for argument in arguments))
    captured = capsys.readouterr()
    assert code == 2
    assert complaint in captured.err
    assert len(captured.err.strip().splitlines()) == 1
    assert captured.out == ""


@pytest.mark.recorded
def test_recorded_walks_of_every_kind(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    data = recorded_data()
    names = ["foot-gcp/SensorConnectData_45_LLIO.mat", "xio-gait", "gaitmap-example", "dualfoot-fgo"]
    rows = {row["run"]: row for row in rows_of(monkeypatch, capsys, *(data / name for name in names))}
    surveyed = rows["SensorConnectData_45_LLIO"]
    assert surveyed["distance_m"] == pytest.approx(90.39, abs=0.01)
    assert (surveyed["strides"], surveyed["strides_true"]) == (74, 74)
    assert surveyed["rmse_m"] < 0.64  # the weakest mean among the published systems on these walks
    loop = rows["short_walk"]
    assert loop["final_m"] < 0.5
    assert (loop["rmse_m"], loop["distance_m"]) == (None, None)
    assert rows["gaitmap-example/left"]["distance_m"] == pytest.approx(40.8, abs=0.5)
    assert rows["gaitmap-example/right"]["rmse_m"] < 1.0
    # Better than the authors' causal filter with step constraints: 1.61 m left, 1.73 m right.
    assert rows["dualfoot-fgo/left"]["rmse_m"] < 1.61
    assert rows["dualfoot-fgo/right"]["rmse_m"] < 1.73
    for row in rows.values():
        if row["strides_true"] is not None:
            assert row["strides_true"] == pytest.approx(row["strides"], abs=2)
