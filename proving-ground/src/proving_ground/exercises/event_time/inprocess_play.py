"""`--mode inprocess`: an exercise in event time, as fast as it goes; the same seed gives the same result.

Soldiers' lines first, on as many local processes as wanted; then all hubs and the radio between them.
"""

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from bootprint.clock import NS_PER_S
from bootprint.recording import Recorder
from pdr_engine.foot import warm_up
from proving_ground.exercises.event_time.line import Line, LineJob, back_after_ns, killed_by, play_line
from proving_ground.exercises.event_time.radio_play import RadioPlay
from proving_ground.exercises.exercise import Exercise, Soldier
from proving_ground.exercises.faults.sensor_faults import with_faults
from proving_ground.exercises.processes.exercise_files import check_exercise, soldier_settings
from proving_ground.exercises.scoring.result import Played
from proving_ground.exercises.scoring.truth_record import record_truth

SETTLE_S = 4.0  # event seconds after the last walk, for the last reports to arrive
OnProgress = Callable[[str, float], None]
"""Is told what is being done, and the share of it that is."""


def _quietly(_what: str, _share: float) -> None:
    """Nobody watches."""


def play_in_process(
    exercise: Exercise,
    *,
    workers: int = 1,
    duration_s: float | None = None,
    record: Path | None = None,
    on_progress: OnProgress = _quietly,
) -> Played:
    """Play the whole exercise, or its first ``duration_s``. ConfigError if its settings are wrong."""
    check_exercise(exercise)
    lasts_s = exercise.duration_s + SETTLE_S if duration_s is None else duration_s
    start_ns = exercise.begins_ns
    end_ns = start_ns + round(lasts_s * NS_PER_S)
    with ExitStack() as stack:
        recorder = None if record is None else stack.enter_context(Recorder(record, overwrite=True))
        jobs = [
            line_job(exercise, soldier, start_ns, end_ns, recorder is not None)
            for soldier in exercise.soldiers
        ]
        lines = {}
        for line in play_lines(jobs, workers, on_progress):
            lines[line.soldier] = line
            if recorder is not None:
                _record(recorder, line)
        radio = RadioPlay(exercise, lines, start_ns, end_ns, recorder)
        radio.run(lambda share: on_progress("radio", share))
        if recorder is not None:
            record_truth(recorder, exercise, start_ns)
    nets = {name: air.counts for name, air in radio.airs.items()}
    return Played(exercise, start_ns, lasts_s, radio.heard, nets)


def line_job(exercise: Exercise, soldier: Soldier, start_ns: int, end_ns: int, record: bool) -> LineJob:
    """What a soldier's line needs, sensor faults done to the run and kills noted."""
    pdr, fusion = soldier_settings(exercise, soldier)
    kills = tuple(
        (begin_ns, begin_ns + back_after_ns(fault), service)
        for fault in exercise.faults
        if fault.target == soldier.id
        for begin_ns in (start_ns + round(fault.at_s * NS_PER_S),)
        for service in killed_by(fault)
    )
    return LineJob(
        identity=exercise.identity(soldier.id),
        origin=exercise.origin,
        run=with_faults(soldier.run, exercise.faults, soldier.id),
        pdr=pdr,
        fusion=fusion,
        start_ns=start_ns,
        end_ns=end_ns,
        kills=kills,
        record=record,
    )


def play_lines(jobs: Sequence[LineJob], workers: int, on_progress: OnProgress = _quietly) -> Iterator[Line]:
    """The jobs' lines in their order, played here or by a pool of processes."""
    warm_up()  # compiles the foot filter once, if nobody has yet, rather than in every worker
    with ExitStack() as stack:
        if workers > 1 and len(jobs) > 1:
            context = multiprocessing.get_context("forkserver")
            pool = stack.enter_context(ProcessPoolExecutor(min(workers, len(jobs)), context))
            lines = pool.map(play_line, jobs)
        else:
            lines = map(play_line, jobs)
        for count, line in enumerate(lines, start=1):
            on_progress("soldiers", count / len(jobs))
            yield line


def _record(recorder: Recorder, line: Line) -> None:
    for key, payload, at_ns in line.recorded:
        recorder.write_payload(key, payload, at_ns)
    line.recorded.clear()
