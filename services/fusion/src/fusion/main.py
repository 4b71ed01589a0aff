"""The fusion service: ``fusion --config computer.toml``."""

from bootprint.service import Context, CorePart, Part, Service
from fusion.config import FusionConfig
from fusion.engine import SUBJECTS, FusionCore
from fusion.memory import FILE, FusionPart, Saved, load, objection


def build(context: Context) -> Part:
    """The core of this computer's soldier, set up from ``[fusion]``."""
    computer = context.computer
    config = computer.section("fusion", FusionConfig)
    if context.lossless:  # a replay at full speed: another time's walk
        return CorePart(FusionCore(config, computer.identity, computer.realm.origin, patient=True))
    core = FusionCore(config, computer.identity, computer.realm.origin, saved=_remembered(context, config))
    return FusionPart(core, computer.state_dir / FILE)


def _remembered(context: Context, config: FusionConfig) -> Saved | None:
    """What an earlier process left of this soldier's walk; told and left aside if it cannot be gone on from."""
    path = context.computer.state_dir / FILE
    try:
        saved = load(path)
        reason = None if saved is None else objection(saved, context.identity.soldier, config)
    except (OSError, ValueError) as error:
        saved, reason = None, str(error)
    if reason is None:
        return saved
    context.log.warning("saved state refused, starting afresh", file=str(path), reason=reason)
    return None


SERVICE = Service(
    name="fusion",
    summary="Both boots and satellites into one position that knows how wrong it may be.",
    subjects=SUBJECTS,
    build=build,
)


def main() -> None:
    """Entry point of the ``fusion`` command."""
    SERVICE.main()
