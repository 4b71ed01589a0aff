"""What was heard, kept over restarts: without it, yesterday's frames would be news."""

from pathlib import Path

import msgspec

from sa_hub.radio.replay import Heard, Memory


def load_memory(path: Path) -> tuple[Memory, bool]:
    """What was heard before the restart, and whether the file was sound; nothing if it is damaged or not there."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[int, Heard]), True
    except FileNotFoundError:
        return {}, True
    except (msgspec.MsgspecError, OSError):
        return {}, False


def save_memory(path: Path, memory: Memory) -> None:
    """Write it whole or not at all; not synced, for that would wear the disk out a frame at a time."""
    fresh = path.with_suffix(".new")
    fresh.write_bytes(msgspec.json.encode(memory))
    fresh.replace(path)
