"""What outlives the process: every navigator as it is, so that a restart in a corner goes on in the corner.

The bus tells a newcomer the last seconds of inertial samples again (`Qos.RECENT`). Those the saved navigators have
had are passed over, with the rest they go on; steps that were told before come again with their own numbers, and
fusion takes each once. So nothing is lost as long as saving, dying and starting take less than what the bus tells
again; after more than that the navigators coast over the gap as over any other. State of more than a minute ago,
of other sources, settings or another soldier is refused.
"""

import hashlib
from collections.abc import Mapping
from typing import Final

import msgspec

from bootprint.config import Config
from bootprint.messages import Vector3
from bootprint.saved_state import Form, Kept
from bootprint.topics import Identity
from pdr_engine.config import PdrConfig
from pdr_engine.rate import NS_PER_S
from pdr_engine.trunk_record import sources_digest

FILE: Final = "pdr.state"
FORM: Final = Form("pdr", version=1, capacity=4 * 1024 * 1024)
SAVE_EVERY_NS: Final = 2 * NS_PER_S
_LONGEST_NS: Final = 60 * NS_PER_S
_TOLD_AGAIN_NS: Final = 20 * NS_PER_S  # no cache of the bus reaches further back


class SavedBoot(Config, frozen=True):
    """One boot: its navigator's record (`foot_record`), its books, and the number of its newest batch."""

    record: bytes
    newest_ns: int
    batch: int
    steps: int
    poses: int
    cell: int | None
    position: Vector3
    yaw_rad: float


class SavedTrunk(Config, frozen=True):
    """The body-worn unit: its parts (`trunk_record`), and its newest batch."""

    record: bytes
    newest_ns: int
    batch: int


class Saved(Config, frozen=True):
    """An engine at ``time_ns``; ``owner`` is whose, by what sources and with which settings."""

    owner: str
    time_ns: int
    boots: dict[str, SavedBoot]
    trunk: SavedTrunk | None = None


def owner_of(config: PdrConfig, identity: Identity) -> str:
    """What a saved engine must agree in with the one that is to go on."""
    text = msgspec.json.encode((sources_digest(), identity.realm, identity.unit, identity.soldier, config))
    return hashlib.sha256(text).hexdigest()[:16]


def understood(kept: Kept, owner: str) -> Saved:
    """The engine in a file of state; ValueError if it is none, or not this one."""
    try:
        saved = msgspec.msgpack.decode(kept.payload, type=Saved)
    except msgspec.MsgspecError as error:
        raise ValueError(f"no engine: {error}") from error
    if saved.owner != owner:
        raise ValueError("of another soldier, other settings or another version of the engine")
    return saved


def kept_of(saved: Saved | None) -> Kept | None:
    """An engine as a file of state keeps it."""
    return None if saved is None else Kept(saved.time_ns, msgspec.msgpack.encode(saved))


def is_of_now(saved: Saved, time_ns: int) -> bool:
    """Whether it is young enough for the first sample heard, which may be an older one told again."""
    return -_TOLD_AGAIN_NS <= time_ns - saved.time_ns <= _LONGEST_NS


def newest_ns(boots: Mapping[str, SavedBoot], trunk: SavedTrunk | None) -> int | None:
    """The time of the newest sample of all; None before there is any."""
    times = [boot.newest_ns for boot in boots.values()] + ([] if trunk is None else [trunk.newest_ns])
    return max(times, default=None)
