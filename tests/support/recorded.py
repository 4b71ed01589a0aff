"""Where the recorded data stands, if it is there: BOOTPRINT_DATA, else the folder beside the project."""

import os
from pathlib import Path

import pytest

_BESIDE = Path(__file__).resolve().parents[2].parent / "shared" / "data"


def recorded_data() -> Path:
    """The folder of recorded data sets; skips the test, saying so, when there is none."""
    folder = Path(os.environ.get("BOOTPRINT_DATA", _BESIDE))
    if not folder.is_dir():
        pytest.skip(f"recorded data not found at {folder}: set BOOTPRINT_DATA to its folder")
    return folder
