"""The demo's live table: who is where, how wrong, how old at the command post, over how few bits."""

import math

from rich.console import Group, RenderableType
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from bootprint.clock import NS_PER_S
from bootprint.messages import Position, Track
from proving_ground.exercises.exercise import COMMAND_POST, LEADER, Soldier
from proving_ground.exercises.score import Compared, compare
from proving_ground.exercises.stage import Stage


class LiveView:
    """Renders a stage; errors are computed from what has been heard so far."""

    def __init__(self, stage: Stage, duration_s: float) -> None:
        self._stage = stage
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
        return Group(self._table(), self._links(), self._progress)

    def line(self) -> str:
        """The same in one line, for machines."""
        parts = [
            f"{soldier.callsign} {_metres(self._error_m(soldier))}"
            for soldier in self._stage.exercise.soldiers
        ]
        known = len(self._stage.observers[COMMAND_POST].newest_tracks())
        return f"{self._stage.elapsed_s:6.1f} s  error {', '.join(parts)}  command post knows {known}"

    def _table(self) -> Table:
        table = Table(title="bootprint demo: a squad indoors, its picture at the command post", expand=True)
        for name in ("soldier", "east m", "north m", "floor", "mode", "error m", "95 % radius m"):
            table.add_column(name, justify="left" if name in ("soldier", "mode") else "right")
        for name in ("age at CP s", "picture off m", "radio bit/s"):
            table.add_column(name, justify="right", style="cyan")
        picture = self._stage.observers[COMMAND_POST].newest_tracks()
        for soldier in self._stage.exercise.soldiers:
            table.add_row(*self._row(soldier, picture.get(soldier.id)))
        return table

    def _row(self, soldier: Soldier, track: Track | None) -> tuple[str, ...]:
        position = self._stage.observers[soldier.id].newest_position()
        links = self._stage.observers[soldier.id].heard().links
        rate = f"{sum(link.bits_per_s for link in links.values()):.0f}" if links else "–"
        name = f"{soldier.callsign} ({soldier.id})"
        if position is None:
            return (name, *["–"] * 8, rate)
        return (
            name,
            f"{position.east_m:.1f}",
            f"{position.north_m:.1f}",
            "–" if position.floor is None else str(position.floor),
            position.mode,
            _metres(self._error_m(soldier)),
            f"{_radius_95_m(position):.1f}",
            *self._picture(position, track),
            rate,
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
        off_m = math.hypot(
            east_m + ahead_s * track.east_velocity_m_s - position.east_m,
            north_m + ahead_s * track.north_velocity_m_s - position.north_m,
        )
        return f"{age_s:.1f}", f"{off_m:.1f}"

    def _links(self) -> Table:
        table = Table(expand=True)
        for name in ("link", "bit/s", "budget", "frames out", "frames in", "lost", "rejected"):
            table.add_column(name, justify="left" if name == "link" else "right")
        for computer in (LEADER, COMMAND_POST):
            for link in self._stage.observers[computer].heard().links.values():
                table.add_row(
                    f"{computer} on {link.link}",
                    f"{link.bits_per_s:.0f}",
                    f"{link.budget_bits_per_s:.0f}",
                    *(
                        str(n)
                        for n in (
                            link.frames_sent,
                            link.frames_received,
                            link.frames_lost,
                            link.frames_rejected,
                        )
                    ),
                )
        return table

    def _error_m(self, soldier: Soldier) -> float | None:
        compared = self._compare(soldier)
        return None if compared is None else float(math.hypot(*compared.errors_m[-1]))

    def _compare(self, soldier: Soldier) -> Compared | None:
        return compare(soldier, self._stage.observers[soldier.id].heard().positions, self._stage.start_ns)


def _metres(error_m: float | None) -> str:
    return "–" if error_m is None else f"{error_m:.2f}"


def _radius_95_m(position: Position) -> float:
    """Radius of the circle with the area of the horizontal 95 % ellipse."""
    ee, en, _, nn, _, _ = position.covariance_m2
    return math.sqrt(5.991 * math.sqrt(max(ee * nn - en * en, 0.0)))
