"""The pdr-engine service: ``pdr-engine --config computer.toml``."""

import msgspec

from bootprint.remembering import Memory, recall
from bootprint.saved_state import StateFile
from bootprint.service import Context, Part, Service
from pdr_engine.config import PdrConfig
from pdr_engine.engine import BODY, SUBJECTS, EngineCore
from pdr_engine.foot import warm_up
from pdr_engine.memory import FILE as STATE_FILE
from pdr_engine.memory import FORM, SAVE_EVERY_NS, kept_of, owner_of, understood
from pdr_engine.profile import FILE, EnginePart, load_profile, with_profile


def build(context: Context) -> Part:
    """The core of this computer's soldier, set up from ``[pdr]``, its kernel compiled before the first sample."""
    computer = context.computer
    config = _with_person(context, computer.section("pdr", PdrConfig))
    if reason := warm_up():
        context.log.warning("numba runs the foot filter in this process, in more memory", reason=reason)
    origin = computer.realm.origin
    if context.lossless:  # a replay at full speed: another time's walk
        return EnginePart(EngineCore(config, computer.identity, origin), computer.state_dir / FILE)
    state = StateFile(computer.state_dir / STATE_FILE, FORM)
    owner = owner_of(config, computer.identity)
    left = recall(state, lambda kept: understood(kept, owner))
    core = EngineCore(config, computer.identity, origin, saved=left.value)
    memory = Memory(state, SAVE_EVERY_NS, lambda: kept_of(core.remembered()), left.refusal)
    return EnginePart(core, computer.state_dir / FILE, memory)


def _with_person(context: Context, config: PdrConfig) -> PdrConfig:
    """The configuration with the saved profile of the person, if there is a sound one."""
    path = context.computer.state_dir / FILE
    try:
        profile = load_profile(path) if BODY in config.places else None
    except (OSError, ValueError) as error:
        context.log.warning("body profile cannot be read, starting afresh", file=str(path), error=str(error))
        return config
    if profile is None:
        return config
    return msgspec.structs.replace(config, body=with_profile(config.body, profile))


SERVICE = Service(
    name="pdr-engine",
    summary="Dead reckoning of boots and body: inertial samples in, steps out.",
    subjects=SUBJECTS,
    build=build,
    ringing=("imu",),
)


def preload() -> None:
    """What a started service needs beyond this module (`bootprint.fork_server`)."""
    SERVICE.preload()


def main() -> None:
    """Entry point of the ``pdr-engine`` command."""
    SERVICE.main()
