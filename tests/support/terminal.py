"""A program in a terminal of its own (a pty), for tests: what it has written, and typing into it."""

import fcntl
import os
import re
import struct
import subprocess
import termios
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

_ESCAPES = re.compile(r"\x1b(\[[0-9;:?<>=$ ]*[@-~]|[\]P_^][^\x07\x1b]*(\x07|\x1b\\)|[()][A-Z0-9]|[@-Z\\-~])")


class Terminal:
    """The user's side. ``text`` is everything that was ever written, without control sequences."""

    def __init__(self, process: "subprocess.Popen[bytes]", side: int) -> None:
        self.process = process
        self._side = side
        self._written = b""
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    @property
    def text(self) -> str:
        """Words as they were written; what the program wrote anew stands there again."""
        return _ESCAPES.sub("", self._written.decode(errors="replace"))

    def type(self, keys: str) -> None:
        """Press keys, one after the other."""
        os.write(self._side, keys.encode())

    def _read(self) -> None:
        try:
            while data := os.read(self._side, 65_536):
                self._written += data
        except OSError:  # the program has closed its side
            return


@contextmanager
def running_in_terminal(command: Sequence[str], columns: int = 80, rows: int = 24) -> Iterator[Terminal]:
    """Run until the end of the block; then it has ended by itself, or is ended."""
    ours, theirs = os.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    environment = os.environ | {"TERM": "xterm-256color"}
    process = subprocess.Popen(
        command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, start_new_session=True
    )
    os.close(theirs)
    try:
        yield Terminal(process, ours)
    finally:
        process.kill()
        process.wait()
        os.close(ours)
