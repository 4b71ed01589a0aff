"""The fusion service: ``fusion --config computer.toml``."""

from bootprint.service import Context, CorePart, Part, Service
from fusion.config import FusionConfig
from fusion.engine import SUBJECTS, FusionCore


def build(context: Context) -> Part:
    """The core of this computer's soldier, set up from ``[fusion]``."""
    computer = context.computer
    config = computer.section("fusion", FusionConfig)
    core = FusionCore(config, computer.identity, computer.realm.origin, patient=context.lossless)
    return CorePart(core)


SERVICE = Service(
    name="fusion",
    summary="Both boots and satellites into one position that knows how wrong it may be.",
    subjects=SUBJECTS,
    build=build,
)


def main() -> None:
    """Entry point of the ``fusion`` command."""
    SERVICE.main()
