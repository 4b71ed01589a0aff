"""Who takes part and what they carry: units, posts, kits of sensors, teams of soldiers."""

from typing import Annotated, Literal

from msgspec import Meta

from bootprint.config import Config
from proving_ground.scenario.schema.tasks import Task
from proving_ground.scenario.schema.units import Length, Name, Point, Seconds, Spot

UnitKind = Literal["squad", "platoon", "company"]
Role = Literal[
    "rifleman", "squad_leader", "platoon_leader", "company_leader", "medic", "gunner", "radio_operator"
]
PostRole = Literal["squad_leader", "command_post"]
ImuQuality = Literal["tactical", "industrial", "industrial_old", "consumer"]
ImuPlace = Literal["left_foot", "right_foot", "body"]
FormationKind = Literal["file", "column", "line", "wedge"]
Triple = tuple[float, float, float]


class Unit(Config, kw_only=True, frozen=True):
    """A squad, platoon or company; together they are a tree."""

    id: Annotated[Name, Meta(description="part of the keys on the bus")]
    kind: UnitKind
    parent: Annotated[str | None, Meta(description="the unit it belongs to")] = None
    callsign: Annotated[str, Meta(description="its soldiers' callsigns begin with it (default: the id)")] = ""


class Post(Config, kw_only=True, frozen=True):
    """A computer without a soldier: a squad leader's or a command post's."""

    id: Name
    unit: Annotated[str, Meta(description="whose post it is")]
    role: PostRole = "command_post"
    callsign: str = ""


class Imu(Config, kw_only=True, frozen=True):
    """One inertial unit."""

    place: ImuPlace
    quality: Annotated[ImuQuality, Meta(description="class of its errors")] = "industrial"
    mounting_deg: Annotated[
        Triple, Meta(description="roll, pitch, yaw of its axes against forward-left-up of the foot or body")
    ] = (0.0, 0.0, 0.0)
    askew_deg: Annotated[
        Triple,
        Meta(description="how differently each soldier wears it: sigma of roll, pitch, yaw, drawn once"),
    ] = (10.0, 8.0, 10.0)  # as on the recorded feet (pyshoe-vicon, foot-gcp, gaitmap): 10, 8 and 9
    offset_m: Annotated[
        Triple | None,
        Meta(description="forward, left, up of the foot's ball or the belt (default: laces, belt)"),
    ] = None
    magnetometer: bool = True


class Kit(Config, kw_only=True, frozen=True):
    """What a soldier carries."""

    name: Name
    imus: tuple[Imu, ...] = (
        Imu(place="left_foot", mounting_deg=(5.0, -25.0, 15.0)),
        Imu(place="right_foot", mounting_deg=(-4.0, -22.0, -18.0)),
    )
    gnss: Annotated[
        Literal["none", "honest", "dishonest", "phone"],
        Meta(description="satellite receiver; a dishonest one hides what it does not know"),
    ] = "honest"
    barometer: Annotated[Literal["none", "industrial", "consumer"], Meta(description="its class")] = (
        "industrial"
    )
    camera: Annotated[
        Literal["none", "fast", "rendered"],
        Meta(description="stereo camera: its motion with errors, or image pairs (slow)"),
    ] = "none"
    uwb: Annotated[bool, Meta(description="ranges to the other soldiers that have it")] = False
    foot_ranging: Annotated[bool, Meta(description="ranges between the two feet")] = False

    def __post_init__(self) -> None:
        places = [imu.place for imu in self.imus]
        if twice := {place for place in places if places.count(place) > 1}:
            raise ValueError(f"has more than one inertial unit at {', '.join(sorted(twice))}")


class Formation(Config, kw_only=True, frozen=True):
    """How a team stands and moves around its first member."""

    kind: FormationKind = "file"
    spacing_m: Length = 3.0
    offsets_m: Annotated[
        tuple[Point, ...],
        Meta(description="ahead and to the left of the first, for each member; overrides the kind"),
    ] = ()


class Team(Config, kw_only=True, frozen=True):
    """Soldiers of one unit who act together; for several units alike, one such team each."""

    units: Annotated[
        tuple[str, ...], Meta(min_length=1, description="the unit; of several each gets this team")
    ]
    soldiers: Annotated[int, Meta(ge=1, le=60, description="how many")] = 1
    prefix: Annotated[
        str, Meta(description="ids are this and a number that counts on per unit (default: `unit-`)")
    ] = ""
    callsigns: Annotated[
        tuple[str, ...], Meta(description="for each soldier (default: the unit's and a number)")
    ] = ()
    roles: Annotated[
        tuple[Role, ...], Meta(description="for each soldier in order; the others are riflemen")
    ] = ()
    kit: Annotated[str | None, Meta(description="name of the kit (default: the first)")] = None
    at: Annotated[Spot, Meta(description="where the first member starts: a place, a room or [east, north]")]
    facing_deg: Annotated[float, Meta(description="azimuth that the team faces at first")] = 0.0
    formation: Formation = Formation()
    shift_m: Annotated[
        Point, Meta(description="how far each further unit's numbers for points are shifted")
    ] = (0.0, 0.0)
    start_s: Annotated[Seconds, Meta(description="stands still until then")] = 0.0
    tasks: Annotated[
        tuple[Task, ...], Meta(description="what they do, in order; the manual has the tasks' own tables")
    ]
