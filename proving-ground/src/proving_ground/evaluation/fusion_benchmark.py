"""What one soldier's fusion costs: ``python -m proving_ground.evaluation.fusion_benchmark [SCENARIO]``.

Both boots, a body unit where the kit has one, satellites, air pressure and a camera, as the scenario gives them.
Processor time, so that other processes do not count: the share of a core, and how long one message keeps a position
waiting. What the foot INS and the body module cost, `bootprint benchmark foot` and `body` tell.
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bootprint import logs
from bootprint.clock import NS_PER_S
from fusion.engine import FusionCore
from pdr_engine.foot import warm_up
from proving_ground.evaluation.fusion_lines import Heard, heard_by
from proving_ground.exercises.line import TICK_NS

_SCENARIO, _SEED, _SOLDIERS = "building-clearing", 1, 2


@dataclass(frozen=True, slots=True)
class Cost:
    """Share of a core, %, and processor time of one message, ms: 99th percentile and most."""

    soldier: str
    messages: int
    core_pct: float
    p99_ms: float
    most_ms: float


def cost(heard: Heard) -> Cost:
    """Of the fusion of one soldier over all that it hears."""
    core = FusionCore(heard.config, heard.identity, heard.origin)
    spent_ns, tick_ns = [], heard.begins_ns
    for due, envelope in heard.messages:
        begin = time.thread_time_ns()
        while tick_ns <= due:
            core.tick(tick_ns)
            tick_ns += TICK_NS
        core.handle(envelope)
        spent_ns.append(time.thread_time_ns() - begin)
    lasted_s = (heard.messages[-1][0] - heard.begins_ns) / NS_PER_S
    spent_ms = np.array(spent_ns) / 1e6
    return Cost(
        heard.soldier.id,
        len(spent_ns),
        0.1 * float(spent_ms.sum()) / lasted_s,
        float(np.percentile(spent_ms, 99)),
        float(spent_ms.max()),
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print a line a soldier."""
    scenario = next(iter(sys.argv[1:] if arguments is None else arguments), _SCENARIO)
    logs.configure("error")
    warm_up()
    for heard in heard_by(scenario, _SEED, _SOLDIERS):
        found = cost(heard)
        sys.stdout.write(
            f"{found.soldier}: {found.messages} messages, {found.core_pct:.2f} % of a core,"
            f" a message {found.p99_ms:.1f} ms (p99), {found.most_ms:.1f} ms (most)\n"
        )


if __name__ == "__main__":
    main()
