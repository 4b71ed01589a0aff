"""Camera folders through `bootprint evaluate`: right on rendered pairs, and one line on whatever is damaged."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from bootprint.cli import build_app
from bootprint.errors import RecordingError
from proving_ground.evaluation.camera.recorded_run import walk_camera
from proving_ground.evaluation.evaluate import evaluate_task, methods_of, plan
from proving_ground.sensors import Mounting, write_camera_folder
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.camera_folder import pairs, projections
from support.camera_rooms import Swaying, room
from support.moving import Straight
from support.stereo_walks import SMALL

WALK = Swaying(Straight((-3.5, -1.0, 1.5), (1.3, 0.2, 0.0)), 0.1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three seconds of a rendered walk."""
    rng = np.random.default_rng(2)
    path = tmp_path_factory.mktemp("camera") / "walk"
    return write_camera_folder(path, room(), SMALL, WALK, Mounting(), 3.0, rng)


@pytest.fixture
def damaged(folder: Path, tmp_path: Path) -> Path:
    """A copy to damage."""
    return Path(shutil.copytree(folder, tmp_path / "walk"))


def test_a_folder_is_scored_in_the_plane(folder: Path) -> None:
    (run,) = load_runs([folder.parent], "camera")
    (task,) = plan([run], None, methods_of(None))
    row = evaluate_task(task, "best-fit").row
    assert (row["run"], row["kind"], row["method"]) == ("walk", "camera", "key-frames")
    assert row["samples"] == 30
    assert row["duration_s"] == pytest.approx(2.9)
    # 1.3 and 0.2 m/s with a sway of 2 cm at 0.9 Hz, 2.9 s.
    assert row["distance_m"] == pytest.approx(2.9 * 1.315, rel=0.03)
    assert 0.0 < float(row["rmse_m"] or 9.0) < 0.03
    assert float(row["final_pct"] or 9.0) < 1.0
    assert abs(float(row["distance_error_pct"] or 9.0)) < 1.0
    assert (row["strides"], row["strides_true"]) == (None, None)


def test_a_camera_that_begins_tilted_is_scored_in_its_poses_plane(damaged: Path) -> None:
    """The first pose may be any: a frame that is turned by 40° about the camera's x axis scores the same."""
    poses = np.loadtxt(damaged / "poses.txt").reshape(-1, 3, 4)
    angle = np.radians(40.0)
    turn = np.array(
        [[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]], dtype=float
    )
    np.savetxt(damaged / "poses.txt", (turn @ poses).reshape(-1, 12))
    (task,) = plan(load_runs([damaged]), None, methods_of(None))
    assert float(evaluate_task(task, "best-fit").row["rmse_m"] or 9.0) < 0.03


def test_jpeg_and_colour_are_read(damaged: Path) -> None:
    from PIL import Image

    for side in ("image_l", "image_r"):
        for path in sorted((damaged / side).iterdir()):
            Image.open(path).convert("RGB").save(path.with_suffix(".jpg"), quality=95)
            path.unlink()
    walked = walk_camera(load_runs([damaged])[0])
    assert walked.verdicts == {"starting": 1}


def test_numbers_in_names_count_as_numbers(damaged: Path) -> None:
    """Names without leading zeros: 9.png comes before 10.png."""
    for side in ("image_l", "image_r"):
        for number, path in enumerate(sorted((damaged / side).iterdir())):
            path.rename(path.with_name(f"{number}.png"))
    (run,) = load_runs([damaged])
    assert run.stereo is not None
    assert [path.stem for path in run.stereo.right] == [str(number) for number in range(30)]


@pytest.mark.parametrize("colon", [":", " :"])
def test_a_calibrations_names_may_stand_close_to_the_numbers(damaged: Path, colon: str) -> None:
    path = damaged / "calib.txt"
    before = projections(path)
    path.write_text(path.read_text().replace(": ", colon), encoding="utf-8")
    np.testing.assert_array_equal(projections(path), before)


def test_pairs_without_sight_are_bridged_as_one_went(damaged: Path) -> None:
    """Ten black pairs: one second more at 1.3 m/s, as before."""
    from PIL import Image

    for side in ("image_l", "image_r"):
        for path in sorted((damaged / side).iterdir())[12:22]:
            Image.new("L", (SMALL.width_px, SMALL.height_px)).save(path)
    run = load_runs([damaged])[0]
    walked = walk_camera(run)
    assert walked.verdicts["dark"] == 10
    error = walked.track.position_m - (run.truth["camera"].position_m - run.truth["camera"].position_m[0])
    assert np.linalg.norm(error, axis=1).max() < 0.6
    assert np.linalg.norm(error[:12], axis=1).max() < 0.03


def test_nobodys_poses_give_a_row_without_figures(damaged: Path) -> None:
    (damaged / "poses.txt").unlink()
    (task,) = plan(load_runs([damaged]), None, methods_of(None))
    assert evaluate_task(task, "best-fit").row["rmse_m"] is None


def _spoil_image(folder: Path) -> None:
    (folder / "image_r" / "000004.png").write_bytes(b"\x89PNG no more")


def _other_size(folder: Path) -> None:
    from PIL import Image

    Image.new("L", (20, 20)).save(folder / "image_l" / "000004.png")


def _read_all(folder: Path) -> None:
    for run in load_runs([folder]):
        assert run.stereo is not None
        list(pairs(run.stereo))


DAMAGES = {
    "calib.txt: missing": lambda folder: (folder / "calib.txt").unlink(),
    "no line P1:": lambda folder: (folder / "calib.txt").write_text("P0: 1 0 0 0 0 1 0 0 0 0 1 0\n"),
    "P0: has 3 numbers": lambda folder: (folder / "calib.txt").write_text("P0: 1 2 3\nP1: 1 2 3\n"),
    "could not convert": lambda folder: (folder / "calib.txt").write_text("P0: a b c\nP1: 1 2 3\n"),
    "30 images in image_l/ but 29 in image_r/": lambda folder: (folder / "image_r" / "000003.png").unlink(),
    "no such folder": lambda folder: shutil.rmtree(folder / "image_r"),
    "2 poses for 30": lambda folder: (folder / "poses.txt").write_text("1 2\n3 4\n"),
    "12 finite numbers": lambda folder: (folder / "poses.txt").write_text(
        "nan " * 12 + ("\n" + "0 " * 12) * 29
    ),
    "000004.png: no image": _spoil_image,
    "000004.png: (20, 20) px": _other_size,
}


@pytest.mark.parametrize("words", DAMAGES)
def test_damage_is_named(damaged: Path, words: str) -> None:
    DAMAGES[words](damaged)
    with pytest.raises(RecordingError) as caught:
        _read_all(damaged)
    assert words in str(caught.value)


def test_the_command_prints_rows_and_says_what_is_damaged(folder: Path, damaged: Path) -> None:
    runner = CliRunner()
    result = runner.invoke(build_app(), ["evaluate", "--kind", "camera", "--json", "-", str(folder)])
    assert result.exit_code == 0
    (row,) = json.loads(result.stdout)
    assert row["kind"] == "camera"
    (damaged / "calib.txt").unlink()
    result = runner.invoke(build_app(), ["evaluate", str(damaged)])
    assert isinstance(result.exception, RecordingError)
