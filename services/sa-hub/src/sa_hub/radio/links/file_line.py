"""Frames in a file or named pipe, for planners: a line for each, event time in ns and the frame in hexadecimal.

Whoever appends to the file is on the net. What stood there before the link began was said before, and is not heard.
"""

import os
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from bootprint.errors import ConfigError
from sa_hub.radio.link_profile import LinkProfile

_MAX_READ: Final = 65_536
_LONGEST_LINE: Final = 200_000


def line_of(time_ns: int, frame: bytes) -> bytes:
    """A frame as it stands in the file."""
    return b"%d %s\n" % (time_ns, frame.hex().encode())


def frames_in(text: bytes) -> Iterator[tuple[int, bytes] | None]:
    """(event time ns, frame) of each line; None for one that is not sound."""
    for line in text.splitlines():
        stamp, _, digits = line.partition(b" ")
        try:
            yield int(stamp), bytes.fromhex(digits.decode())
        except ValueError:
            yield None


class FileLink:
    """Appends to ``path`` and follows ``read_path`` (``path`` if not given), both relative to ``folder``."""

    def __init__(
        self,
        profile: LinkProfile,
        on_frame: Callable[[bytes], None],
        folder: Path,
        now_ns: Callable[[], int],
    ) -> None:
        assert profile.path is not None
        self.name = profile.name
        self.send_faults = 0
        self.garbled = 0
        self.fault = ""
        self.busy = False
        self._on_frame = on_frame
        self._now_ns = now_ns
        self._writer = _opened(folder / profile.path, profile.name, os.O_RDWR | os.O_APPEND | os.O_CREAT)
        self._reader = _opened(
            folder / (profile.read_path or profile.path), profile.name, os.O_RDWR | os.O_CREAT
        )
        self._rest = b""
        self._closed = False

    def start(self) -> None:
        """It follows the file since it was made."""

    def poll(self) -> None:
        """Hand over what was appended meanwhile."""
        while self._follow():
            pass

    def send(self, data: bytes) -> None:
        """Append one frame; a full disk or pipe loses it."""
        line = line_of(self._now_ns(), data)
        try:
            written = os.write(self._writer, line)
            self.fault = ""
        except OSError as error:
            written, self.fault = 0, f"{self.name}: {error.strerror}"
        self.send_faults += written < len(line)

    def close(self) -> None:
        """Stop following, and close the files."""
        if self._closed:
            return
        self._closed = True
        os.close(self._reader)
        os.close(self._writer)

    def _follow(self) -> bool:
        """Whether there was more to read."""
        try:
            data = os.read(self._reader, _MAX_READ)
        except BlockingIOError:  # an empty pipe
            return False
        whole, newline, rest = (self._rest + data).rpartition(b"\n")
        self._rest = rest[-_LONGEST_LINE:]
        for found in frames_in(whole + newline):
            if found is None:
                self.garbled += 1
            else:
                self._on_frame(found[1])
        return bool(data)


def _opened(path: Path, link: str, flags: int) -> int:
    """Open without waiting for anybody; a file is read from its end on. ConfigError if it cannot be used."""
    try:
        descriptor = os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise ConfigError(f"link {link!r}: cannot use {path}: {error.strerror}") from error
    if stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.lseek(descriptor, 0, os.SEEK_END)
    return descriptor
