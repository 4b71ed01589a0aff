"""What `bootprint doctor` looks at of the gateway: its section, its devices, its recordings."""

from collections.abc import Iterator

from bootprint.config import Computer
from bootprint.errors import ConfigError
from bootprint.findings import Finding, device
from sensor_gateway import settings


def findings(computer: Computer) -> Iterator[Finding]:
    """A finding for the section, one for each source."""
    where = f"{computer.path}: [gateway]"
    try:
        section = computer.section("gateway", settings.GatewaySettings)
        settings.check(section, where)
    except ConfigError as error:
        yield Finding("fault", "sensors", str(error))
        return
    for source in section.sources:
        match source:
            case settings.SerialSource():
                yield device("sensors", source.port)
            case settings.UdpSource():
                yield Finding("ok", "sensors", f"listens at udp {source.bind}:{source.port}")
            case settings.ReplaySource():
                path = computer.relative(source.path)
                there = path.exists()
                yield Finding(
                    "ok" if there else "fault", "sensors", f"{path}: {'a' if there else 'no such'} recording"
                )
