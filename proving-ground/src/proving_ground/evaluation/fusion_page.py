"""Makes docs/fusion.md: what each source is worth to fusion, gaps of satellites, spoofers, honesty.

python -m proving_ground.evaluation.fusion_page DOCS
"""

import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bootprint import logs
from bootprint.bus import Envelope
from bootprint.messages import Position
from pdr_engine.foot import warm_up
from proving_ground.evaluation.fusion_lines import Keep, everything, fused, heard_by, scored
from proving_ground.evaluation.spoofing import Trial, figures, play
from proving_ground.exercises.score import Row

_GAP_S = (120.0, 420.0)
# Scenario, seed, soldiers: of every kind one.
PLAYED = (
    ("stairs-and-lift", 1, 1),
    ("jamming-and-spoofing", 1, 1),
    ("building-clearing", 1, 1),
)
_COLUMNS = (
    ("position_error_p50_m", "p50 m"),
    ("position_error_p95_m", "p95 m"),
    ("final_error_m", "end m"),
    ("height_error_p95_m", "height p95 m"),
    ("floor_correct_pct", "floors right %"),
    ("inside_95_pct", "inside 95 % ellipse"),
)


def _without(*left_out: str) -> Keep:
    """Keeps all but these subjects and sources."""

    def keep(envelope: Envelope, _since_s: float) -> bool:
        return envelope.address.subject not in left_out and envelope.address.source not in left_out

    return keep


def _with_gap(*left_out: str) -> Keep:
    """Keeps all but these subjects within `_GAP_S`."""

    def keep(envelope: Envelope, since_s: float) -> bool:
        return envelope.address.subject not in left_out or not _GAP_S[0] <= since_s < _GAP_S[1]

    return keep


VARIANTS: Mapping[str, Keep] = {
    "everything": everything,
    "no satellites": _without("gnss"),
    "no air pressure": _without("pressure"),
    "left foot alone": _without("right_foot"),
    "no satellites from 2 to 7 min": _with_gap("gnss"),
    "neither satellites nor boots from 2 to 7 min": _with_gap("gnss", "foot_step", "foot_pose"),
    "no boots (nobody wears a body unit here)": _without("foot_step", "foot_pose"),
}


@dataclass(frozen=True)
class Played:
    """A scenario's soldiers by each variant: figures and modes."""

    scenario: str
    rows: dict[str, list[Row]]
    modes: dict[str, dict[str, float]]


def played(scenario: str, seed: int, soldiers: int) -> Played:
    """Every variant of a scenario."""
    everyone = list(heard_by(scenario, seed, soldiers))
    rows: dict[str, list[Row]] = {}
    modes: dict[str, dict[str, float]] = {}
    for name, keep in VARIANTS.items():
        tracks = [fused(one, keep) for one in everyone]
        rows[name] = [scored(one, track) for one, track in zip(everyone, tracks, strict=True)]
        modes[name] = _shares([position for track in tracks for position in track])
    return Played(scenario, rows, modes)


def _shares(positions: Sequence[Position]) -> dict[str, float]:
    names = sorted({position.mode for position in positions})
    return {
        name: 100.0 * sum(position.mode == name for position in positions) / len(positions) for name in names
    }


def page(scenarios: Sequence[Played], spoofed: Mapping[str, Mapping[str, float]]) -> str:
    """The whole document."""
    tables = "\n\n".join(_scenario_section(one) for one in scenarios)
    return f"""# Fusion: what each source is worth

Made by `make figures` (`python -m proving_ground.evaluation.fusion_page docs`). The same sensors are fused again
and again with something left out; figures are means over the soldiers, in the simulator's scenarios
([exercises](exercises.md)). Jamming with seed 1 was looked at while trust in
receivers was chosen, the others were not.

## How it works

- **Satellites** correct a dead reckoning that goes on without them. Beside it run *shadows*: copies that have not
  heard satellites since half a minute to four minutes. A receiver whose fixes walk away from a shadow by more than
  both errors explain, for four seconds, is *spoofed*: what it did is undone, and it is heard again when its fixes
  have agreed with dead reckoning for twenty seconds. A receiver that scatters more than it says is believed less.
- **Compasses** of the boots hold the heading, with what calibration left of their error as a state.
- **Air pressure** tells lifts: it runs away while the feet stand. Lifts and stairs end on floors.
- **The body's steps** take over when no boot has spoken for a second (mode `body`), with the angle and step length
  that were learned beside the boots; a soldier without boots begins with them.
- **Every position** says which source is left out and why (`rejections`), and how far the truth may be, even if
  something was wrong that no check would notice (`protection_m`).

## Each source left out

{tables}

## Slow spoofers

`python -m proving_ground.evaluation.spoofing`: crooked walks in the open, a spoofer that begins at the true place
after four minutes and pulls for three; odd seeds (choices were made on even ones). What is left of the error at the
end of such a gap is dead reckoning's.

{_spoofing_table(spoofed)}
"""


def _scenario_section(one: Played) -> str:
    heads = [head for _, head in _COLUMNS]
    lines = [
        f"### {one.scenario}",
        "",
        _line(["", *heads, "modes %"]),
        _line(["---", *["--:"] * len(heads), "---"]),
    ]
    for name, rows in one.rows.items():
        modes = ", ".join(f"{mode} {share:.0f}" for mode, share in one.modes[name].items())
        lines.append(_line([name, *(_mean(rows, column) for column, _ in _COLUMNS), modes]))
    return "\n".join(lines)


def _mean(rows: Sequence[Row], column: str) -> str:
    values = [float(value) for row in rows if isinstance(value := row[column], int | float)]
    return f"{np.mean(values):.1f}" if values else "–"


def _spoofing_table(spoofed: Mapping[str, Mapping[str, float]]) -> str:
    names = list(next(iter(spoofed.values())))
    lines = [_line(["", *spoofed]), _line(["---", *["--:"] * len(spoofed)])]
    lines += [_line([name, *(_number(found[name]) for found in spoofed.values())]) for name in names]
    return "\n".join(lines)


def _number(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.1f}"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def spoofing_trials() -> Iterator[tuple[str, list[Trial]]]:
    """Columns of the spoofing table: odd seeds."""
    seeds = range(1, 21, 2)
    yield "0.5 m/s", [Trial(seed) for seed in seeds]
    yield "0.5 m/s, boots without compass", [Trial(seed, compass=False) for seed in seeds]
    yield "none, 30 min", [Trial(seed, 1800.0, 0.0, math.inf) for seed in seeds[:4]]


def main(docs: Path) -> None:
    """Write the page."""
    logs.configure("error")
    warm_up()
    scenarios = [played(*one) for one in PLAYED]
    spoofed = {name: figures([play(trial) for trial in trials]) for name, trials in spoofing_trials()}
    (docs / "fusion.md").write_text(page(scenarios, spoofed), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
