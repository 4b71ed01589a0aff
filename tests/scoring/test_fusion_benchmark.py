"""`bootprint benchmark fusion`: what is late by design is told from the rest, and the limits judge."""

import json
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from bootprint.cli import build_app
from bootprint.errors import BootprintError
from proving_ground.exercises.source import open_exercise
from proving_ground.performance import fusion_benchmark
from proving_ground.performance.fusion_benchmark import SCENARIO, FusionFigures, figures, table, waits_ns

GOOD = FusionFigures(100, 300.0, 420.0, 280.0, 380.0, 20.0, 45.0, 1.5, 4.0)
SHARES = {"sensor-gateway": 1.0, "pdr-engine": 1.5, "fusion": 2.0}
MS = 1_000_000


def test_what_is_late_by_design_is_told_from_the_rest() -> None:
    """Position by position: 30 and 10 ms beyond design; the last one is in one of the plays only."""
    found = figures({0: 430.0 * MS, 200: 510.0 * MS, 400: 9e9}, {0: 400 * MS, 200: 500 * MS}, SHARES)
    assert (found.positions, found.late_p50_ms, found.by_design_p50_ms) == (2, 470.0, 450.0)
    assert (found.beyond_p50_ms, found.beyond_p99_ms) == pytest.approx((20.0, 29.8))
    assert (found.fusion_core_pct, found.chain_core_pct) == (2.0, 4.5)
    assert table(found)["beyond design"]["latency_p50_ms"] == pytest.approx(20.0)


def test_no_position_is_an_error_in_words() -> None:
    with pytest.raises(BootprintError, match="no position came in time"):
        figures({}, {0: 1}, SHARES)


def test_by_design_a_position_waits_for_look_ahead_and_order_and_no_longer() -> None:
    """The foot filter looks 95 ms ahead; who waits for a receiver does so for the reorder window at most."""
    waits = waits_ns(open_exercise(str(SCENARIO), 1), 12.0)
    late_ms = [wait / MS for time_ns, wait in waits.items() if time_ns > 2e9]
    assert len(late_ms) > 40
    assert min(late_ms) > 95.0
    assert max(late_ms) < 95.0 + 300.0 + 100.0 + 100.0


@pytest.mark.parametrize(("beyond_ms", "code"), [(45.0, 0), (75.0, 1)])
def test_the_limits_judge(monkeypatch: pytest.MonkeyPatch, beyond_ms: float, code: int) -> None:
    monkeypatch.setattr(fusion_benchmark, "measure", lambda _seconds: replace(GOOD, beyond_p99_ms=beyond_ms))
    result = CliRunner().invoke(build_app(), ["benchmark", "fusion", "--check", "--json", "-"])
    assert result.exit_code == code
    assert json.loads(result.stdout)["beyond_p99_ms"] == beyond_ms
