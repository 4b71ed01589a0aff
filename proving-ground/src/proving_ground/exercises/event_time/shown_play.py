"""An exercise played at a steady pace in one process, under the command post's real page.

Real hubs speak over emulated nets; only sensors and fusion are left out, since fusion's word is told from the true
walks (`radio_load.telling`). For screenshots, browser tests and whoever wants a moving picture at once.
"""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S, ScaledClock
from bootprint.config import Member
from bootprint.display import Ages
from bootprint.geodesy import LocalFrame
from bootprint.messages import Fix
from proving_ground.exercises.event_time.line import Line
from proving_ground.exercises.event_time.radio_play import RadioPlay
from proving_ground.exercises.exercise import Exercise, Fault, Settings, Soldier
from proving_ground.exercises.processes.exercise_files import hub_settings, write_plan
from proving_ground.positions import position_at
from proving_ground.radio_load.telling import DELAY_S, INDOORS, PERIOD_S, told
from sa_hub.page.app import build_app
from sa_hub.page.audit import Audit
from sa_hub.page.desk import Desk
from sa_hub.page.operations import Post
from sa_hub.page.server import PageServer
from sa_hub.page.settings import PageSettings
from sensor_gateway.recordings.run import Run, Truth

if TYPE_CHECKING:
    from proving_ground.scenario import Scenario
    from proving_ground.scenario.cast import Soldier as CastSoldier
    from sa_hub.history.archive import Archive

_TELLING: Final = 2
_STOP_S: Final = 10.0


def walked_exercise(
    name: str, seed: int, silent_from_s: dict[str, float] | None = None, hub: dict[str, float] | None = None
) -> tuple[Exercise, dict[str, Line]]:
    """A library scenario whose people walk without sensors, and what their fusions would say.

    ``silent_from_s``: soldiers whose radio is gone from then on; ``hub``: values of ``[hub]`` that differ.
    """
    from proving_ground.scenario import load_scenario
    from proving_ground.scenario.build import exercise_of
    from proving_ground.scenario.geojson import write_plan as plan_of

    scenario = load_scenario(name)
    walks = _walks(scenario, seed)
    soldiers = tuple(_soldier(each, walks[each.id]) for each in scenario.cast.soldiers)
    lasts_s = max(float(truth.time_s[-1]) for truth in walks.values())
    exercise = exercise_of(scenario, seed, soldiers, lasts_s)
    silent = tuple(Fault(at_s, "radio_gone", soldier) for soldier, at_s in (silent_from_s or {}).items())
    exercise = replace(
        exercise,
        site=plan_of(scenario.site, scenario.file.site, scenario.file.origin),
        faults=(*exercise.faults, *silent),
        settings=Settings(hub=hub or {}),
    )
    return exercise, {soldier.id: _line(exercise, soldier, seed) for soldier in soldiers}


def _walks(scenario: "Scenario", seed: int) -> dict[str, Truth]:
    from proving_ground.people import move
    from proving_ground.scenario.loading import play

    played = play(scenario, seed)
    walks: dict[str, Truth] = {}
    for soldier in scenario.cast.soldiers:
        stream = np.random.SeedSequence([seed, soldier.number])
        itinerary = played.timetables[soldier.id].itinerary
        motion = move(played.persons[soldier.id], itinerary, int(stream.generate_state(1)[0]))
        walks[soldier.id] = motion.truth(PERIOD_S)
    return walks


def _soldier(cast: "CastSoldier", truth: Truth) -> Soldier:
    run = Run(cast.id, "dual", Path(), {}, {"body": truth})
    return Soldier(
        cast.id, cast.number, cast.callsign, run, truth, {}, simulated=True, unit=cast.unit, role=cast.role
    )


def _line(exercise: Exercise, soldier: Soldier, seed: int) -> Line:
    """Positions with the errors that fusion has indoors."""
    rng = np.random.default_rng([seed, soldier.number, _TELLING])
    place_m, velocity_m_s = told(soldier.truth.position_m, INDOORS, rng)
    frame = LocalFrame(exercise.origin)
    floors = exercise.floors(place_m[:, 2]) if len(exercise.storeys_m) > 1 else None
    line = Line(soldier.id)
    for index, (enu_m, velocity) in enumerate(zip(place_m.tolist(), velocity_m_s.tolist(), strict=True)):
        time_ns = exercise.begins_ns + round(soldier.truth.time_s[index] * NS_PER_S)
        position = position_at(
            time_ns,
            enu_m,
            frame.to_geodetic(*enu_m),
            (INDOORS.error_m**2, INDOORS.error_m**2, 1.0),
            velocity_m_s=velocity,
            sequence=index,
            floor=None if floors is None else int(floors[index]),
        )
        line.positions.append((time_ns + round(DELAY_S * NS_PER_S), position))
    return line


@dataclass(frozen=True)
class Pace:
    """Event time runs so many times as fast as the host's, from ``from_s`` of the exercise on (hurried until)."""

    speed: float = 1.0
    from_s: float = 0.0


class ShownPlay:
    """Plays in a thread of its own until closed; ``address`` is the page's."""

    def __init__(
        self,
        exercise: Exercise,
        lines: dict[str, Line],
        folder: Path,
        pace: Pace = Pace(),
        settings: PageSettings | None = None,
        archive: "Archive | None" = None,
    ) -> None:
        self._pace = pace
        self._archive = archive
        self._post = exercise.command_post
        self._exercise = exercise
        self._start_ns = exercise.begins_ns
        self._clock: ScaledClock | None = None
        self._ahead_ns = 0
        self._now_ns = self._start_ns
        self._jobs: deque[Callable[[], Iterable[Envelope]]] = deque()
        self._stop = threading.Event()
        end_ns = self._start_ns + round(86_400 * NS_PER_S)
        self._play = RadioPlay(exercise, lines, self._start_ns, end_ns, watcher=self)
        folder.mkdir(parents=True, exist_ok=True)
        write_plan(folder, exercise)
        settings = settings or PageSettings(port=0)
        self.desk = Desk(
            self._as_post(),
            Audit(folder / "audit.jsonl"),
            plan=folder / "plan.geojson",
            basemap=None if settings.basemap is None else folder / settings.basemap,
            archive=archive,
        )
        self._server = PageServer(build_app(self.desk, settings), settings, folder, "page")
        self.address = self._server.address
        self._thread = threading.Thread(target=self._play.run, name="exercise", daemon=True)

    def __enter__(self) -> "ShownPlay":
        self._server.start()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(_STOP_S)
        self._server.close()

    @property
    def elapsed_s(self) -> float:
        """Event seconds since the beginning."""
        return (self._now_ns - self._start_ns) / NS_PER_S

    def say(self, envelope: Envelope) -> None:
        """A message on some computer's bus, from any thread."""
        computer = envelope.address.soldier
        self._jobs.append(lambda: self._play.hand(computer, envelope, self._now_ns))

    def before(self, now_ns: int) -> bool:
        """`RadioPlay` is about to do a step: wait for its time; False ends it."""
        self._now_ns = now_ns
        if self.elapsed_s >= self._pace.from_s:
            if self._clock is None:
                self._clock = ScaledClock(self._pace.speed, time.time_ns())
                self._ahead_ns = now_ns - self._clock.now_ns()
            self._stop.wait(self._clock.host_seconds_until(now_ns - self._ahead_ns))
        while self._jobs:
            for _ in self._jobs.popleft()():
                pass
        return not self._stop.is_set()

    def kept(self, computer: str, envelopes: list[Envelope]) -> None:
        """What a computer's hub says."""
        if computer == self._post:
            self.desk.tell(envelopes)
            if self._archive is not None:
                self._archive.store(envelopes)

    def _as_post(self) -> Post:
        realm = self._exercise.realm
        hub = hub_settings(self._exercise, self._post)
        return Post(
            realm=realm,
            member=realm.member(self._post),
            ages=Ages(round(hub.stale_s * NS_PER_S), round(hub.lost_s * NS_PER_S)),
            speed=self._pace.speed,
            now_ns=lambda: self._now_ns,
            publish=self._published,
            place=self._placed,
            on_bus=lambda _member: False,
        )

    def _published(self, envelope: Envelope) -> None:
        self.say(envelope)
        self.kept(self._post, [envelope])

    def _placed(self, fix: Fix, member: Member) -> None:
        self._jobs.append(lambda: self._play.place(self._post, fix, member, self._now_ns))
