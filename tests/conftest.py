"""For all rooms: one Hypothesis profile, and logging as if no test before had set it up."""

from collections.abc import Iterator

import pytest
import structlog
from hypothesis import settings

# The same examples every time, and no deadline on a shared machine.
settings.register_profile("house", deadline=None, derandomize=True)
settings.load_profile("house")


@pytest.fixture(autouse=True)
def fresh_logging() -> Iterator[None]:
    """A command that a test runs in process configures structlog, its level included, for the whole process."""
    structlog.reset_defaults()
    yield
    structlog.reset_defaults()
