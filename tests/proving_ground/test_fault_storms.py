"""Verdicts over several storms: each goal is missed by one fault, and holds without it."""

from pathlib import Path
from typing import Any

import pytest
import typer

from proving_ground.exercises.faults.storms import Conditions, open_run, verdicts


def storm(*, growth: float | None = 0.2, **changes: Any) -> dict[str, Any]:
    good = {"down_s": 1.2, "right_after_s": 0.5, "honest_after_s": 0.5, "positions_missing": 0}
    rows = [good, good | changes]
    return {"duration_s": 220.0, "faults": rows, "faults_summary": {"memory_growth_worst_pct_per_h": growth}}


def missed(*results: dict[str, Any]) -> list[int]:
    return [number for number, verdict in enumerate(verdicts(results)) if verdict.holds is False]


def test_a_storm_that_holds_everything() -> None:
    assert missed(storm(), storm(down_s=None, right_after_s=10.0)) == []


def test_each_goal_can_be_missed() -> None:
    assert missed(storm(), storm(down_s=5.1)) == [0]
    assert missed(storm(down_s=float("inf"))) == [0]
    assert missed(storm(right_after_s=None), storm()) == [1]
    assert missed(storm(right_after_s=10.5)) == [1]
    assert missed(storm(positions_missing=3)) == [2]
    assert missed(storm(growth=None), storm(growth=1.3)) == [3]


def test_growth_that_nobody_lived_long_enough_to_show_is_not_judged() -> None:
    last = verdicts([storm(growth=None)])[-1]
    assert last.holds is None
    assert "soak" in last.found


def test_the_verdict_tells_how_many() -> None:
    down, right, *_ = verdicts([storm(down_s=7.8, honest_after_s=11.0), storm()])
    assert down.found == "1 of 4, 7.8 s at worst"
    assert right.found == "4 of 4 (honest: 3)"


def test_without_a_fault_nothing_is_judged() -> None:
    calm = {"duration_s": 9.0, "faults": [], "faults_summary": {"memory_growth_worst_pct_per_h": None}}
    assert [verdict.holds for verdict in verdicts([calm])] == [None] * 4


PLAYED = Conditions("building-clearing", 1.0)


def result_of_a_run(out: Path) -> Path:
    open_run(out, PLAYED, resume=False)
    result = out / "3" / "result.json"
    result.parent.mkdir()
    result.write_text("{}")
    return result


def test_a_new_run_takes_no_results_of_an_earlier_one(tmp_path: Path) -> None:
    result = result_of_a_run(tmp_path / "storms")
    open_run(tmp_path / "storms", PLAYED, resume=False)
    assert not result.exists()


def test_a_run_is_resumed_on_request_under_the_same_conditions_only(tmp_path: Path) -> None:
    result = result_of_a_run(tmp_path)
    open_run(tmp_path, PLAYED, resume=True)
    for other in (Conditions("stairs", 1.0), Conditions("building-clearing", 2.0)):
        with pytest.raises(typer.BadParameter, match="leave --resume out"):
            open_run(tmp_path, other, resume=True)
    assert result.exists()
    with pytest.raises(typer.BadParameter):
        open_run(tmp_path / "nowhere", PLAYED, resume=True)
