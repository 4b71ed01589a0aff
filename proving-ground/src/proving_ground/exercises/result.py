"""The result object of a demo or exercise: every figure of DESIGN, and the tracks a report draws."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from proving_ground.exercises.exercise import COMMAND_POST, Exercise
from proving_ground.exercises.score import (
    Compared,
    FloatArray,
    Row,
    compare,
    latency_p99_ms,
    link_row,
    picture_row,
    reported_places,
    sample_picture,
    soldier_row,
)

if TYPE_CHECKING:
    from proving_ground.exercises.stage import Stage


@dataclass(frozen=True)
class Result:
    """``figures`` is what ``result.json`` holds; ``compared`` and ``reports_m`` feed the report's map.

    ``reports_m``: the places (n, 2) at which the command post was told each soldier to be.
    """

    figures: dict[str, Any]
    compared: dict[str, Compared]
    reports_m: dict[str, FloatArray]


def result_of(stage: "Stage") -> Result:
    """Score what the stage's observers have heard."""
    heard = {computer: observer.heard() for computer, observer in stage.observers.items()}
    compared = {
        soldier.id: compare(soldier, heard[soldier.id].positions, stage.start_ns)
        for soldier in stage.exercise.soldiers
    }
    squad = {name: each for name, each in compared.items() if each is not None}
    duration_s = max(stage.elapsed_s, 1e-9)
    return Result(
        figures={
            "exercise": _name(stage.exercise),
            "duration_s": duration_s,
            "speed": stage.speed,
            "processes": len(stage.processes.pids),
            "soldiers": [soldier_row(s, compared[s.id]) for s in stage.exercise.soldiers],
            "pictures": [
                picture_row(
                    receiver,
                    sample_picture(
                        heard[receiver].tracks,
                        [each for name, each in squad.items() if name != receiver],
                        stage.start_ns,
                        stage.frame,
                    ),
                )
                for receiver in sorted(stage.computers, key=lambda name: name != COMMAND_POST)
            ],
            "links": _links(stage, duration_s),
            "nets": [
                {"net": name, **net.counts.__dict__, "bits_per_s": 8.0 * net.counts.bytes / duration_s}
                for name, net in stage.nets.items()
            ],
            "latency_p99_ms": latency_p99_ms(list(heard.values())),
        },
        compared=squad,
        reports_m={name: reported_places(heard[COMMAND_POST].tracks, name, stage.frame) for name in squad},
    )


def _name(exercise: Exercise) -> str:
    return "simulated walks" if exercise.soldiers[0].simulated else "recorded walks"


def _links(stage: "Stage", duration_s: float) -> list[Row]:
    return [
        link_row(computer, report, duration_s)
        for computer, observer in stage.observers.items()
        for report in observer.heard().links.values()
    ]
