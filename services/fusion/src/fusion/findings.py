"""What `bootprint doctor` looks at of the fusion: its section, and where the soldier starts."""

from collections.abc import Iterator

from bootprint.config import Computer
from bootprint.errors import ConfigError
from bootprint.findings import Finding
from fusion.config import FusionConfig


def findings(computer: Computer) -> Iterator[Finding]:
    """Whether ``[fusion]`` is right, and says where the soldier starts."""
    try:
        section = computer.section("fusion", FusionConfig)
    except ConfigError as error:
        yield Finding("fault", "fusion", str(error))
        return
    if section.start is None and not section.gnss_sources:
        mend = "add [fusion.start], a receiver to [fusion] gnss_sources, or tell it by `bootprint fix`"
        yield Finding(
            "warning", "fusion", "[fusion] names neither a start nor a receiver: unplaced until told", mend
        )
        return
    yield Finding("ok", "fusion", "[fusion] is right")
