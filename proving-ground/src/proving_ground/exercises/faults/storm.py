"""A storm: every kind of fault at random through an exercise, one after the other, by a seed.

A fault begins a while after the one before is over, so that each can be judged by itself. Kinds come in shuffled
rounds: none comes twice before all have come once.
"""

import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

from proving_ground.exercises.event_time.line import RESTART_NS, SOLDIERS_SERVICES
from proving_ground.exercises.exercise import Exercise, Fault

NEXT_AFTER_S: Final = 12.0
"""From a fault's end to the next one: what is to be right again within ten seconds can be seen to be."""
_FIRST_AT_S: Final = 15.0
_HOUR_S: Final = 3600.0
_SECOND_NS: Final = 1_000_000_000
Make = Callable[[random.Random, Exercise, float], Fault]


def with_storm(exercise: Exercise, seed: int, until_s: float | None = None) -> Exercise:
    """The exercise with faults of every kind in it, from its beginning to ``until_s`` (or to its end)."""
    end_s = exercise.duration_s if until_s is None else min(until_s, exercise.duration_s)
    faults = tuple(_faults(exercise, random.Random(seed), end_s - NEXT_AFTER_S))
    return replace(exercise, faults=tuple(sorted((*exercise.faults, *faults), key=lambda fault: fault.at_s)))


def _faults(exercise: Exercise, rng: random.Random, end_s: float) -> Iterator[Fault]:
    at_s = _FIRST_AT_S
    for make in _rounds(rng):
        fault = make(rng, exercise, at_s)
        over_s = over_at_s(fault)
        if over_s > end_s:
            return
        yield fault
        at_s = over_s + NEXT_AFTER_S


def _rounds(rng: random.Random) -> Iterator[Make]:
    while True:
        kinds = list(KINDS.values())
        rng.shuffle(kinds)
        yield from kinds


def over_at_s(fault: Fault) -> float:
    """When nothing is broken any longer: a process that was killed is back by then."""
    if "for_s" in fault.details:
        return fault.until_s
    return fault.at_s + RESTART_NS / _SECOND_NS


def _anyone(rng: random.Random, exercise: Exercise) -> str:
    return rng.choice(exercise.computers)


def _soldier(rng: random.Random, exercise: Exercise) -> str:
    return rng.choice(exercise.soldiers).id


def _of_computer(kind: str, least_s: float, most_s: float, **details: float) -> Make:
    """A fault of any computer that lasts for a while."""

    def make(rng: random.Random, exercise: Exercise, at_s: float) -> Fault:
        for_s = round(rng.uniform(least_s, most_s), 1)
        return Fault(at_s, kind, _anyone(rng, exercise), {"for_s": for_s, **details})

    return make


def _killed(service: str) -> Make:
    def make(rng: random.Random, exercise: Exercise, at_s: float) -> Fault:
        target = _anyone(rng, exercise) if service == "sa-hub" else _soldier(rng, exercise)
        return Fault(at_s, "process_killed", target, {"process": service})

    return make


def _stopped(rng: random.Random, exercise: Exercise, at_s: float) -> Fault:
    details = {"process": rng.choice(SOLDIERS_SERVICES), "for_s": round(rng.uniform(2.0, 10.0), 1)}
    return Fault(at_s, "process_stopped", _soldier(rng, exercise), details)


def _sensor(kind: str) -> Make:
    def make(rng: random.Random, exercise: Exercise, at_s: float) -> Fault:
        soldier = rng.choice(exercise.soldiers)
        details = {"sensor": rng.choice(sorted(soldier.run.imus)), "for_s": round(rng.uniform(3.0, 10.0), 1)}
        return Fault(at_s, kind, soldier.id, details)

    return make


def _radio(rng: random.Random, exercise: Exercise, at_s: float) -> Fault:
    target = rng.choice([*exercise.computers, *(net.profile.name for net in exercise.nets)])
    return Fault(at_s, "radio_gone", target, {"for_s": round(rng.uniform(30.0, 60.0), 1)})


def _parted(rng: random.Random, exercise: Exercise, at_s: float) -> Fault:
    net = rng.choice(exercise.nets)
    apart = tuple(sorted(rng.sample(net.members, max(1, len(net.members) // 2))))
    return Fault(
        at_s, "net_parted", net.profile.name, {"apart": apart, "for_s": round(rng.uniform(10.0, 30.0), 1)}
    )


def _clock(rng: random.Random, exercise: Exercise, at_s: float) -> Fault:
    details = {"jump_s": rng.choice((-_HOUR_S, _HOUR_S)), "for_s": round(rng.uniform(10.0, 20.0), 1)}
    return Fault(at_s, "clock_jump", _anyone(rng, exercise), details)


KINDS: Final[dict[str, Make]] = {
    **{f"{service} killed": _killed(service) for service in SOLDIERS_SERVICES},
    **{
        kind.replace("_", " "): _sensor(kind)
        for kind in ("sensor_unplugged", "sensor_frozen", "sensor_saturated", "sensor_nan")
    },
    "process stopped": _stopped,
    "power cut": _of_computer("power_cut", 3.0, 8.0),
    "router killed": _of_computer("router_killed", 1.0, 4.0),
    "radio gone": _radio,
    "net parted": _parted,
    "clock jump": _clock,
    "disk full": _of_computer("disk_full", 5.0, 15.0),
    "memory short": _of_computer("memory_short", 5.0, 15.0),
    "bus flood": _of_computer("bus_flood", 5.0, 10.0, times=10.0),
}
