"""Tables on the body module's parts, each scored alone, as Markdown for the manual.

python -m proving_ground.evaluation.body_parts_page [FOLDER OF RECORDED WALKS]
"""

import sys
from pathlib import Path

import numpy as np

from pdr_engine.body.movement.classes import MovementClassifier
from proving_ground.evaluation.body_azimuth import all_rows, azimuth_table, bridging_table
from proving_ground.evaluation.body_course import course_table
from proving_ground.evaluation.body_heights import heights_table
from proving_ground.evaluation.body_pns_gps import town_table
from proving_ground.evaluation.body_retrace import retrace_table
from proving_ground.evaluation.body_strides import cut_strides
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


SEEDS = range(1, 6, 2)  # odd ones: choices were made with even ones
TOWN_SEEDS = range(20)


def parts_page(data: Path | None) -> str:
    """All tables with their headings."""
    sections = {
        "Four-direction course (A3)": course_table(SEEDS),
        "Heights (A8)": heights_table(SEEDS),
        "Azimuth past iron (A6, A7, B7)": azimuth_table(all_rows(data, SEEDS)),
        "Two minutes by gyro alone (A7)": bridging_table(SEEDS),
        "Out and back (B6)": retrace_table(SEEDS),
        "Town walk with GPS in three sections (C4)": town_table(TOWN_SEEDS),
    }
    if data is not None:
        sections["Recorded walks: steps taken for forward"] = forward_table(data)
    seeds = ", ".join(str(seed) for seed in SEEDS)
    head = (
        f"Simulated with seeds {seeds}, the town with 0 to {TOWN_SEEDS[-1]}; "
        "each part alone, on steps cut offline.\n"
    )
    return "\n".join([head, *(f"### {title}\n\n{table}" for title, table in sections.items())])


if __name__ == "__main__":
    print(parts_page(Path(sys.argv[1]) if len(sys.argv) > 1 else None))  # noqa: T201
