"""docs/foot-ins.md: made from findings, and every variant of the ablation is one that the navigator knows."""

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bootprint.errors import ConfigError
from pdr_engine.foot import METHODS, FootSettings
from proving_ground.evaluation.consistency import Consistency
from proving_ground.evaluation.foot import figures
from proving_ground.evaluation.foot.ablation import ABLATIONS, Variant, plain, rmse_of
from proving_ground.evaluation.foot.honesty import ClassHonesty
from proving_ground.evaluation.foot.motion_page import MotionFindings
from proving_ground.evaluation.foot.page import Findings, page
from proving_ground.performance.foot_benchmark import LIMITS, FootFigures
from sensor_gateway.recordings import load_runs
from support.recorded import recorded_data
from support.walking_foot import walking_foot, write_run_folder

ROOT = Path(__file__).parents[2]
COST = FootFigures(1000, 12, 1.0, 0.5, 50.0, 100.0, 0.5, 100.0)
_GOOD = Consistency(1.0, 100.0, 10, 1.0, 0.25, None, None)
_POOR = Consistency(5.0, 80.0, 10, 2.0, 0.75, 2.0, 80.0)
MOTION = MotionFindings(
    labels=(
        Counter({("crawling", "crawling"): 7, ("crawling", "walking"): 1}),
        Counter({("crawling", "crawling"): 5}),
    ),
    stairs={"up": Counter(stairs=14, walking=5)},
    directions={"one": Counter(forward=20, left=3)},
    honesty={
        "walking": ClassHonesty([_GOOD], None, None),
        "crawling": ClassHonesty([_POOR, _POOR], (4.0, 0.5), 77.5),
    },
    sets={"one": [_GOOD, _POOR]},
)
LARGEST_PICTURE = 150_000


@pytest.fixture(scope="module")
def square(tmp_path_factory: pytest.TempPathFactory) -> Path:
    feet = {
        "left_foot": walking_foot(10, seed=1, offset_m=0.2),
        "right_foot": walking_foot(10, seed=2, offset_m=0.2),
    }
    return write_run_folder(tmp_path_factory.mktemp("sets") / "pyshoe-vicon", feet)


@pytest.mark.parametrize("variant", [*ABLATIONS[1:], *map(plain, METHODS)], ids=lambda variant: variant.name)
def test_every_variant_is_known_and_changes_something(variant: Variant) -> None:
    assert variant.settings() != FootSettings()


def test_the_first_variant_is_the_default() -> None:
    assert ABLATIONS[0].settings() == FootSettings()


def test_a_variant_that_the_navigator_does_not_know_says_so() -> None:
    with pytest.raises(ConfigError, match="without wings"):
        Variant("without wings", {"filter": {"wings": 0}}).settings()


def test_a_variants_error_is_that_of_its_own_settings(square: Path) -> None:
    """Two feet, two errors; without any zero-velocity update they are lost."""
    runs = load_runs([square])
    blind = Variant("blind", {"detector": {"learned_sigma_m_s": 1e-9}})
    good, lost = rmse_of(ABLATIONS[0], runs), rmse_of(blind, runs)
    assert len(good) == len(lost) == 2
    assert max(good) < 0.15
    assert min(lost) > 10 * max(good)


def findings() -> Findings:
    """Two sets of three runs each, whose errors are known."""
    rows = [
        {
            "run": f"run-{k}",
            "method": method,
            "rmse_m": (k + 1) * (index + 1) / 100,
            "final_m": None,
            **dict.fromkeys(
                (
                    *("final_pct", "distance_error_pct", "height_final_m"),
                    *("heading_drift_deg_per_min", "inside_95_pct", "strides", "strides_true"),
                )
            ),
        }
        for index, method in enumerate(METHODS)
        for k in (0, 1, 5)
    ]
    errors = {method: [0.5, 0.25, 1.5] for method in METHODS}
    return Findings(
        rows={"one": rows, "two": rows},
        runs={"one": rows[:3]},
        plain={"one": errors, "two": errors},
        ablation={"one": {"everything": [0.5, 0.25, 1.5]}},
        cost=COST,
        motion=MOTION,
    )


def test_the_page_tells_classes_by_halves_and_the_covariance_by_set_and_class() -> None:
    text = page(findings())
    assert "| crawling | 1 / 0 | 0 / 0 | 0 / 0 | 7 / 5 | 0 / 0 | 0 / 0 |" in text
    assert "- Stairs without truth, up: stairs 14, walking 5." in text
    assert "- Directions on one: forward 20, left 3." in text
    assert "| one | 2 | 90.0 | 50 | 3.00 / 3.00 | 1.50 / 1.50 | 0.50 / 0.50 | 2.00 / 2.00 | 80.0 |" in text
    assert "| mostly walking | 1 | 100.0 | 100 | 1.00 / 1.00 | 1.00 / 1.00 | 0.25 / 0.25 | – | – |" in text
    assert "| crawling | 4.00 | 0.50 | 77.5 |" in text
    assert "| walking | – |" not in text  # one run has no halves


def test_the_page_says_what_is_training_data() -> None:
    assert "training data" not in page(findings())
    told = page(replace(findings(), cross_fit={"one": [0.1, 0.2, 0.6]}))
    assert "mean 0.300, median 0.200, worst 0.600 m (n 3)" in told


def test_the_page_tells_median_mean_and_worst() -> None:
    text = page(findings())
    assert f"| one | {METHODS[0]} | 3 | 0.020 | 0.030 | 0.060 |" in text
    assert f"| two | {METHODS[1]} | 3 | 0.040 | 0.060 | 0.120 |" in text
    assert "| everything | 0.500 / 0.750 / 1.500 |" in text
    assert "| run-5 | 0.060 | – |" in text
    assert all(f"| {limit.meaning} |" in text for limit in LIMITS)


def test_every_table_of_the_page_is_whole() -> None:
    """Each row of a table has as many cells as its head."""
    for table in re.findall(r"(?:^\|.*\n)+", page(findings()), flags=re.MULTILINE):
        widths = {line.count("|") for line in table.splitlines()}
        assert len(widths) == 1, table


def test_every_method_stands_in_the_table_of_sources() -> None:
    section = page(findings()).split("## The sources' methods")[1].split("##")[0]
    assert section.count("0.500 / 0.750 / 1.500") == 2 * len(METHODS)  # in the plain filter, of both sets
    assert all(f"| {tag} |" in section for tag in ("C1", "D2", "SHOE", "ARED"))


def test_the_page_is_made_from_a_folder_of_sets(
    square: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the walk to the page and its pictures; the cost is not this test's matter."""
    monkeypatch.setattr(figures, "measure", lambda *_: COST)
    figures.main(square.parent, tmp_path, seeds=())
    text = (tmp_path / "foot-ins.md").read_text(encoding="utf-8")
    assert "## pyshoe-vicon, run by run" in text
    assert "| pyshoe-vicon/fused |" in text
    assert "## foot-gcp, run by run" not in text
    assert "| 20 % missing |" in text.split("## What faults do")[1].split("##")[0]
    for name in ("foot-tracks.png", "foot-shares.png"):
        assert (tmp_path / "img" / name).read_bytes().startswith(b"\x89PNG")
        assert f"(img/{name})" in text


def test_pictures_in_the_house_are_small() -> None:
    pictures = list((ROOT / "docs/img").iterdir())
    assert pictures
    assert all(picture.stat().st_size < LARGEST_PICTURE for picture in pictures)


@pytest.mark.recorded
def test_the_page_in_the_house_is_of_this_filter() -> None:
    """The worst errors on the page are those of today's code: `make figures` if not."""
    page_now = (ROOT / "docs/foot-ins.md").read_text(encoding="utf-8")
    errors = rmse_of(ABLATIONS[0], load_runs([recorded_data() / "foot-gcp"]))
    line = next(line for line in page_now.splitlines() if line.startswith("| everything |"))
    worst = float(line.rstrip(" |").rsplit("/", 1)[1])
    assert worst == pytest.approx(float(np.max(errors)), abs=0.02)
