"""Errors a person can act on: every one says what is wrong, where, and what would be right."""


class BootprintError(Exception):
    """Base of all expected errors; commands print it as one line and exit with 2."""


class ConfigError(BootprintError):
    """A configuration file or option is wrong."""


class RecordingError(BootprintError):
    """A recording is missing, damaged or of an unknown kind."""


class WireError(BootprintError):
    """Bytes on the bus are not a valid message of their topic."""


class BusError(BootprintError):
    """The bus cannot be reached."""
