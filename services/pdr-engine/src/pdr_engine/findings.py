"""What `bootprint doctor` looks at of the engine: its section."""

from collections.abc import Iterator
from functools import partial

from bootprint.config import Computer
from bootprint.findings import Finding, examined
from pdr_engine.config import PdrConfig


def findings(computer: Computer) -> Iterator[Finding]:
    """Whether ``[pdr]`` is right."""
    yield examined("boots", partial(computer.section, "pdr", PdrConfig), "[pdr] is right")
