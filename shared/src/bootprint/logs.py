"""Logging of all processes: structlog to standard error, one line per event."""

import logging
import sys
from contextlib import suppress
from typing import TextIO, cast

import structlog

from bootprint.errors import ConfigError


class _Enduring:
    """Standard error, whatever it is at the time; a full disk behind it stops nobody."""

    def write(self, text: str) -> None:
        with suppress(OSError):
            sys.stderr.write(text)

    def flush(self) -> None:
        with suppress(OSError):
            sys.stderr.flush()


_ERROR_STREAM = _Enduring()


def configure(level: str = "info", *, json: bool = False) -> None:
    """Set up logging for this process; ConfigError on an unknown level."""
    number = logging.getLevelNamesMapping().get(level.upper())
    if number is None:
        raise ConfigError(f"--log-level {level!r} must be debug, info, warning or error")
    renderer: structlog.typing.Processor = (
        structlog.processors.JSONRenderer()
        if json
        else structlog.processors.LogfmtRenderer(key_order=["timestamp", "level", "event"])
    )
    structlog.configure(
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso"),
            structlog.processors.format_exc_info,
            renderer,
        ],
        wrapper_class=structlog.make_filtering_bound_logger(number),
        logger_factory=lambda *_: structlog.PrintLogger(cast("TextIO", _ERROR_STREAM)),
    )
