"""Configuration in TOML, checked strictly: an unknown key is an error that names it and what was meant.

Two files describe a computer. ``realm.toml`` is the same on every computer: the realm's id, its origin, the
roster and the names of the keys. ``computer.toml`` is this computer's own: who it belongs to, where its router
is, and one section for each service, which that service alone understands (`section`).
"""

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec

from bootprint.config_errors import Misfit, explain
from bootprint.errors import ConfigError
from bootprint.keys.credentials import Credentials, credentials_in, is_secure, stays_here
from bootprint.messages import Latitude, Longitude
from bootprint.topics import Identity, check_part

T = TypeVar("T")

# The largest number that makes sense under a key of such an ending; nanoseconds must fit into 64 bits.
_LARGEST_BY_ENDING = {"_bits_per_s": 1e12, "_time_s": 1e12, "_s": 1e7, "_ms": 1e10}
_LARGEST = 1e12


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Base of every configuration table: unknown keys are refused."""


class Origin(Config, frozen=True):
    """Where local east, north, up are zero (WGS84, ellipsoidal height)."""

    latitude_deg: Latitude
    longitude_deg: Longitude
    height_m: float = 0.0


class Member(Config, frozen=True):
    """One line of the roster."""

    id: str
    number: Annotated[int, msgspec.Meta(ge=0, le=1023)]
    unit: str
    callsign: str = ""
    role: str = "rifleman"


class Realm(Config, frozen=True):
    """``realm.toml``: what all computers of an operation agree on."""

    id: str
    origin: Origin
    roster: tuple[Member, ...]
    group_key: str = "group"

    def member(self, soldier: str) -> Member:
        """The roster's line of a soldier id; ConfigError if there is none."""
        for member in self.roster:
            if member.id == soldier:
                return member
        known = ", ".join(member.id for member in self.roster)
        raise ConfigError(f"soldier {soldier!r} is not in the roster of realm {self.id!r} (known: {known})")

    def by_number(self) -> dict[int, Member]:
        """The roster by radio number."""
        return {member.number: member for member in self.roster}


class BusTable(Config, frozen=True):
    """``[bus]``: other computers at this one's router, always with certificates on both sides.

    ``listen``: where it awaits them; ``connect``: routers that it joins, those of other command posts.
    """

    listen: tuple[str, ...] = ()
    connect: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for endpoint in (*self.listen, *self.connect):
            if not is_secure(endpoint):
                raise ValueError(f"{endpoint!r} is open to everybody; want tls/HOST:PORT or quic/HOST:PORT")


class ComputerFile(Config, frozen=True):
    """``computer.toml`` as it stands in the file; sections are converted by the services they belong to."""

    realm: str
    soldier: str
    router: str = "tcp/127.0.0.1:7447"
    state_dir: str = "state"
    keys_dir: str = "keys"
    bus: BusTable = BusTable()
    gateway: dict[str, Any] = {}
    pdr: dict[str, Any] = {}
    fusion: dict[str, Any] = {}
    hub: dict[str, Any] = {}


@dataclass(frozen=True)
class Computer:
    """A computer's configuration with its realm loaded and its paths resolved against the file's folder."""

    path: Path
    realm: Realm
    member: Member
    router: str
    state_dir: Path
    keys_dir: Path
    bus: BusTable = field(default_factory=BusTable)
    sections: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def identity(self) -> Identity:
        """The part of the key that all of this computer's topics share."""
        return Identity(self.realm.id, self.member.unit, self.member.id)

    @property
    def credentials(self) -> Credentials:
        """What this computer shows on the bus, where it is asked."""
        return credentials_in(self.keys_dir)

    @property
    def is_guarded(self) -> bool:
        """Whether its router admits by certificate."""
        return any(map(is_secure, (self.router, *self.bus.listen, *self.bus.connect)))

    def section(self, name: str, type_: type[T]) -> T:
        """One service's section, strictly converted; ConfigError says what is wrong and where."""
        return convert(self.sections[name], type_, where=f"{self.path}: [{name}]")

    def relative(self, path: str) -> Path:
        """A path from the file, resolved against the file's own folder."""
        return self.path.parent / path


def load_computer(path: Path) -> Computer:
    """Read ``computer.toml`` and the realm it names; ConfigError on anything wrong in either."""
    file = load_toml(path, ComputerFile)
    _check_router(file, path)
    realm = load_realm(path.parent / file.realm)
    return Computer(
        path=path,
        realm=realm,
        member=realm.member(file.soldier),
        router=file.router,
        state_dir=path.parent / file.state_dir,
        keys_dir=path.parent / file.keys_dir,
        bus=file.bus,
        sections={name: getattr(file, name) for name in ("gateway", "pdr", "fusion", "hub")},
    )


def _check_router(file: ComputerFile, path: Path) -> None:
    """ConfigError if others could come in without a certificate where a certificate is asked of others."""
    guarded = file.bus.listen or file.bus.connect
    if guarded and not (is_secure(file.router) or stays_here(file.router)):
        raise ConfigError(
            f"{path}: router = {file.router!r} is open to everybody, which makes [bus] useless; "
            "want tls/HOST:PORT, or an address that stays here such as tcp/127.0.0.1:7447"
        )


def load_realm(path: Path) -> Realm:
    """Read ``realm.toml``; ConfigError if ids repeat or cannot stand in a key."""
    realm = load_toml(path, Realm)
    for name, values in (
        ("id", [member.id for member in realm.roster]),
        ("number", [str(member.number) for member in realm.roster]),
    ):
        twice = sorted({value for value in values if values.count(value) > 1})
        if twice:
            raise ConfigError(
                f"{path}: roster has {name} {', '.join(twice)} more than once; make each unique"
            )
    try:
        check_part("id", realm.id)
        for member in realm.roster:
            check_part("roster id", member.id)
            check_part("roster unit", member.unit)
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from error
    return realm


def load_toml(path: Path, type_: type[T]) -> T:
    """Read a TOML file strictly into ``type_``; ConfigError names the file, the place and the mend."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from error
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error
    return convert(values, type_, where=str(path))


def convert(values: object, type_: type[T], where: str) -> T:
    """Convert plain values strictly; ConfigError tells ``where`` and what is known there."""
    fitted = fit(values, type_)
    if isinstance(fitted, Misfit):
        raise ConfigError(f"{where}: {fitted.reason}")
    return fitted


def fit(values: object, type_: type[T]) -> T | Misfit:
    """Convert plain values strictly, or tell the key at fault and why: for files that know their lines."""
    if (misfit := _unfit_number(values, "")) is not None:
        return misfit
    try:
        return msgspec.convert(values, type_)
    except msgspec.ValidationError as error:
        return explain(str(error), values, type_)


def _unfit_number(value: object, key: str) -> Misfit | None:
    """TOML knows ``nan``, ``inf`` and 1e300, types do not refuse them: the first key where one stands."""
    if isinstance(value, dict):
        inside = (
            _unfit_number(inner, f"{key}.{name}" if key else str(name)) for name, inner in value.items()
        )
        return next(filter(None, inside), None)
    if isinstance(value, list):
        inside = (_unfit_number(inner, f"{key}[{index}]") for index, inner in enumerate(value))
        return next(filter(None, inside), None)
    if isinstance(value, float | int) and not abs(value) <= (largest := _largest(key)):
        return Misfit(key, f"{key} is {value}: expected a number within ±{largest:g}")
    return None


def _largest(key: str) -> float:
    """By the first ending that fits."""
    found = (largest for ending, largest in _LARGEST_BY_ENDING.items() if key.endswith(ending))
    return next(found, _LARGEST)
