"""One load test of several formats and seeds: a row of figures for each format."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from proving_ground.radio_load.formats import FORMATS, OURS
from proving_ground.radio_load.hub_squad import HubSquad
from proving_ground.radio_load.load import Load, Outcome
from proving_ground.radio_load.others_squad import play_format
from proving_ground.radio_load.picture_error import Errors
from proving_ground.radio_load.squad_tracks import SquadTracks

Row = dict[str, Any]
OnProgress = Callable[[str, float], None]


def _quietly(_what: str, _share: float) -> None:
    """Nobody watches."""


def contest(
    load: Load, formats: Sequence[str], seeds: Sequence[int], on_progress: OnProgress = _quietly
) -> list[Row]:
    """A row for each format, over all seeds; all formats of a seed have the same tracks."""
    outcomes: dict[str, list[Outcome]] = {name: [] for name in formats}
    for count, seed in enumerate(seeds):
        one = replace(load, seed=seed)
        on_progress("tracks", count / len(seeds))
        tracks = one.squad()
        for name in formats:

            def show(share: float, name: str = name, done: int = count) -> None:
                on_progress(name, (done + share) / len(seeds))

            outcomes[name].append(play(name, one, tracks, show))
            show(1.0)
        on_progress("tracks", (count + 1) / len(seeds))
    return [row_of(name, outcomes[name]) for name in formats]


def play(
    name: str, load: Load, tracks: SquadTracks, on_progress: Callable[[float], None] = lambda _share: None
) -> Outcome:
    """One format in one load test."""
    if name == OURS:
        return HubSquad(load, tracks).run(on_progress)
    return play_format(FORMATS[name], load, tracks)


def row_of(name: str, outcomes: Sequence[Outcome]) -> Row:
    """Figures over all outcomes of a format: errors pooled, bits averaged, the worst seed's p95 told apart.

    ``squeezed_error_p95_m`` and ``squeezed_missing_pct`` are over a link no faster than the budget, None where the
    format asks for less.
    """
    errors, squeezed = Errors(), Errors()
    for outcome in outcomes:
        errors.join(outcome.errors)
        squeezed.join(outcome.squeezed or Errors())
    duration_s = sum(outcome.duration_s for outcome in outcomes)
    bits, reports = (sum(getattr(outcome, what) for outcome in outcomes) for what in ("bits", "reports"))
    worst = [p95 for outcome in outcomes if (p95 := outcome.errors.percentile_m(95.0)) is not None]
    return {
        "format": name,
        "bits_per_s": bits / duration_s,
        "bytes_per_report": bits / 8.0 / reports if reports else None,
        "added_error_p50_m": errors.percentile_m(50.0),
        "added_error_p95_m": errors.percentile_m(95.0),
        "added_error_p99_m": errors.percentile_m(99.0),
        "age_p95_s": errors.age_p95_s,
        "budget_exceeded": any(outcome.budget_exceeded for outcome in outcomes),
        "added_error_p95_worst_m": max(worst, default=None),
        "missing_pct": errors.missing_pct,
        "squeezed_error_p95_m": squeezed.percentile_m(95.0),
        "squeezed_missing_pct": squeezed.missing_pct if squeezed.expected else None,
        "feedback_bits_per_s": sum(outcome.feedback_bits for outcome in outcomes) / duration_s,
        "dropped": sum(outcome.dropped for outcome in outcomes),
        "seeds": len(outcomes),
    }
