"""The scenario file as a whole."""

from datetime import UTC, datetime
from typing import Annotated

from msgspec import Meta

from bootprint.config import Config, Origin
from proving_ground.scenario.schema.faults import Fault
from proving_ground.scenario.schema.people import Kit, Post, Team, Unit
from proving_ground.scenario.schema.site import SiteTable
from proving_ground.scenario.schema.units import Length, Name, Seconds
from proving_ground.scenario.schema.world import Magnetic, Net, Weather, Zone


class ScenarioFile(Config, kw_only=True, frozen=True):
    """What stands in a scenario's TOML file, top level."""

    title: Name
    purpose: Annotated[Name, Meta(description="what it is there to show")]
    source: Annotated[str, Meta(description="where its figures come from")] = ""
    origin: Annotated[Origin, Meta(description="where east, north and up are zero")]
    start: Annotated[
        Annotated[datetime, Meta(tz=True)], Meta(description="when it begins, with its time zone")
    ] = datetime(2026, 6, 1, 8, 0, tzinfo=UTC)
    settle_s: Annotated[
        Seconds, Meta(description="everybody stands still at first: sensors align themselves")
    ] = 8.0
    start_sigma_m: Annotated[
        Seconds, Meta(description="error of the start position that everybody is given, one sigma an axis")
    ] = 0.5
    start_azimuth_sigma_deg: Annotated[
        Seconds, Meta(description="error of the start azimuth that everybody is given, one sigma")
    ] = 2.0
    duration_s: Annotated[Length | None, Meta(description="(default: until the last task has ended)")] = None
    site: SiteTable = SiteTable()
    units: Annotated[tuple[Unit, ...], Meta(min_length=1)]
    posts: tuple[Post, ...] = ()
    kits: Annotated[tuple[Kit, ...], Meta(min_length=1)] = (Kit(name="standard"),)
    teams: Annotated[tuple[Team, ...], Meta(min_length=1)]
    zones: tuple[Zone, ...] = ()
    magnetic: Annotated[tuple[Magnetic, ...], Meta(description="disturbances of the earth's field")] = ()
    weather: Weather = Weather()
    nets: tuple[Net, ...] = ()
    faults: tuple[Fault, ...] = ()
