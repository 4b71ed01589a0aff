"""The fusion service: ``fusion --config computer.toml``."""

from bootprint.remembering import Memory, RememberingPart, recall
from bootprint.rooms import RoomMap
from bootprint.saved_state import StateFile
from bootprint.service import Context, CorePart, Part, Service
from fusion.config import FusionConfig
from fusion.engine import SUBJECTS, FusionCore
from fusion.memory import FILE, FORM, SAVE_EVERY_NS, kept_of, understood
from fusion.rooms.memory import FILE as ROOMS_FILE
from fusion.rooms.memory import KeepsRooms, load_rooms


def build(context: Context) -> Part:
    """The core of this computer's soldier, set up from ``[fusion]``."""
    computer = context.computer
    config = computer.section("fusion", FusionConfig)
    origin = computer.realm.origin
    if context.lossless:  # a replay at full speed: another time's walk
        return CorePart(FusionCore(config, computer.identity, origin, patient=True))
    file = StateFile(computer.state_dir / FILE, FORM)
    left = recall(file, lambda kept: understood(kept, context.identity.soldier, config))
    mapped = _mapped(context) if config.rooms.map else None
    core = FusionCore(config, computer.identity, origin, saved=left.value, mapped=mapped)
    memory = Memory(file, SAVE_EVERY_NS, lambda: kept_of(core.remembered()), left.refusal)
    return KeepsRooms(RememberingPart(core, memory), computer.state_dir / ROOMS_FILE, origin)


def _mapped(context: Context) -> RoomMap | None:
    """The map of rooms that an earlier process left; told and left aside if it cannot be read."""
    path = context.computer.state_dir / ROOMS_FILE
    try:
        return load_rooms(path, context.computer.realm.origin)
    except (OSError, ValueError) as error:
        context.log.warning("map of rooms refused, drawing afresh", file=str(path), reason=str(error))
        return None


SERVICE = Service(
    name="fusion",
    summary="Both boots and satellites into one position that knows how wrong it may be.",
    subjects=(*SUBJECTS, "rooms"),
    build=build,
    ringing=("foot_pose",),  # positions come with them
)


def preload() -> None:
    """What a started service needs beyond this module (`bootprint.fork_server`)."""
    SERVICE.preload()


def main() -> None:
    """Entry point of the ``fusion`` command."""
    SERVICE.main()
