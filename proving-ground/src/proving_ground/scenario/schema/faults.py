"""Faults to inject: what breaks, whose it is, and when."""

from typing import Annotated, Literal

from msgspec import Meta

from bootprint.config import Config
from proving_ground.scenario.schema.units import Length, Seconds


class FaultTable(Config, kw_only=True, frozen=True, tag_field="kind"):
    """Something that breaks."""

    at_s: Seconds
    target: Annotated[str, Meta(description="soldier, post or, for radio_gone and net_parted, net")]


class SensorFault(FaultTable, kw_only=True, frozen=True):
    """A sensor of a soldier."""

    sensor: Annotated[
        Literal["left_foot", "right_foot", "body", "gnss", "pressure", "camera", "range"],
        Meta(description="which"),
    ]
    for_s: Annotated[Length | None, Meta(description="how long (default: to the end)")] = None


class Unplugged(SensorFault, kw_only=True, frozen=True, tag="sensor_unplugged"):
    """It sends nothing."""


class Frozen(SensorFault, kw_only=True, frozen=True, tag="sensor_frozen"):
    """It repeats its last value."""


class Saturated(SensorFault, kw_only=True, frozen=True, tag="sensor_saturated"):
    """It sticks at the end of its range."""


class NotANumber(SensorFault, kw_only=True, frozen=True, tag="sensor_nan"):
    """It sends NaN."""


class ProcessKilled(FaultTable, kw_only=True, frozen=True, tag="process_killed"):
    """A service is killed without warning."""

    process: Literal["sensor-gateway", "pdr-engine", "fusion", "sa-hub"]


class ProcessStopped(FaultTable, kw_only=True, frozen=True, tag="process_stopped"):
    """A service stands still: what others tell it piles up; then it goes on."""

    process: Literal["sensor-gateway", "pdr-engine", "fusion", "sa-hub"]
    for_s: Length


class PowerCut(FaultTable, kw_only=True, frozen=True, tag="power_cut"):
    """The computer loses power: router and services are gone at once, and start again later."""

    for_s: Length = 5.0


class RouterKilled(FaultTable, kw_only=True, frozen=True, tag="router_killed"):
    """The computer's router dies and is started again."""

    for_s: Length = 2.0


class RadioGone(FaultTable, kw_only=True, frozen=True, tag="radio_gone"):
    """A computer's radio, or a whole net, is silent."""

    for_s: Length


class NetParted(FaultTable, kw_only=True, frozen=True, tag="net_parted"):
    """A net falls into two parts that do not hear each other."""

    apart: Annotated[tuple[str, ...], Meta(min_length=1, description="its members on one side")]
    for_s: Length


class ClockJump(FaultTable, kw_only=True, frozen=True, tag="clock_jump"):
    """The clock of the computer's hub jumps (played by processes: it comes back with another time)."""

    jump_s: Annotated[float, Meta(ge=-1e9, le=1e9)]
    for_s: Annotated[Length | None, Meta(description="how long (default: to the end)")] = None


class DiskFull(FaultTable, kw_only=True, frozen=True, tag="disk_full"):
    """No file of the computer's services can grow; played by processes."""

    for_s: Length


class MemoryShort(FaultTable, kw_only=True, frozen=True, tag="memory_short"):
    """No service of the computer gets more memory than it has; played by processes."""

    for_s: Length


class BusFlood(FaultTable, kw_only=True, frozen=True, tag="bus_flood"):
    """Somebody floods the computer's bus with rubbish and with valid messages; played by processes."""

    for_s: Length
    times: Annotated[float, Meta(ge=1, le=100, description="as many messages as three inertial units")] = 10.0


Fault = (
    Unplugged
    | Frozen
    | Saturated
    | NotANumber
    | ProcessKilled
    | ProcessStopped
    | PowerCut
    | RouterKilled
    | RadioGone
    | NetParted
    | ClockJump
    | DiskFull
    | MemoryShort
    | BusFlood
)
