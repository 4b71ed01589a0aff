"""What a team does: tasks, told apart by their key ``do``.

Every task may carry ``name`` (others can wait for its end) and ``who`` (numbers of the members that do it).
"""

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from bootprint.config import Config
from proving_ground.scenario.schema.units import Length, Name, Seconds, Speed, Spot

Posture = Literal["stand", "kneel", "prone"]
Way = Literal["stairs", "lift"]
Degrees = Annotated[float, Meta(ge=-720, le=720)]


class TaskTable(Config, kw_only=True, frozen=True, tag_field="do"):
    """What all tasks have."""

    name: Annotated[str, Meta(description="others may wait for this task's end by this name")] = ""
    who: Annotated[
        tuple[Annotated[int, Meta(ge=1)], ...],
        Meta(description="members, counted from 1 (default: all of them)"),
    ] = ()


class MoveTable(TaskTable, kw_only=True, frozen=True):
    """Going somewhere through doors, by stairs or lift where needed; a team sets off together at one pace."""

    to: Annotated[
        Spot,
        Meta(description='a place, a room, "own start", or [east, north] on the same floor, else outside'),
    ]
    via: Annotated[tuple[Spot, ...], Meta(description="passed on the way")] = ()
    speed_m_s: Annotated[
        Speed | None,
        Meta(description="(default: the gait's; alone, the person's own)"),
    ] = None
    by: Annotated[Way, Meta(description="how to change floors")] = "stairs"


class Walk(MoveTable, kw_only=True, frozen=True, tag="walk"):
    """Walk."""

    gait: ClassVar[str] = "walk"


class Run(MoveTable, kw_only=True, frozen=True, tag="run"):
    """Jog at 3 m/s."""

    gait: ClassVar[str] = "run"


class Sprint(MoveTable, kw_only=True, frozen=True, tag="sprint"):
    """Run as fast as kit allows."""

    gait: ClassVar[str] = "sprint"


class Crawl(MoveTable, kw_only=True, frozen=True, tag="crawl"):
    """Crawl on hands and knees."""

    gait: ClassVar[str] = "crawl"


class SideStep(MoveTable, kw_only=True, frozen=True, tag="side_step"):
    """Step sideways to a point, facing across the way."""

    leading: Annotated[Literal["left", "right"], Meta(description="the foot that goes first")] = "left"

    @property
    def gait(self) -> str:
        """The gait of the leading side."""
        return f"side_step_{self.leading}"


class Backward(MoveTable, kw_only=True, frozen=True, tag="backward"):
    """Walk backward to a point."""

    gait: ClassVar[str] = "backward"


class HoldTable(TaskTable, kw_only=True, frozen=True):
    """Staying where one is."""

    for_s: Annotated[Seconds, Meta(description="how long")] = 0.0
    until_s: Annotated[Seconds, Meta(description="at least until this time of the exercise")] = 0.0


class Stand(HoldTable, kw_only=True, frozen=True, tag="stand"):
    """Stand still."""

    posture: ClassVar[Posture] = "stand"


class Kneel(HoldTable, kw_only=True, frozen=True, tag="kneel"):
    """Kneel."""

    posture: ClassVar[Posture] = "kneel"


class Prone(HoldTable, kw_only=True, frozen=True, tag="prone"):
    """Lie prone."""

    posture: ClassVar[Posture] = "prone"


class TakeStairs(TaskTable, kw_only=True, frozen=True, tag="stairs"):
    """Go to the near end of a staircase and climb or descend it."""

    by: Annotated[str, Meta(description="name of the stairs")]
    speed_m_s: Speed | None = None


class TakeLift(TaskTable, kw_only=True, frozen=True, tag="lift"):
    """Go into a lift and ride it."""

    by: Annotated[str, Meta(description="name of the lift")]
    to_floor: int


class Turn(TaskTable, kw_only=True, frozen=True, tag="turn"):
    """Turn on the spot, quickly: to an azimuth, or by an angle to the right."""

    to_deg: Degrees | None = None
    by_deg: Degrees | None = None
    turn_s: Annotated[
        Annotated[float, Meta(ge=0.5)] | None, Meta(description="(default: 90° in 1.1 s, 180° in 1.8 s)")
    ] = None

    def __post_init__(self) -> None:
        if (self.to_deg is None) == (self.by_deg is None):
            raise ValueError("a turn needs either to_deg (an azimuth) or by_deg (clockwise)")


class Wait(TaskTable, kw_only=True, frozen=True, tag="wait"):
    """Wait until a named task of this or another team has ended."""

    until: Annotated[Name, Meta(description="the task's name; of another unit's namesake \"unit/name\"")]
    after_s: Annotated[Seconds, Meta(description="and this much longer")] = 0.0
    posture: Posture = "stand"


class Gather(TaskTable, kw_only=True, frozen=True, tag="gather"):
    """Wait for each other."""

    posture: Posture = "stand"


class StackUp(TaskTable, kw_only=True, frozen=True, tag="stack_up"):
    """Line up along the wall beside a door, on the side one comes from; when all are there, hold."""

    door: Annotated[str, Meta(description="name of the door")]
    spacing_m: Length = 0.8
    hold_s: Annotated[Seconds, Meta(description="until the one behind taps the shoulder")] = 2.0
    gait: Literal["walk", "run"] = "walk"


class Clear(TaskTable, kw_only=True, frozen=True, tag="clear"):
    """Enter a room one after the other and go along its walls to its corners, alternating left and right."""

    room: str
    interval_s: Annotated[Seconds, Meta(description="between one and the next through the door")] = 0.8
    hold_s: Annotated[Seconds, Meta(description="at the corners, scanning")] = 3.0
    speed_m_s: Speed = 1.6


class Bound(TaskTable, kw_only=True, frozen=True, tag="bound"):
    """Buddy rushes: odd members bound forward while even ones cover, then the other way round."""

    to: Spot
    length_m: Annotated[float, Meta(ge=2, description="of one bound")] = 15.0
    gait: Literal["run", "sprint"] = "sprint"
    posture: Annotated[Posture, Meta(description="of those who cover")] = "prone"


class Follow(TaskTable, kw_only=True, frozen=True, tag="follow"):
    """Go in file behind a soldier of a team further up in the file, through that soldier's named task."""

    soldier: Annotated[str, Meta(description="id of the one to follow")]
    task: Annotated[str, Meta(description="name of that soldier's task")]
    spacing_m: Length = 3.0


class Form(TaskTable, kw_only=True, frozen=True, tag="form"):
    """Change the team's formation for the moves to come."""

    kind: Literal["file", "column", "line", "wedge"]
    spacing_m: Length = 3.0


class Repeat(TaskTable, kw_only=True, frozen=True, tag="repeat"):
    """Do some tasks again and again."""

    times: Annotated[int, Meta(ge=1, le=200)]
    tasks: Annotated[tuple["Task", ...], Meta(min_length=1)]


Move = Walk | Run | Sprint | Crawl | SideStep | Backward
Hold = Stand | Kneel | Prone
Task = (
    Move
    | Hold
    | TakeStairs
    | TakeLift
    | Turn
    | Wait
    | Gather
    | StackUp
    | Clear
    | Bound
    | Follow
    | Form
    | Repeat
)
