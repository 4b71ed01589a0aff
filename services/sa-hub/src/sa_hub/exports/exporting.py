"""One export: the format's writer, a file that appears only when it is whole, and clear errors."""

from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, Final, Literal

from bootprint.errors import ConfigError
from sa_hub.exports.bags import write_mcap
from sa_hub.exports.geojson import write_geojson
from sa_hub.exports.gpx import write_gpx
from sa_hub.exports.kml import write_kml
from sa_hub.exports.source import Source
from sa_hub.exports.table import write_csv

Format = Literal["gpx", "kml", "geojson", "csv", "mcap"]
WRITERS: Final[dict[str, Callable[[Source, BinaryIO], None]]] = {
    "gpx": write_gpx,
    "kml": write_kml,
    "geojson": write_geojson,
    "csv": write_csv,
}
FORMATS: Final = (*WRITERS, "mcap")
MEDIA_TYPES: Final = {
    "gpx": "application/gpx+xml",
    "kml": "application/vnd.google-earth.kml+xml",
    "geojson": "application/geo+json",
    "csv": "text/csv",
    "mcap": "application/octet-stream",
}


def format_of(path: Path, named: str | None) -> str:
    """The format by its name, else by the file's ending; ConfigError if there is none such."""
    found = named or path.suffix.removeprefix(".").lower()
    if found not in FORMATS:
        raise ConfigError(f"--format {found!r} is unknown; known: {', '.join(FORMATS)}")
    return found


def export(source: Source, path: Path, format_: str, *, overwrite: bool = False) -> None:
    """Write an export; an unfinished one leaves nothing at ``path``. ConfigError if it cannot be written."""
    if path.exists() and not overwrite:
        raise ConfigError(f"{path}: exists already; choose another name or give --overwrite")
    partial = path.with_name(f"{path.name}.part")
    try:
        if format_ == "mcap":
            write_mcap(source, partial, overwrite=True)
        else:
            with partial.open("wb") as out:
                WRITERS[format_](source, out)
        partial.replace(path)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be written: {error.strerror}") from error
    finally:
        partial.unlink(missing_ok=True)
