"""Cuts a stream of bytes into frames and loses none behind garbage.

What looks like a frame's start but proves false is skipped by one byte only, so that a whole frame inside the
garbage is still found.
"""

import re
from collections import Counter
from collections.abc import Callable

NEED_MORE = 0
NO_FRAME = -1
Measure = Callable[[bytearray, int], int]


class Framer:
    """``measure(buffer, at)`` tells the length of the checked frame at ``at``, `NEED_MORE`, or `NO_FRAME`."""

    def __init__(self, markers: bytes, measure: Measure, counts: Counter[str]) -> None:
        self._marker = re.compile(b"[" + re.escape(markers) + b"]")
        self._measure = measure
        self._counts = counts
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """The frames that these bytes complete."""
        self._buffer += data
        return self._take_frames(final=False)

    def cut(self) -> list[bytes]:
        """No more will come: the whole frames behind a false or half start; the rest is dropped."""
        return self._take_frames(final=True)

    def _take_frames(self, *, final: bool) -> list[bytes]:
        frames: list[bytes] = []
        buffer, at = self._buffer, self._next_start(0)
        while at < len(buffer):
            length = self._measure(buffer, at)
            if length > 0:
                frames.append(bytes(buffer[at : at + length]))
                at = self._next_start(at + length)
            elif length == NEED_MORE and not final:
                break
            else:
                self._counts["frames_broken"] += 1
                self._counts["bytes_skipped"] += 1
                at = self._next_start(at + 1)
        del buffer[:at]
        return frames

    def _next_start(self, at: int) -> int:
        """The next place where a frame may begin, or the end."""
        found = self._marker.search(self._buffer, at)
        start = found.start() if found else len(self._buffer)
        if start > at:
            self._counts["bytes_skipped"] += start - at
        return start
