"""Makes docs/rooms.md and its picture: what another's map of rooms is worth to who comes after.

python -m proving_ground.evaluation.fusion.rooms_page DOCS
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bootprint import logs
from bootprint.rooms import RoomMap, cells_of
from pdr_engine.foot import warm_up
from proving_ground.evaluation.fusion.lines import Heard
from proving_ground.evaluation.fusion.room_trials import (
    KITS,
    SEEDS,
    Played,
    Row,
    Trial,
    maps,
    played,
    rows_of,
)

_COLUMNS = (
    ("p50_m", "p50 m"),
    ("p95_m", "p95 m"),
    ("since_p95_m", "p95 m since the door"),
    ("inside_95_pct", "inside 95 %"),
    ("nees", "NEES"),
    ("corrections", "corrections"),
    ("taken_off", "taken off"),
)
_SHOWN_KIT = "without compass"


def main(docs: Path, trials: Sequence[Trial]) -> None:
    """Write the page."""
    logs.configure("error")
    warm_up()
    rows = [row for trial in trials for row in rows_of(trial)]
    (docs / "img").mkdir(parents=True, exist_ok=True)
    save_picture(trials[0], docs / "img" / "rooms-map.png")
    (docs / "rooms.md").write_text(page(rows, [trial.seed for trial in trials]), encoding="utf-8")


def page(rows: Sequence[Row], seeds: Sequence[int]) -> str:
    """The whole document."""
    return f"""# Maps of rooms

Made by `make figures`; do not edit. METHODS D5b: the walked track gives a map of rooms that others can use and
that holds them in turn.

## What a map is

Fusion marks the cells (half a metre) under its own track, floor by floor, as long as no satellites are heard
and the position is surer than two metres; each cell keeps the mapper's own sigma. Soldiers without a camera
draw the same map: what was walked is corridors and doors. The map is the topic `rooms` (at most 4096 runs of
cells, told when it has grown, every 10 s at most), stands as GeoJSON with floors in the computer's state folder
(`rooms.geojson`), is gone on from after a restart, and is a layer of the command post's page
(`/api/v1/rooms.geojson`).

Hubs send maps over links of kind `zenoh` only, sealed with keys of their own (AES-256-GCM); a narrow radio
carries none. The receiving hub tells them on its own bus, and the fusion there uses them.

## How another's map holds a walk

A stretch of 15 m is laid over the map: shifts and turns on a grid, weighed by what the filter allows and by how
much likelier the way is on walked ground than anywhere (`fusion.rooms.matching`). What that adds to the prior
becomes a measurement; along a corridor that is nothing. A map is *laid* on the walk where a first stretch fits
plainly, as an offset and a turn in the filter's state: a map is a shape, and where it lies on earth is not
believed, for both soldiers came in under the same satellites. So a map that lies elsewhere moves nobody, and
one of another house does not fit. A map that contradicts the walk is taken off, counted (`rooms_taken_off`).

```toml
[fusion.rooms]
map = true    # draw one
use = true    # be held by others'; false unless set
```

## Two soldiers in one house

`python -m proving_ground.evaluation.fusion.room_trials`: the house of building-clearing, the first goes through it
once with two tactical boots, the second stays ten minutes. Seeds {", ".join(map(str, seeds))} (choices were
made on even ones), one configuration, nothing but the map differs. Satellites at the house are metres wrong for
both alike, hence the column "since the door". Median / worst over seeds (corrections and maps taken off:
means):

{table(rows)}

So boots, even a consumer's single one, hardly drift by more here than a map of such small rooms can tell: most
stretches are no plain fit, and then nothing is done. What is gained is small, though no error has grown with the
right map: so `use` is off by default. A belt alone is not helped at all: it comes in with metres and twenty degrees
of doubt, its heights are on wrong floors, and beyond `most_sigma_m` no map is laid. Where a walk does drift,
another's map holds it: a foot that turns by seven degrees a minute around a block errs at most half as much with it
(`tests/fusion/test_fusion_rooms.py`). A map that lies wrong as a whole is taken as it lies, and pulls only by what
is wrong within it.

![the first one's map, and the second one's tracks](img/rooms-map.png)
"""


def table(rows: Sequence[Row]) -> str:
    """A line for each kit and map."""
    lines = [
        f"| second wears | map | {' | '.join(head for _, head in _COLUMNS)} |",
        f"|---|---|{'--:|' * len(_COLUMNS)}",
    ]
    for kit in KITS:
        for told in dict.fromkeys(str(row["map"]) for row in rows):
            own = [row for row in rows if row["kit"] == kit and row["map"] == told]
            cells = " | ".join(
                _figures([float(row[column]) for row in own], column) for column, _ in _COLUMNS
            )
            lines.append(f"| {kit} | {told} | {cells} |")
    return "\n".join(lines)


def _figures(values: Sequence[float], column: str) -> str:
    if column in ("corrections", "taken_off"):
        return f"{np.mean(values):.1f}"
    worst = min(values) if column == "inside_95_pct" else max(values)
    digits = 0 if column == "inside_95_pct" else 2
    return f"{np.median(values):.{digits}f} / {worst:.{digits}f}"


def save_picture(trial: Trial, path: Path) -> None:
    """The first one's map of the ground floor; true and fused tracks of the second without and with it."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    heard = trial.second(_SHOWN_KIT)
    tracks = {told: played(heard, given) for told, given in maps(trial.first.rooms).items()}
    figure, axes = pyplot.subplots(1, 2, figsize=(12, 6), sharex=True, sharey=True)
    for axis, told in zip(axes, ("no map", "the first one's"), strict=True):
        _draw(axis, trial.first.rooms, heard, tracks[told])
        axis.set_title(f"{_SHOWN_KIT}, {told} (seed {trial.seed})", fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def _draw(axis, rooms: RoomMap, heard: Heard, made: Played) -> None:  # type: ignore[no-untyped-def]
    for outline in heard.exercise.plan.get(0, ()):
        axis.plot(outline[:, 0], outline[:, 1], color="0.8", linewidth=1)
    walked = (
        np.array([place for place, cell in cells_of(rooms.runs).items() if place.floor == 0]) * rooms.cell_m
    )
    axis.plot(
        walked[:, 2] + rooms.cell_m / 2,
        walked[:, 1] + rooms.cell_m / 2,
        "s",
        color="tab:green",
        ms=4,
        alpha=0.4,
    )
    truth = heard.soldier.truth.position_m
    axis.plot(truth[:, 0], truth[:, 1], color="0.4", linewidth=1)
    placed = [one for one in made.positions if one.mode != "unplaced"]
    axis.plot([one.east_m for one in placed], [one.north_m for one in placed], color="tab:blue", linewidth=1)
    axis.set_aspect("equal")


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Trial(seed) for seed in SEEDS])
