"""What surrounds the soldiers: zones for GPS, magnetism and light, weather, radio nets."""

from typing import Annotated, Literal

from msgspec import Meta

from bootprint.config import Config
from bootprint.errors import ConfigError
from proving_ground.scenario.schema.units import (
    Length,
    Outline,
    Point,
    Rectangle,
    Seconds,
    Share,
    outline_of,
)
from sa_hub.radio.profiles import named

Vector = tuple[float, float, float]


class Span(Config, kw_only=True, frozen=True):
    """A stretch of exercise time."""

    from_s: Annotated[Seconds, Meta(description="since the exercise's start")] = 0.0
    until_s: Annotated[Seconds | None, Meta(description="(default: to the end)")] = None

    def __post_init__(self) -> None:
        if self.until_s is not None and self.until_s <= self.from_s:
            raise ValueError(f"until_s {self.until_s:g} must be after from_s {self.from_s:g}")


class ZoneTable(Span, kw_only=True, frozen=True, tag_field="kind"):
    """Where and when: a building, a room, a rectangle, a polygon, or (none of them) everywhere."""

    building: str | None = None
    room: str | None = None
    rectangle_m: Rectangle | None = None
    polygon_m: Outline | None = None
    floors: Annotated[tuple[int, ...], Meta(description="levels (default: all)")] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        given = [self.building, self.room, self.rectangle_m, self.polygon_m]
        if sum(value is not None for value in given) > 1:
            raise ValueError("a zone is one of building, room, rectangle_m and polygon_m, not several")

    @property
    def outline_m(self) -> tuple[Point, ...] | None:
        """The zone's own corners, if it has any."""
        if self.rectangle_m is None and self.polygon_m is None:
            return None
        return outline_of(self.rectangle_m, self.polygon_m)


class Denied(ZoneTable, kw_only=True, frozen=True, tag="gnss_denied"):
    """No satellites."""

    fade_m: Annotated[Length, Meta(description="behind the zone's edge over which reception fades away")] = (
        4.0
    )


class Multipath(ZoneTable, kw_only=True, frozen=True, tag="multipath"):
    """A street: reflections that the stated accuracy does not tell of, and places without reception."""

    bias_m: Annotated[Length, Meta(description="size of the reflections' error; 10 between high houses")] = (
        6.0
    )
    outage_share: Annotated[Share, Meta(description="share of the ground without reception")] = 0.1


class Jammed(ZoneTable, kw_only=True, frozen=True, tag="jammed"):
    """A jammer."""

    edge_m: Annotated[
        Length, Meta(description="from the zone's edge inwards to where receivers are deaf")
    ] = 50.0


class Spoofed(ZoneTable, kw_only=True, frozen=True, tag="spoofed"):
    """A spoofer that takes over and drags the position away slowly; its fixes look good."""

    drag_m_s: Annotated[Length, Meta(description="how fast")] = 0.5
    towards_deg: Annotated[float, Meta(ge=-360, le=360, description="azimuth of the drag")] = 90.0


class Dark(ZoneTable, kw_only=True, frozen=True, tag="dark"):
    """Too dark for the camera."""

    strength: Annotated[Share, Meta(description="1 is night without a lamp")] = 1.0


class Smoke(ZoneTable, kw_only=True, frozen=True, tag="smoke"):
    """Smoke: contrast falls with distance."""

    extinction_per_m: Annotated[Length, Meta(description="1 hides what is more than a few metres away")] = 1.0


Zone = Denied | Multipath | Jammed | Spoofed | Dark | Smoke


class Dipole(Config, kw_only=True, frozen=True, tag_field="kind", tag="dipole"):
    """A magnetic body: a cabinet, a car, a rifle rack."""

    at_m: Point
    floor: int = 0
    up_m: Annotated[float, Meta(description="above that floor")] = 0.5
    moment_a_m2: Annotated[Vector, Meta(description="east, north, up")]


class Rebar(Config, kw_only=True, frozen=True, tag_field="kind", tag="rebar"):
    """Iron along a line, as in a corridor's floor: a row of dipoles of random strength."""

    points_m: Annotated[tuple[Point, ...], Meta(min_length=2)]
    floor: int = 0
    up_m: float = -0.1
    spacing_m: Annotated[float, Meta(ge=0.2, le=1000)] = 1.5
    moment_a_m2: Annotated[float, Meta(gt=0, description="typical size of each")] = 2.0


Magnetic = Dipole | Rebar


class Weather(Config, kw_only=True, frozen=True):
    """The air outside."""

    offset_pa: Annotated[float, Meta(ge=-8000, le=8000, description="off the standard atmosphere")] = 0.0
    drift_pa_per_sqrt_h: Annotated[
        float, Meta(ge=0, le=500, description="random walk: 30 on a calm day, 150 when a front passes")
    ] = 50.0
    wind_m_s: Annotated[
        float, Meta(ge=0, le=40, description="mean; its gusts disturb barometers outside")
    ] = 3.0


class Net(Config, kw_only=True, frozen=True):
    """A radio net, or one for each unit of a level."""

    name: Annotated[str, Meta(description="of a net with members")] = ""
    members: Annotated[tuple[str, ...], Meta(description="units, soldiers and posts")] = ()
    each: Annotated[
        Literal["squad", "platoon", "company"] | None,
        Meta(
            description="one net for each such unit: all of a squad; above, its own posts and the leaders below"
        ),
    ] = None
    profile: Annotated[
        str | None,
        Meta(description="a named radio (`bootprint radio profiles`) whose figures hold (default: `udp`)"),
    ] = None
    rate_bits_per_s: Annotated[
        Annotated[float, Meta(ge=75, le=1e9)] | None, Meta(description="(default: the radio's)")
    ] = None
    latency_s: Annotated[
        Annotated[float, Meta(ge=0, le=60)] | None, Meta(description="(default: the radio's)")
    ] = None
    loss: Annotated[float, Meta(ge=0, le=0.9, description="share of frames that each receiver misses")] = 0.0
    header_bytes: Annotated[
        Annotated[int, Meta(ge=0, le=200)] | None,
        Meta(description="that the link adds to every frame (default: the radio's)"),
    ] = None
    outages: Annotated[tuple[Span, ...], Meta(description="when the net is down")] = ()

    def __post_init__(self) -> None:
        if (self.each is None) == (not self.members):
            raise ValueError('a net needs either members or each = "squad", "platoon" or "company"')
        if self.members and not self.name:
            raise ValueError("a net with members needs a name")
        if self.profile is not None:
            try:
                named(self.profile)
            except ConfigError as error:
                raise ValueError(str(error)) from error
