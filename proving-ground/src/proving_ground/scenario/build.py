"""`build`: a scenario and a seed become an exercise, in which every soldier's sensors have measured everything."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from bootprint.geodesy import azimuth_of
from proving_ground.exercises.exercise import Exercise, Fault, Hub, Net
from proving_ground.exercises.exercise import Soldier as Instrumented
from proving_ground.exercises.processes.emulated_radio import NetProfile
from proving_ground.people import PersonMotion, move
from proving_ground.scenario.cast import Soldier
from proving_ground.scenario.loading import play
from proving_ground.scenario.outfit import Outfit
from proving_ground.scenario.scenario import Play, Scenario
from proving_ground.scenario.surroundings import Surroundings
from proving_ground.sensors.run_writer import write_run_folder
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import Truth

_FIRST_METRES = 2.0
_MOTION, _START = 1, 2  # streams of random numbers of one soldier; sensors have those from 10 on


def build(scenario: Scenario, seed: int, folder: Path | None = None) -> Exercise:
    """The exercise of a seed: the same bytes for the same seed, whatever else is built.

    With a ``folder``, every soldier's run is written there as a run folder named by the soldier's id, and the
    exercise has it as it is read from there; without one, runs stay in memory. Image pairs of kits whose camera is
    rendered go to ``folder/id/camera``.
    """
    played = play(scenario, seed)
    soldiers = tuple(instrumented(scenario, played, seed, folder))
    return exercise_of(scenario, seed, soldiers, played.duration_s)


def exercise_of(
    scenario: Scenario, seed: int, soldiers: tuple[Instrumented, ...], duration_s: float
) -> Exercise:
    """The exercise around soldiers who are instrumented already: posts, nets and faults."""
    cast = scenario.cast
    return Exercise(
        soldiers=soldiers,
        origin=scenario.file.origin,
        name=scenario.name,
        begins=scenario.file.start,
        storeys_m=dict(sorted(scenario.site.heights_m.items())),
        hubs=tuple(Hub(post.id, post.number, post.callsign, post.unit, post.role) for post in cast.posts),
        nets=tuple(_nets(scenario, seed, duration_s)),
        faults=tuple(_faults(scenario)),
    )


def instrumented(
    scenario: Scenario, played: Play, seed: int, folder: Path | None = None
) -> Iterator[Instrumented]:
    """The soldiers one by one, for those who cannot hold all runs at once."""
    surroundings = Surroundings(scenario, played, seed)
    for unit in dict.fromkeys(soldier.unit for soldier in scenario.cast.soldiers):
        members = {soldier.id: soldier for soldier in scenario.cast.soldiers if soldier.unit == unit}
        motions = {name: _motion(soldier, played, seed) for name, soldier in members.items()}
        for name, soldier in members.items():
            others = {other: (members[other], motion) for other, motion in motions.items() if other != name}
            yield _instrumented(Outfit(soldier, motions[name], others, surroundings), folder)


def _motion(soldier: Soldier, played: Play, seed: int) -> PersonMotion:
    stream = np.random.SeedSequence([seed, soldier.number, _MOTION])
    itinerary = played.timetables[soldier.id].itinerary
    return move(played.persons[soldier.id], itinerary, int(stream.generate_state(1)[0]))


def _instrumented(outfit: Outfit, folder: Path | None) -> Instrumented:
    scenario, soldier = outfit.surroundings.scenario, outfit.soldier
    run = outfit.run(f"simulated: {scenario.name}, seed {outfit.surroundings.seed}")
    if folder is not None:
        written = write_run_folder(run, folder / soldier.id)
        run = replace(load_runs([written])[0], truth=run.truth)
        outfit.render(written / "camera")
    return Instrumented(
        id=soldier.id,
        number=soldier.number,
        callsign=soldier.callsign,
        run=run,
        truth=run.truth["body"],
        start=start_of(scenario, soldier, run.truth["body"], outfit.surroundings.seed),
        simulated=True,
        unit=soldier.unit,
        role=soldier.role,
    )


def start_of(scenario: Scenario, soldier: Soldier, truth: Truth, seed: int) -> dict[str, float]:
    """The position, and the azimuth they walk off in, that a soldier is given: as wrong as they say they may be."""
    rng = np.random.default_rng([seed, soldier.number, _START])
    place, facing = scenario.starts[soldier.id]
    sigma_m, sigma_deg = scenario.file.start_sigma_m, scenario.file.start_azimuth_sigma_deg
    east, north, up = place[0] + rng.normal(0.0, sigma_m, 3) * (1.0, 1.0, 0.0)
    yaw = _first_course(truth, facing)
    azimuth_deg = math.degrees(azimuth_of(math.cos(yaw), math.sin(yaw))) + rng.normal(0.0, sigma_deg)
    return {
        "east_m": float(east),
        "north_m": float(north),
        "up_m": float(up),
        "sigma_m": max(sigma_m, 0.05),
        "azimuth_deg": azimuth_deg % 360.0,
        "azimuth_sigma_deg": max(sigma_deg, 0.1),
    }


def _first_course(truth: Truth, facing: float) -> float:
    """Yaw of the first metres gone, whichever way the body faces; of the body if it stays where it is."""
    way = truth.position_m[:, :2] - truth.position_m[0, :2]
    gone = np.flatnonzero(np.hypot(way[:, 0], way[:, 1]) >= _FIRST_METRES)
    return float(np.arctan2(way[gone[0], 1], way[gone[0], 0])) if gone.size else facing


def _nets(scenario: Scenario, seed: int, duration_s: float) -> Iterator[Net]:
    for index, (name, net, members) in enumerate(scenario.cast.nets):
        profile = NetProfile.of_radio(
            name,
            net.profile,
            rate_bits_per_s=net.rate_bits_per_s,
            latency_s=net.latency_s,
            loss=net.loss,
            header_bytes=net.header_bytes,
            seed=int(np.random.SeedSequence([seed, index]).generate_state(1)[0]),
        )
        outages = tuple(
            (span.from_s, duration_s if span.until_s is None else span.until_s) for span in net.outages
        )
        yield Net(profile, members, outages)


def _faults(scenario: Scenario) -> Iterator[Fault]:
    """In order of time, the scenario's own order among those of one time."""
    for fault in sorted(scenario.file.faults, key=lambda fault: fault.at_s):
        values = msgspec.structs.asdict(fault)
        details = {
            name: value
            for name, value in values.items()
            if name not in ("at_s", "target") and value is not None
        }
        kind = str(type(fault).__struct_config__.tag)
        yield Fault(fault.at_s, kind, fault.target, details)
