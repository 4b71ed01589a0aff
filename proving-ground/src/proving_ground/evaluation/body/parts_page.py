"""Tables on the body module's parts and on the whole chain over simulated people, as Markdown for the manual.

python -m proving_ground.evaluation.body.parts_page [FOLDER OF ALL RECORDED SETS]
"""

import sys
from pathlib import Path

import numpy as np
import typer

from pdr_engine.body.movement.classes import MovementClassifier
from proving_ground.evaluation.body.azimuth import all_rows, azimuth_table, bridging_table, recorded_walks
from proving_ground.evaluation.body.azimuth_chain import chain_tables
from proving_ground.evaluation.body.azimuth_recorded import recorded_table
from proving_ground.evaluation.body.classes import classes_table, speeds_table
from proving_ground.evaluation.body.course import course_table
from proving_ground.evaluation.body.height_bound import WEATHERS, bound_table
from proving_ground.evaluation.body.heights import heights_table
from proving_ground.evaluation.body.idle import idle_table
from proving_ground.evaluation.body.pns_gps import town_table
from proving_ground.evaluation.body.poor_fixes import fixes_table, phone_table
from proving_ground.evaluation.body.retrace import retrace_table
from proving_ground.evaluation.body.strides import cut_strides
from proving_ground.evaluation.body.worn_iron import worn_iron_table
from sensor_gateway.recordings import load_runs


def forward_table(data: Path) -> str:
    """Markdown: steps taken for forward on recorded walks, whose bearers hardly ever go otherwise."""
    walks = []
    for run in load_runs([data], "body"):
        classifier = MovementClassifier()
        found = [classifier.update(stride).direction for stride in cut_strides(run.imus["body"])]
        if found:
            walks.append((len(found), 100.0 * found.count("forward") / len(found)))
    steps, shares = (np.array(column) for column in zip(*walks, strict=True))
    return (
        "| walks | steps | forward % | worst walk % |\n|---|---|---|---|\n"
        f"| {len(walks)} | {int(steps.sum())} | {float(np.average(shares, weights=steps)):.1f} "
        f"| {float(shares.min()):.1f} |\n"
    )


_NOTES = {
    "Steps": "Half a minute at each speed, five body types, a consumer unit at 100 Hz.",
    "Movement classes (A3, B1)": """The course holds all classes; five body types, a consumer unit with its
barometer, no settings: where the unit is worn and which way it points is found on the way. Rows are what was done,
columns what was told at once; the first step or two after a change may be told by what was done before. The second
of two figures is of what steps were said to be four steps later (`settled_motion`, `settled_direction`).""",
    "No steps": "Nobody walks: each cell is the steps told in five minutes.",
    "Heights and floors (A8)": """A person goes up a building storey by storey (7.8 m in all), takes the lift down,
a ramp up and down, and the stairs up and down at once; weather drifts, doors slam, there is wind at the office. The
storey's height is told in the hall alone (7.8 ± 0.2 m). Errors are of whole climbs, shares are of steps; a floor is
right from the first step on it; the second of two shares is what was said four steps later. Units at belt, chest,
back and in the hand.""",
    "Poor satellite fixes (C4)": """phone-gps has no truth, so its track with fixes is held against the one without;
the walks of msindoor20 get fixes at that phone's times with errors drawn by what is stated. C4's filter is dead
reckoning with the fixes that state 15 m or less. `python -m proving_ground.evaluation.body.parts_page DATA`""",
}
_RECORDED_NOTE = """Fields of dipoles and cables are added to what phones' magnetometers read in malls. Truth is the
gyro with the offset that fits the unaltered compass best, so "none" is what a perfect detector would leave: the
building's own iron, alike over some ten steps, from which nobody knows north within seconds. Whoever believes it
soon knows north better, and turns a track while it is walked, which costs the track its shape. So the default
follows two azimuths: `azimuth_rad`, of this table, and `track_azimuth_rad`, by which the table of recorded walks
adds steps up (see there for what adding them up by `azimuth_rad` would give).

"""
_BOUND_NOTE = f"""
No combination of steps and pressure is within 0.4 m in every climb of such weather: that is 4.8 Pa, and a drift of
50 Pa in √h makes as much in the half minute of 7.8 m. The table is of the same filter told by the truth what was
climbed when, riser by riser, with a barometer of no noise of its own, in {len(WEATHERS)} weathers (odd seeds);
then without risers. What helps is a storey's height that is told.

"""
_TOWN_NOTE = """Steps of the whole chain: a calibrated unit at the trunk, a third of the blocks with a stretch of as
much iron as malls have, the navigator without fixes. Drawn steps err by 4 % in length and 4° in azimuth for good,
and by 1.5° over some 40 steps as iron leaves it: no filter is told of that.

"""
SEEDS = range(1, 6, 2)  # odd ones: choices were made with even ones
TOWN_SEEDS = range(20)


def chain_page(data: Path | None) -> str:
    """Tables of what the navigator makes of whole walks; ``data``: the folder of all recorded sets."""
    sections = {
        "Steps": speeds_table(),
        "Movement classes (A3, B1)": classes_table(),
        "No steps": idle_table(),
        "Heights and floors (A8)": heights_table() + _BOUND_NOTE + bound_table(),
    }
    if data is not None:
        (phone,) = load_runs([data / "phone-gps"])
        sections["Poor satellite fixes (C4)"] = "\n".join(
            (phone_table(phone), fixes_table(load_runs([data / "msindoor20"], "body"), phone))
        )
    return "\n".join(f"### {title}\n\n{_NOTES[title]}\n\n{table}" for title, table in sections.items())


def parts_page(data: Path | None) -> str:
    """All tables with their headings."""
    sections = {
        "Four-direction course (A3)": course_table(SEEDS),
        "Azimuth of the whole chain": chain_tables(SEEDS),
        "Azimuth past iron (A6, A7, B7)": azimuth_table(all_rows(data, SEEDS)),
        "Two minutes by gyro alone (A7)": bridging_table(SEEDS),
        "Out and back (B6)": retrace_table(SEEDS),
        "Town walk with GPS in three sections (C4)": _TOWN_NOTE + town_table(TOWN_SEEDS),
    }
    sections["Iron put on, calibrated on line (A5)"] = worn_iron_table(SEEDS)
    if data is not None:
        sections["Azimuth of the whole chain on recorded walks (A6, A7)"] = _RECORDED_NOTE + recorded_table(
            list(recorded_walks([data])), data.name
        )
        sections["Recorded walks: steps taken for forward"] = forward_table(data)
    seeds = ", ".join(str(seed) for seed in SEEDS)
    head = (
        f"Simulated with seeds {seeds}, the town with 0 to {TOWN_SEEDS[-1]}; "
        "each part alone, on steps cut offline,\nbut for the whole chain's azimuth and the way out and back.\n"
    )
    return "\n".join([head, *(f"### {title}\n\n{table}" for title, table in sections.items())])


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    typer.echo(chain_page(folder))
    typer.echo(parts_page(None if folder is None else folder / "msindoor20"))
