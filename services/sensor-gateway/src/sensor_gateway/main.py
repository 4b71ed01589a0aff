"""The console script ``sensor-gateway``."""

from bootprint.service import Context, Part, Service


def _build(context: Context) -> Part:
    from sensor_gateway.gateway import build  # --help must not wait for it

    return build(context)


SERVICE = Service(
    name="sensor-gateway",
    summary="Reads sensors (serial, UDP) or replays recordings, and publishes typed sensor messages.",
    subjects=(),
    build=_build,
)


def preload() -> None:
    """What a started service needs beyond this module (`bootprint.fork_server`)."""
    import sensor_gateway.gateway  # noqa: F401

    SERVICE.preload()


def main() -> None:
    """Run the service."""
    SERVICE.main()
