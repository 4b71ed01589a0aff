"""Makes docs/fusion.md: what each source is worth to fusion, gaps of satellites, spoofers, honesty.

python -m proving_ground.evaluation.fusion.page DOCS
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
from proving_ground.evaluation.fusion import cooperation, dark_times, door_heading, library_honesty, long_gap
from proving_ground.evaluation.fusion.lines import Keep, everything, fused, heard_by, scored
from proving_ground.evaluation.fusion.spoofing import Trial, figures, play
from proving_ground.exercises.scoring.score import Row
from proving_ground.scenario.loading import library

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


def page(
    scenarios: Sequence[Played],
    spoofed: Mapping[str, Mapping[str, float]],
    tables: Mapping[str, Sequence[str]],
) -> str:
    """The whole document; ``tables`` are those of the modules that measure them."""
    left_out = "\n\n".join(_scenario_section(one) for one in scenarios)
    told = {name: "\n".join(lines) for name, lines in tables.items()}
    return f"""# Fusion: what each source is worth

Made by `make figures` (`python -m proving_ground.evaluation.fusion.page docs`). The same sensors are fused again
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
- **Speed and course** of a receiver are free of its position's slow errors. Beside what the boots walked between
  two fixes they tell the heading within metres, and hold it to the door, but not just after a turn: receivers
  smooth, and coast on where they lose the sky. Without boots they teach the body's steps length and direction.
- **Who stands** hears the same reflections again and again: such fixes count as hardly any news.
- **What nobody measures stays unknown**: feet and a camera hold each other, and that says nothing of what turns
  them all. A linear filter forgets so, update by update, and becomes sure of a heading that nobody told; here the
  covariance follows each correction as an invariant filter's does (`fusion.filter`), walkers are compared in axes
  that turn with them (`fusion.models.turned`), and what a badly known heading does to a long way beyond the first
  order is in the published ellipse (`fusion.models.body`). A fix that such a heading's tangent cannot explain moves
  the body and leaves the heading to courses, which turn the way walked along its arc. Not so when both feet set
  off together: a start whose azimuth is known to worse than 15° becomes surer by that than it is.
- **Facing** (`facing_rad`) is told by the boots that stand, which learn from steps ahead how their sensors sit,
  else by the body's last step.
- **Ranges to others of the squad** (`fusion.cooperation`) correct who is less sure than they are. A peer's place
  may stem from the soldier's own, and errs alike from range to range, so it is never averaged in as news: along
  the line between the two the soldier's error becomes the peer's where that is smaller, else nothing happens.
  Peers must fit together before any is believed; three or more place a soldier who is lost or unplaced.

## Each source left out

{left_out}

## Heading at the door

`python -m proving_ground.evaluation.fusion.door_heading`: no start, boots without compass and without poses
between their steps, an honest receiver; odd seeds.

{told["door"]}

## Ranges between soldiers

`python -m proving_ground.evaluation.fusion.cooperation`: five soldiers, real hubs and an emulated radio of 9600
bit/s between them; ranges once a second and peer, too long through walls. Figures are of the second and third
minute. The trials ask for what ranges can mend (the third soldier) and for what they may spoil (the others). The
lie shows a peer 40 m east of the truth, which in this wedge is nearly its mirror image: ranges alone do not
refute it.

{told["ranges"]}

## Twenty minutes without satellites

`python -m proving_ground.evaluation.fusion.long_gap`: mixed movement after two minutes of satellites; the largest
error of the last minute.

{told["gap"]}

## Is the covariance honest?

`bootprint exercise honesty`: two soldiers of each scenario and seed, a quarter of an hour
at most. Errors last for minutes, so a soldier's share says little by itself; their normalised square should be 2.

{told["honesty"]}

## Seconds in the dark

`python -m proving_ground.evaluation.fusion.dark_times`: a soldier's power is cut for three to six seconds, or the
gateway is killed, in building-clearing, mostly indoors; what was published from then on. How far the body went and
turned meanwhile nobody measured: the doubt has to say so until satellites tell at the door.

{told["dark"]}
## Slow spoofers

`python -m proving_ground.evaluation.fusion.spoofing`: crooked walks in the open, a spoofer that begins at the true
place after four minutes and pulls for three; odd seeds (choices were made on even ones). What is left of the
error at the end of such a gap is dead reckoning's.

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
    seeds = range(1, 121, 2)
    yield "0.5 m/s", [Trial(seed) for seed in seeds]
    yield "0.5 m/s, boots without compass", [Trial(seed, compass=False) for seed in seeds[:40]]
    yield "none, 30 min", [Trial(seed, 1800.0, 0.0, math.inf) for seed in seeds[:4]]


def main(docs: Path) -> None:
    """Write the page."""
    logs.configure("error")
    warm_up()
    scenarios = [played(*one) for one in PLAYED]
    spoofed = {name: figures([play(trial) for trial in trials]) for name, trials in spoofing_trials()}
    (docs / "fusion.md").write_text(page(scenarios, spoofed, _tables()), encoding="utf-8")


def _tables() -> dict[str, list[str]]:
    """Measured by the modules that the page names."""
    everybody = [one for name in library() for one in library_honesty.measure(name)]
    squads = cooperation.measure(cooperation.SCENARIO, tuple(cooperation.TRIALS), cooperation.SEEDS)
    return {
        "door": door_heading.table(),
        "ranges": cooperation.table(squads),
        "dark": dark_times.table(dark_times.measure()),
        "gap": long_gap.table(long_gap.measure()),
        "honesty": library_honesty.table(everybody),
    }


if __name__ == "__main__":
    main(Path(sys.argv[1]))
