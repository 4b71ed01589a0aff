"""`bootprint benchmark hub`: real hubs are heard, every report counts, and the limits judge."""

import json
from dataclasses import replace

import pytest
import typer
from typer.testing import CliRunner

from proving_ground.performance import hub_benchmark
from proving_ground.performance.commands import register
from proving_ground.performance.hub_benchmark import LIMITS, HubFigures, HubRow, measure
from proving_ground.performance.hub_company import POST, Company
from proving_ground.performance.hub_work import cot_events, keep_picture, merge, parse_cot

GOOD = HubFigures(
    rows=(HubRow(12, 1.0, 3.0, 1.0, 2.0, 60.0),),
    merged_reports=100,
    merged_per_s=30_000.0,
    xml_per_s=70_000.0,
    times_xml=0.43,
    cpu_ms_per_s_most=20.0,
    own_mb_most=1.0,
    resident_mb_most=61.0,
)


def test_a_post_hears_its_soldiers_through_their_leaders_and_passes_them_on() -> None:
    company = Company(14)
    frames = company.frames(8)
    assert company.squads == 2
    picture = keep_picture(company, frames, 8)
    merged = merge(company, frames)
    assert picture.heard == merged.heard == len(frames) > 3
    # Each soldier at least once, at the start, and again to confirm it after 3 s.
    assert picture.reports == merged.reports >= 28
    assert 0 < picture.sent <= len(frames) + 2
    assert picture.cpu_s > 0.0


def test_the_same_company_says_the_same() -> None:
    assert Company(3).frames(5) == Company(3).frames(5)


def test_more_soldiers_than_there_are_radio_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="1 to 900"):
        Company(901)
    roster = Company(900).realm.roster
    assert len({member.number for member in roster}) == len(roster)
    assert max(member.number for member in roster) <= 1023
    assert POST in {member.id for member in roster}


def test_events_for_comparison_are_well_formed() -> None:
    events = cot_events(20)
    assert parse_cot(events) > 0.0
    assert len({event.split("uid=")[1].split('"')[1] for event in events}) == 20
    assert 400 < len(events[0]) < 800


def test_it_measures_in_processes_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hub_benchmark, "MERGED", 6)
    figures = measure((3, 6), duration_s=6, turns=1)
    assert [row.soldiers for row in figures.rows] == [3, 6]
    assert all(row.frames_heard_per_s > 0.0 and row.cpu_ms_per_s > 0.0 for row in figures.rows)
    assert all(20.0 < row.resident_mb < 500.0 for row in figures.rows)
    assert figures.merged_per_s == pytest.approx(figures.times_xml * figures.xml_per_s)


@pytest.mark.parametrize(
    ("figures", "code"),
    [(GOOD, 0), (replace(GOOD, merged_per_s=19_999.0), 1), (replace(GOOD, times_xml=0.1), 1)],
)
def test_a_missed_limit_is_told_and_ends_with_one(
    monkeypatch: pytest.MonkeyPatch, figures: HubFigures, code: int
) -> None:
    monkeypatch.setattr(hub_benchmark, "measure", lambda *_: figures)
    app = typer.Typer()
    register(app)
    result = CliRunner().invoke(app, ["benchmark", "hub", "--check"], env={"COLUMNS": "200"})
    assert result.exit_code == code
    assert ("missed" in result.output) == bool(code)
    assert result.output.count("holds") == len(LIMITS) - code
    quiet = CliRunner().invoke(app, ["benchmark", "hub", "--json", "-"])
    assert json.loads(quiet.output)["merged_per_s"] == figures.merged_per_s
