"""The live table of an exercise: who is where, how wrong, how old at the command post, over how few bits."""

import math

import numpy as np
from rich.console import Group, RenderableType
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from bootprint.clock import NS_PER_S
from bootprint.messages import Position, Track
from bootprint.prediction import moved_m
from proving_ground.exercises.exercise import Soldier
from proving_ground.exercises.processes.stage import Stage
from proving_ground.exercises.scoring.score import truth_at

_MOST_ROWS = 16  # a table of more has no room; the others are in the last line


class LiveView:
    """Renders a stage; errors are those of simulated soldiers, whose truth stands on the same map."""

    def __init__(self, stage: Stage, duration_s: float) -> None:
        self._stage = stage
        self._soldiers = stage.exercise.soldiers
        self._post = stage.exercise.command_post
        self._progress = Progress(
            TextColumn("[bold]exercise"),
            BarColumn(None),
            TextColumn("{task.completed:5.0f} of {task.total:.0f} s"),
            TimeRemainingColumn(),
        )
        self._task = self._progress.add_task("exercise", total=duration_s)

    def render(self) -> RenderableType:
        """The table with its progress bar, as of now."""
        self._progress.update(self._task, completed=max(0.0, self._stage.elapsed_s))
        return Group(self._table(), self._nets(), self._progress)

    def line(self) -> str:
        """The same in one line, for machines."""
        errors = [
            error
            for soldier in self._soldiers
            if (error := self._error_m(soldier, self._position(soldier))) is not None
        ]
        known = len(self._stage.observers.newest_tracks(self._post).keys() - {self._post})
        middle = f", median error {sorted(errors)[len(errors) // 2]:.2f} m" if errors else ""
        placed = sum(self._position(soldier) is not None for soldier in self._soldiers)
        return (
            f"{self._stage.elapsed_s:6.1f} s  {placed} of {len(self._soldiers)} have a position{middle}, "
            f"{self._post} knows {known}"
        )

    def _position(self, soldier: Soldier) -> Position | None:
        return self._stage.observers.newest_position(soldier.id)

    def _table(self) -> Table:
        table = Table(title=f"{self._stage.exercise.name}: the picture at {self._post}", expand=True)
        for name in ("soldier", "east m", "north m", "floor", "mode", "error m", "95 % radius m"):
            table.add_column(name, justify="left" if name in ("soldier", "mode") else "right")
        for name in ("age there s", "picture off m"):
            table.add_column(name, justify="right", style="cyan")
        picture = self._stage.observers.newest_tracks(self._post)
        for soldier in self._soldiers[:_MOST_ROWS]:
            table.add_row(*self._row(soldier, picture.get(soldier.id)))
        if (more := len(self._soldiers) - _MOST_ROWS) > 0:
            table.caption = f"and {more} more"
        return table

    def _row(self, soldier: Soldier, track: Track | None) -> tuple[str, ...]:
        position = self._position(soldier)
        name = f"{soldier.callsign} ({soldier.id})"
        if position is None:
            return (name, *["–"] * 8)
        return (
            name,
            f"{position.east_m:.1f}",
            f"{position.north_m:.1f}",
            "–" if position.floor is None else str(position.floor),
            position.mode,
            _metres(self._error_m(soldier, position)),
            f"{_radius_95_m(position):.1f}",
            *self._picture(position, track),
        )

    def _picture(self, position: Position, track: Track | None) -> tuple[str, str]:
        """Age of the command post's track, and how far off its prediction is from the fused position."""
        if track is None:
            return "never", "–"
        age_s = (self._stage.clock.now_ns() - track.time_ns) / NS_PER_S
        ahead_s = (position.time_ns - track.time_ns) / NS_PER_S
        east_m, north_m, _ = self._stage.frame.to_enu(
            track.latitude_deg, track.longitude_deg, track.height_m or self._stage.frame.origin.height_m
        )
        gone_east_m, gone_north_m = moved_m(track.east_velocity_m_s, track.north_velocity_m_s, ahead_s)
        off_m = math.hypot(east_m + gone_east_m - position.east_m, north_m + gone_north_m - position.north_m)
        return f"{age_s:.1f}", f"{off_m:.1f}"

    def _nets(self) -> Table:
        table = Table(expand=True)
        for name in ("net", "members", "bit/s so far", "of", "frames", "missed"):
            table.add_column(name, justify="left" if name == "net" else "right")
        elapsed_s = max(self._stage.elapsed_s, 1.0)
        for net in self._stage.exercise.nets[:_MOST_ROWS]:
            counts = self._stage.nets[net.profile.name].counts
            table.add_row(
                net.profile.name,
                str(len(net.members)),
                f"{8.0 * counts.bytes / elapsed_s:.0f}",
                f"{net.profile.rate_bits_per_s:.0f}",
                str(counts.datagrams),
                str(counts.lost),
            )
        return table

    def _error_m(self, soldier: Soldier, position: Position | None) -> float | None:
        if position is None or position.mode == "unplaced" or not soldier.simulated:
            return None
        time_s = np.array([(position.time_ns - self._stage.start_ns) / NS_PER_S])
        east_m, north_m, _ = truth_at(soldier.truth, time_s)[0]
        return math.hypot(position.east_m - east_m, position.north_m - north_m)


def _metres(error_m: float | None) -> str:
    return "–" if error_m is None else f"{error_m:.2f}"


def _radius_95_m(position: Position) -> float:
    """Radius of the circle with the area of the horizontal 95 % ellipse."""
    ee, en, _, nn, _, _ = position.covariance_m2
    return math.sqrt(5.991 * math.sqrt(max(ee * nn - en * en, 0.0)))
