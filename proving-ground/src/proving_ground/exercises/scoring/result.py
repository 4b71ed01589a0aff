"""The result object of an exercise: every figure of DESIGN at every hop, and what a report draws."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from proving_ground.exercises.exercise import Exercise
from proving_ground.exercises.faults.memory_growth import memory_growth
from proving_ground.exercises.faults.process_faults import Outage
from proving_ground.exercises.faults.recovery import fault_rows, storm_summary
from proving_ground.exercises.processes.emulated_radio import NetCounts
from proving_ground.exercises.processes.exercise_files import hub_settings
from proving_ground.exercises.scoring.dead_reckoning import dead_reckoning_row
from proving_ground.exercises.scoring.events import Event, event_log
from proving_ground.exercises.scoring.heard import Heard
from proving_ground.exercises.scoring.picture import Ages, Picture, picture_row, sample_picture
from proving_ground.exercises.scoring.score import Compared, Row, compare, link_row, soldier_row


@dataclass(frozen=True)
class Played:
    """What an exercise left behind, whichever way it was played: ``start_ns`` is its zero, UTC ns."""

    exercise: Exercise
    start_ns: int
    duration_s: float
    heard: Mapping[str, Heard]
    nets: Mapping[str, NetCounts]
    outages: tuple[Outage, ...] = ()


@dataclass(frozen=True)
class Result:
    """``figures`` is what ``result.json`` holds; the rest feeds the report's plots."""

    figures: dict[str, Any]
    played: Played
    compared: dict[str, Compared]
    pictures: dict[str, Picture]
    events: list[Event]


def result_of(played: Played, extra: Mapping[str, Any] | None = None) -> Result:
    """Score what was heard; ``extra`` figures belong to the way it was played."""
    exercise, heard = played.exercise, played.heard
    found = {
        soldier.id: compare(soldier, heard[soldier.id].positions, played.start_ns)
        for soldier in exercise.soldiers
    }
    compared = {name: each for name, each in found.items() if each is not None}
    ages = ages_of(exercise)
    pictures = {receiver: _picture(played, receiver, compared) for receiver in _receivers(exercise)}
    events = event_log(exercise, heard, played.start_ns, ages.lost_s, played.duration_s)
    figures = {
        "exercise": exercise.name,
        "duration_s": played.duration_s,
        **(extra or {}),
        "soldiers": [
            soldier_row(soldier, found[soldier.id], exercise)
            | dead_reckoning_row(heard[soldier.id].steps, soldier.truth, played.start_ns)
            for soldier in exercise.soldiers
        ],
        "pictures": [picture_row(receiver, picture, ages) for receiver, picture in pictures.items()],
        "links": _links(played),
        "nets": [_net_row(name, counts, played.duration_s) for name, counts in played.nets.items()],
        "events": [asdict(event) for event in events],
        **_faults(played, ages.stale_s),
    }
    return Result(figures, played, compared, pictures, events)


def _faults(played: Played, stale_s: float) -> dict[str, Any]:
    """What became of the faults, if there were any."""
    if not played.exercise.faults:
        return {}
    rows = fault_rows(
        played.exercise, played.heard, played.outages, played.start_ns, played.duration_s, stale_s
    )
    growth = memory_growth(played.heard)
    return {"faults": rows, "faults_summary": storm_summary(rows, played.outages) | growth}


def ages_of(exercise: Exercise) -> Ages:
    """When the exercise's hubs call a report stale and lost."""
    settings = hub_settings(exercise, exercise.command_post)
    return Ages(settings.stale_s, settings.lost_s)


def _receivers(exercise: Exercise) -> list[str]:
    """All computers, the command post first."""
    return sorted(exercise.computers, key=lambda name: name != exercise.command_post)


def _picture(played: Played, receiver: str, compared: Mapping[str, Compared]) -> Picture:
    others = [each for name, each in compared.items() if name != receiver]
    return sample_picture(played.heard[receiver].reports, others, played.start_ns, played.exercise)


def _links(played: Played) -> list[Row]:
    return [
        link_row(computer, report, played.duration_s)
        for computer, heard in played.heard.items()
        for _, report in sorted(heard.links.items())
    ]


def _net_row(name: str, counts: NetCounts, duration_s: float) -> Row:
    return {"net": name, **asdict(counts), "bits_per_s": 8.0 * counts.bytes / duration_s}
