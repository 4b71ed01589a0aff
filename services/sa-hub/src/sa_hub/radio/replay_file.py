"""What was heard, kept over restarts and power cuts: without it, yesterday's frames would be news.

The file is synced before any sender is more than a few counters ahead of it, so the disk is not worn out a frame at
a time. After an end that was not clean those few counters are taken as heard, whether they were or not.
"""

from pathlib import Path
from typing import Final

import msgspec

from sa_hub.radio.counters import write_synced
from sa_hub.radio.replay import WINDOW, Heard, Memory

LAG: Final = 4
"""Counters of each sender that may be heard without being on disk: so many are refused after a power cut."""


class _Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file's content. ``clean``: nothing was heard after it was written."""

    clean: bool
    senders: dict[int, Heard]


class MemoryFile:
    """The replay memory of one net on disk. OSError from `keep` and `close` if it cannot be written."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._synced: dict[int, tuple[int, int]] | None = None

    def load(self) -> tuple[Memory, bool]:
        """What may have been heard before, and whether the file was sound; nothing if damaged or not there."""
        try:
            kept = msgspec.json.decode(self.path.read_bytes(), type=_Kept)
        except FileNotFoundError:
            return {}, True
        except (msgspec.MsgspecError, OSError):
            return {}, False
        if not kept.clean:
            for heard in kept.senders.values():
                _skip_ahead(heard)
        return kept.senders, True

    def keep(self, memory: Memory) -> None:
        """A frame was heard: on disk before this returns, unless the disk is near enough."""
        if self._synced is None or any(self._is_far(sender, heard) for sender, heard in memory.items()):
            self._write(memory, clean=False)

    def close(self, memory: Memory) -> None:
        """Nothing more will be heard."""
        self._write(memory, clean=True)

    def _is_far(self, sender: int, heard: Heard) -> bool:
        epoch, highest = (self._synced or {}).get(sender, (-1, 0))
        return epoch != heard.epoch or heard.highest > highest + LAG

    def _write(self, memory: Memory, *, clean: bool) -> None:
        write_synced(self.path, msgspec.json.encode(_Kept(clean, memory)))
        self._synced = {sender: (heard.epoch, heard.highest) for sender, heard in memory.items()}


def _skip_ahead(heard: Heard) -> None:
    heard.highest += LAG
    heard.mask = (1 << WINDOW) - 1
