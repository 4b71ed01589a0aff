"""The pdr-engine service: ``pdr-engine --config computer.toml``."""

from bootprint.service import Context, CorePart, Part, Service
from pdr_engine.config import PdrConfig
from pdr_engine.engine import SUBJECTS, EngineCore
from pdr_engine.foot import warm_up


def build(context: Context) -> Part:
    """The core of this computer's soldier, set up from ``[pdr]``, its kernel compiled before the first sample."""
    computer = context.computer
    config = computer.section("pdr", PdrConfig)
    if reason := warm_up():
        context.log.warning("numba runs the foot filter in this process, in more memory", reason=reason)
    return CorePart(EngineCore(config, computer.identity, computer.realm.origin))


SERVICE = Service(
    name="pdr-engine",
    summary="Dead reckoning of both boots: inertial samples in, foot steps out.",
    subjects=SUBJECTS,
    build=build,
)


def main() -> None:
    """Entry point of the ``pdr-engine`` command."""
    SERVICE.main()
