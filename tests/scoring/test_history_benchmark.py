"""`bootprint benchmark history`: what is stored is counted, and the limits judge."""

from dataclasses import replace
from pathlib import Path

from bootprint.messages import Track
from proving_ground.performance.history_benchmark import LIMITS, measure, spoken


def test_a_company_is_stored_asked_and_exported(tmp_path: Path) -> None:
    figures = measure(f"sqlite:///{tmp_path}/history.db", soldiers=3, hours=0.05, every_s=5.0)
    told = list(spoken(3, 0.05, 5.0))
    assert figures.messages == len(told)
    tracks = [each.message for each in told if isinstance(each.message, Track)]
    assert 3 * 180 / 5 * 0.6 < len(tracks) < 3 * 180 / 5 * 1.4
    assert set(figures.export_s) == {"gpx", "kml", "geojson", "csv", "mcap"}
    assert min(figures.export_mb.values()) > 0.0
    assert figures.file_mb > 0.0


def test_limits_judge_in_the_right_direction(tmp_path: Path) -> None:
    figures = measure(f"sqlite:///{tmp_path}/history.db", soldiers=1, hours=0.01, every_s=5.0)
    slow = replace(figures, store_per_s=1.0, picture_ms=1e4)
    assert not next(each for each in LIMITS if each.figure == "store_per_s").holds(slow)
    assert not next(each for each in LIMITS if each.figure == "picture_ms").holds(slow)
    assert next(each for each in LIMITS if each.figure == "picture_ms").holds(replace(slow, picture_ms=1.0))
