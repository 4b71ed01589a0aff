"""Twenty minutes without satellites, by boots or by body: ``python -m proving_ground.evaluation.fusion.long_gap``.

Two minutes of satellites, then none for twenty, over mixed movement (``scenarios/long-gap.toml``). Errors in the
last minute of the gap, of the distance walked in it: the 95th percentile over soldiers and seeds.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.messages import Position
from proving_ground.evaluation.alignment import interpolated
from proving_ground.evaluation.fusion.by_seeds import print_table
from proving_ground.evaluation.fusion.library_honesty import cases
from proving_ground.evaluation.fusion.lines import Heard, Keep, everything, fused

SCENARIO = Path(__file__).parent / "scenarios" / "long-gap.toml"
SEEDS = tuple(range(1, 13, 2))
GAP_S = (120.0, 1320.0)
_LAST_S = 60.0


def _without_boots(envelope: Envelope, _since_s: float) -> bool:
    return not envelope.address.subject.startswith("foot_")


VARIANTS: Mapping[str, Keep] = {"boots": everything, "body alone": _without_boots}


@dataclass(frozen=True, slots=True)
class Gap:
    """One soldier: way in the gap, largest error of its last minute, m; share inside the ellipse in all of it."""

    soldier: str
    walked_m: float
    error_m: float
    inside_pct: float

    @property
    def error_pct(self) -> float:
        """Of the distance."""
        return 100.0 * self.error_m / self.walked_m


def measure(seeds: Sequence[int] = SEEDS) -> dict[str, list[Gap]]:
    """Every soldier of every seed, by variant."""
    found: dict[str, list[Gap]] = {name: [] for name in VARIANTS}
    for seed in seeds:
        for heard in cases(str(SCENARIO), seed, 2, GAP_S[1]):
            for name, keep in VARIANTS.items():
                found[name].append(gap(heard, fused(heard, keep)))
    return found


def gap(heard: Heard, positions: Sequence[Position]) -> Gap:
    """What the gap has cost a soldier."""
    truth = heard.soldier.truth
    time_s = np.array([(one.time_ns - heard.begins_ns) / NS_PER_S for one in positions])
    chosen = (time_s >= GAP_S[0]) & (time_s <= min(GAP_S[1], truth.time_s[-1]))
    time_s = time_s[chosen]
    within = [one for one, good in zip(positions, chosen, strict=True) if good]
    true_m = interpolated(time_s, truth.time_s, truth.position_m[:, :2])
    miss = np.array([(one.east_m, one.north_m) for one in within]) - true_m
    spread = np.array([((c[0], c[1]), (c[1], c[3])) for c in (one.covariance_m2 for one in within)])
    squared = np.einsum("ki,kij,kj->k", miss, np.linalg.inv(spread), miss)
    last = time_s >= time_s[-1] - _LAST_S
    return Gap(
        heard.soldier.id,
        float(np.hypot(*np.diff(true_m, axis=0).T).sum()),
        float(np.hypot(*miss[last].T).max()),
        100.0 * float(np.mean(squared <= 5.991)),
    )


def table(found: Mapping[str, Sequence[Gap]]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [
        "| carried by | runs | walked m, mean | error, % of it: median | p95 | worst | inside 95 % |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for name, gaps in found.items():
        share = np.array([one.error_pct for one in gaps])
        walked, inside = (
            np.mean([getattr(one, field) for one in gaps]) for field in ("walked_m", "inside_pct")
        )
        lines.append(
            f"| {name} | {len(gaps)} | {walked:.0f} | {np.median(share):.2f} | {np.percentile(share, 95):.2f}"
            f" | {share.max():.2f} | {inside:.1f} |"
        )
    return lines


if __name__ == "__main__":
    print_table("dead reckoning over twenty minutes", SEEDS, lambda seeds: table(measure(seeds)))
