"""Whether this machine can carry an exercise as processes at all, asked before anything is built or started."""

import psutil

from bootprint.errors import ConfigError

# Measured as proportional shares on whole exercises of 17 to 161 processes (`usage` in result.json): a soldier's
# four services, his router and what is observed of him.
_PER_SOLDIER_GB = 0.195
_PROCESSES_OF_A_SOLDIER = 4


def check_memory(soldiers: int, free_gb: float | None = None) -> None:
    """ConfigError if so many soldiers' processes want more memory than is free (default: asked of the system)."""
    if free_gb is None:
        free_gb = psutil.virtual_memory().available / 1e9
    wanted_gb = soldiers * _PER_SOLDIER_GB
    if wanted_gb > free_gb:
        raise ConfigError(
            f"{soldiers} soldiers are {soldiers * _PROCESSES_OF_A_SOLDIER} processes and want about "
            f"{wanted_gb:.0f} GB of memory, {free_gb:.0f} GB are free here: "
            "play them with --mode inprocess, or on a larger machine"
        )
