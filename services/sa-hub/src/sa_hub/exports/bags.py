"""MCAP: every message of the archive as it was on the bus, and what Foxglove's map shows without a plug-in.

The same recorder as `bootprint record`: tracks a second time as LocationFix, observations as GeoJSON.
"""

from pathlib import Path

from bootprint.recording import Recorder
from bootprint.topics import BY_SUBJECT
from sa_hub.exports.source import Source


def write_mcap(source: Source, path: Path, *, overwrite: bool) -> int:
    """Write a recording; how many messages it holds. RecordingError if it cannot be written."""
    with Recorder(path, overwrite=overwrite) as recorder:
        for envelope in source.messages(*BY_SUBJECT):
            recorder.write(envelope)
    return recorder.messages
