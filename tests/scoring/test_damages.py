"""The key rows of the table of damages, FOI's straight line, and two feet on a long way."""

import math

import numpy as np
import pytest

from proving_ground.evaluation.fusion.damage_play import Outcome, played, the_walk
from proving_ground.evaluation.fusion.damages import DAMAGES, damages_table, findings, lost, same, silent
from proving_ground.evaluation.fusion.dual import between, feet_through, foot_messages
from proving_ground.evaluation.fusion.feet_page import page
from proving_ground.evaluation.fusion.straight_line import LineWalk, straight_line_table, walk_line
from proving_ground.evaluation.scoring import score_track

KEY = (
    "a third 0.15 s late: out of order",
    "everything twice",
    "5 % of messages lost",
    "right foot silent for 20 s",
    "right unit stuck from 80 s",
    "right unit clips at 150 °/s",
    "fusion dies",
    "... in a corner",
)


@pytest.mark.parametrize("name", KEY)
def test_damage_does_what_is_expected_of_it(name: str) -> None:
    (finding,) = findings([damage for damage in DAMAGES if damage.name == name])
    assert finding.as_expected, damages_table([finding])[-1]


def test_the_stuck_foot_is_named_as_rejected_and_no_more_as_source() -> None:
    (damage,) = [damage for damage in DAMAGES if damage.name == "right unit stuck from 80 s"]
    outcome = played(damage.on_run)
    assert outcome.sources(60.0, 78.0) == {"left_foot", "right_foot"}
    assert outcome.sources(90.0, 140.0) == {"left_foot"}
    assert outcome.rejected(90.0, 140.0) == {"right_foot"}
    assert outcome.longest_silence_s() == pytest.approx(0.2)


def test_checks_can_fail() -> None:
    untouched = played()
    holed = played(on_stream=lost(0.2))
    assert not same(holed, untouched)
    empty = Outcome([], np.zeros(0), np.zeros(0), 100.0)
    assert not same(empty, untouched)
    assert "right_foot" not in played(on_stream=silent("right_foot", 60.0)).sources(70.0, 140.0)


def test_both_feet_end_nearer_than_each_alone_where_they_drift_oppositely() -> None:
    walks = [walk_line(seed, seed % 3) for seed in (200, 202, 206)]  # even seeds: the page shows odd ones
    assert max(walk.both_m for walk in walks) < 1.0
    alone = np.mean([(walk.left_m, walk.right_m) for walk in walks])
    assert np.mean([walk.both_m for walk in walks]) < 0.5 * alone


def test_the_table_of_the_line_ends_with_median_and_worst() -> None:
    walk = LineWalk(1, 4.5, 0.25, 1.5, 2.5)
    *_, median, worst = straight_line_table([walk])
    assert f"{walk.both_m:.2f}" in median
    assert f"{walk.both_m:.2f}" in worst


def test_each_foot_is_better_for_the_other_and_smoothing_keeps_it() -> None:
    run = the_walk().run
    messages = foot_messages(run)
    alone, together = feet_through(messages, "none"), feet_through(messages)
    smoothed = feet_through(messages, smoothed=True)
    for tracks, bound in ((together, 1.1), (smoothed, 1.1)):
        errors = [score_track(tracks[place], run.truth[place]).score.rmse_m for place in tracks]
        best = min(score_track(alone[place], run.truth[place]).score.rmse_m or math.inf for place in alone)
        assert max(error or math.inf for error in errors) < bound * best
    body = score_track(between(smoothed), run.truth["body"]).score.rmse_m
    assert body is not None
    assert body < 0.3


def test_the_page_needs_no_recorded_data(monkeypatch: pytest.MonkeyPatch) -> None:
    from proving_ground.evaluation.fusion import feet_page as fusion_feet_page

    monkeypatch.setattr(fusion_feet_page, "straight_line", lambda: [LineWalk(1, 4.5, 0.25, 1.5, 2.5)])
    monkeypatch.setattr(fusion_feet_page, "walked_loops", list)
    monkeypatch.setattr(fusion_feet_page, "loops_table", lambda _: ["no loops"])
    monkeypatch.setattr(fusion_feet_page, "findings", lambda: findings(DAMAGES[:1]))
    text = page(None)
    assert "| untouched |" in text
    assert "dualfoot-fgo |" not in text
