"""The ``[hub.history]`` section: where the command post keeps its history, and of what.

.. code-block:: toml

    [hub.history]
    url = "sqlite:///state/history.db"      # beside this file; or postgresql+psycopg://user@host/name
"""

from typing import TYPE_CHECKING, Final

from bootprint.config import Computer, Config

if TYPE_CHECKING:
    from sa_hub.history.archive import Archive

DEFAULT_SUBJECTS: Final = (
    "track",
    "foreign_track",
    "alert",
    "observation",
    "status",
    "fix",
    "link",
    "friendly_warning",
    "contacts",
    "health",
)
_FILE: Final = "sqlite:///"


class HistorySettings(Config, frozen=True):
    """An archive's address and the subjects (see docs/topics.md) that it keeps."""

    url: str = "sqlite:///state/history.db"
    subjects: tuple[str, ...] = DEFAULT_SUBJECTS

    def archive(self, computer: Computer) -> "Archive":
        """The archive, opened; a relative file is taken from the configuration's own folder."""
        from sa_hub.history.archive import Archive

        is_relative = self.url.startswith(_FILE) and not self.url.startswith(f"{_FILE}/")
        if not is_relative:
            return Archive(self.url)
        return Archive(f"{_FILE}{computer.relative(self.url.removeprefix(_FILE)).absolute()}")
