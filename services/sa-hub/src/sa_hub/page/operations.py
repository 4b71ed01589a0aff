"""What a person at the page may do, as the messages that go onto the bus: the same ones that commands publish."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, get_args

import msgspec

from bootprint.bus import Envelope
from bootprint.config import Member, Realm
from bootprint.display import Ages, Shown, shown
from bootprint.geodesy import moved_place
from bootprint.messages import (
    Alert,
    Fix,
    Latitude,
    Longitude,
    Message,
    NonNegative,
    Observation,
    ObservationCode,
    Percent,
    Status,
    Track,
)
from bootprint.topics import SUBJECT_OF, Identity

SOURCE: Final = "page"
AlertKind = Literal["contact", "casualty", "help", "fire", "withdraw", "other"]
Text = Annotated[str, msgspec.Meta(max_length=200)]
Azimuth = Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)]
RangeM = Annotated[float, msgspec.Meta(ge=0.0, le=20_000.0)]
CODES: Final[tuple[str, ...]] = get_args(ObservationCode)
ALERT_KINDS: Final[tuple[str, ...]] = get_args(AlertKind)
_RANGE_SIGMA: Final = 0.05  # of an estimated distance


class Request(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A change that is asked for; unknown fields are refused."""


class NewAlert(Request, frozen=True):
    """The command post alerts everybody."""

    kind: AlertKind
    text: Text = ""


class NewObservation(Request, frozen=True):
    """A thing seen at a place, by a code, a text, or both."""

    latitude_deg: Latitude
    longitude_deg: Longitude
    accuracy_m: NonNegative = 10.0
    text: Text = ""
    code: ObservationCode | None = None


class NewSighting(Request, frozen=True):
    """A thing that a soldier sees in a direction (from true north), so far away."""

    soldier: str
    azimuth_deg: Azimuth
    range_m: RangeM
    azimuth_sigma_deg: Annotated[float, msgspec.Meta(ge=0.0, le=90.0)] = 5.0
    range_sigma_m: NonNegative | None = None
    text: Text = ""
    code: ObservationCode | None = None


class NewStatus(Request, frozen=True):
    """How the command post is."""

    condition: Literal["ok", "busy", "wounded", "out"]
    battery_pct: Percent | None = None


class NewFix(Request, frozen=True):
    """A person says where a soldier is, and perhaps which way they face."""

    soldier: str
    latitude_deg: Latitude
    longitude_deg: Longitude
    height_m: float | None = None
    accuracy_m: Annotated[float, msgspec.Meta(gt=0.0, le=1000.0)] = 5.0
    azimuth_deg: Azimuth | None = None


@dataclass(frozen=True)
class Post:
    """The command post as the page sees it.

    ``publish`` puts a message onto the bus; ``place`` takes a soldier's place into the hub's own picture, for
    radios to tell; ``on_bus`` tells whether a soldier's own services run on this bus. All may be called from any
    thread.
    """

    realm: Realm
    member: Member
    ages: Ages
    speed: float
    now_ns: Callable[[], int]
    publish: Callable[[Envelope], None]
    place: Callable[[Fix, Member], None]
    on_bus: Callable[[Member], bool]

    def own(self, message: Message) -> Envelope:
        """A message of the command post itself."""
        return self._envelope(message, self.member)

    def of(self, soldier: str) -> Member | None:
        """The roster's line of a soldier."""
        return next((member for member in self.realm.roster if member.id == soldier), None)

    def _envelope(self, message: Message, member: Member) -> Envelope:
        identity = Identity(self.realm.id, member.unit, member.id)
        return Envelope(identity.address(SUBJECT_OF[type(message)], SOURCE), message)

    def alert(self, asked: NewAlert) -> Alert:
        """Tell everybody."""
        alert = Alert(time_ns=self.now_ns(), soldier=self.member.id, kind=asked.kind, text=asked.text)
        self.publish(self.own(alert))
        return alert

    def observe(self, asked: NewObservation) -> Observation:
        """Tell of a thing seen."""
        observation = Observation(
            time_ns=self.now_ns(), soldier=self.member.id, **_values(asked, NewObservation.__struct_fields__)
        )
        self.publish(self.own(observation))
        return observation

    def sight(self, asked: NewSighting, track: Track) -> Observation:
        """Tell of a thing that a soldier sees from where they are believed to be."""
        where = shown(track, self.now_ns(), self.ages)
        latitude_deg, longitude_deg = _seen_from(where, asked)
        return self.observe(
            NewObservation(
                latitude_deg=latitude_deg,
                longitude_deg=longitude_deg,
                accuracy_m=_sighting_sigma_m(where, asked),
                text=asked.text,
                code=asked.code,
            )
        )

    def tell_status(self, asked: NewStatus) -> Status:
        """Tell how the command post is."""
        status = Status(
            time_ns=self.now_ns(),
            soldier=self.member.id,
            condition=asked.condition,
            battery_pct=asked.battery_pct,
        )
        self.publish(self.own(status))
        return status

    def fix(self, asked: NewFix, member: Member) -> bool:
        """Say where somebody is; whether their own services hear it.

        A fix does not travel by radio. Of a soldier who is out of the bus's reach the hub's picture takes the place
        instead, and relays tell it on as a position that nothing measures ("coasting") until the soldier reports.
        """
        fix = Fix(
            time_ns=self.now_ns(),
            latitude_deg=asked.latitude_deg,
            longitude_deg=asked.longitude_deg,
            height_m=asked.height_m,
            accuracy_m=asked.accuracy_m,
            azimuth_rad=None if asked.azimuth_deg is None else math.radians(asked.azimuth_deg % 360.0),
            azimuth_sigma_rad=None if asked.azimuth_deg is None else math.radians(10.0),
        )
        if heard := member.id == self.member.id or self.on_bus(member):
            self.publish(self._envelope(fix, member))
        else:
            self.place(fix, member)
        return heard


def _values(asked: Request, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: getattr(asked, name) for name in names}


def _seen_from(where: Shown, asked: NewSighting) -> tuple[float, float]:
    azimuth_rad = math.radians(asked.azimuth_deg)
    east_m, north_m = asked.range_m * math.sin(azimuth_rad), asked.range_m * math.cos(azimuth_rad)
    return moved_place((where.latitude_deg, where.longitude_deg), east_m, north_m)


def _sighting_sigma_m(where: Shown, asked: NewSighting) -> float:
    """One sigma of the worse direction: along the line by the distance, or across it by the azimuth."""
    along_m = _RANGE_SIGMA * asked.range_m if asked.range_sigma_m is None else asked.range_sigma_m
    across_m = asked.range_m * math.radians(asked.azimuth_sigma_deg)
    return math.hypot(where.sigma_m, max(along_m, across_m))
