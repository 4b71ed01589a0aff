"""Runs as files for gateways to play: what is held in memory is written to run folders, and then let go."""

import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

from proving_ground.exercises.exercise import Exercise
from proving_ground.exercises.faults.sensor_faults import with_faults
from proving_ground.sensors.run_writer import write_run_folder
from sensor_gateway.recordings.run import ImuSeries, Run

_FEW = 4  # so few are written sooner than a pool starts


def with_files(exercise: Exercise, folder: Path) -> Exercise:
    """The same exercise, every soldier's run at a path that holds it, sensor faults done to those from memory.

    What has a path already stays as it is.
    """
    missing = {
        soldier.id: with_faults(soldier.run, exercise.faults, soldier.id)
        for soldier in exercise.soldiers
        if soldier.run.path == Path()
    }
    folders = [folder / soldier / "run" for soldier in missing]
    written = dict(zip(missing, _write(list(missing.values()), folders), strict=True))
    soldiers = tuple(
        replace(soldier, run=_at(missing[soldier.id], written[soldier.id]))
        if soldier.id in missing
        else soldier
        for soldier in exercise.soldiers
    )
    return replace(exercise, soldiers=soldiers)


def _write(runs: list[Run], folders: list[Path]) -> list[Path]:
    if len(runs) <= _FEW:
        return list(map(write_run_folder, runs, folders))
    context = multiprocessing.get_context("forkserver")
    with ProcessPoolExecutor(os.cpu_count(), context) as pool:
        return list(pool.map(write_run_folder, runs, folders))


def _at(run: Run, path: Path) -> Run:
    return replace(run, path=path, name=path.name)


def without_samples(exercise: Exercise) -> Exercise:
    """The same exercise, of whose inertial units only the first and the last sample are left.

    A stage of forty soldiers needs no more of them than how long they last, and has better use for a gigabyte.
    """
    soldiers = tuple(
        replace(
            soldier, run=replace(soldier.run, imus={p: _ends(imu) for p, imu in soldier.run.imus.items()})
        )
        for soldier in exercise.soldiers
    )
    return replace(exercise, soldiers=soldiers)


def _ends(imu: ImuSeries) -> ImuSeries:
    ends = [0, -1]
    mag = None if imu.mag_ut is None else imu.mag_ut[ends]
    return ImuSeries(imu.time_s[ends], imu.accel_m_s2[ends], imu.gyro_rad_s[ends], mag)
