"""What estimators and a command post's hub cost by themselves, as `bootprint benchmark` measures it."""

from typing import Final

from proving_ground.performance.body_benchmark import measure_body
from proving_ground.performance.body_benchmark import walk_of as body_walk
from proving_ground.performance.figures import Table
from proving_ground.performance.foot_benchmark import measure as measure_foot
from proving_ground.performance.foot_benchmark import walk_of as foot_walk
from proving_ground.performance.hub_benchmark import hub_rows

_TURNS: Final = 3
_HUB_SECONDS: Final = 20
_PICTURES: Final = (12, 120)


def estimators() -> Table:
    """Processor time a sample of foot filter and body module, and a second of hubs by size of their picture."""
    foot, body = measure_foot(foot_walk(None), _TURNS), measure_body(body_walk(None), _TURNS)
    table: Table = {
        "foot filter": {"us_per_sample": foot.us_batches},
        "body module": {"us_per_sample": body.us_per_sample},
    }
    for row in hub_rows(_PICTURES, _HUB_SECONDS):
        table[f"hub, {row.soldiers} in its picture"] = {
            "ms_per_s": row.cpu_ms_per_s,
            "resident_mb": row.resident_mb,
        }
    return table
