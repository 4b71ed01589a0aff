"""Services started by fork from one process that has imported them: a start in milliseconds.

Nearly all of a service's start is imports, 0.3 s of processor; where a computer is busy that is seconds. Who starts
services again and again on one computer (`bootprint up`, exercises) keeps a server that has them imported and does
nothing but fork. It opens nothing and starts no thread, so a fork of it is as good as a new interpreter, and what
it has imported is in memory once. systemd and containers, which start each service by itself, do without.

A room's command module may have a function ``preload()``: what its service imports or links later than the module
itself. The server lives as long as its link to the parent; its services have a line to the parent of their own.
"""

import gc
import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from pkgutil import resolve_name
from typing import BinaryIO, Final

import msgspec

from bootprint.errors import BootprintError

_LONGEST_ORDER: Final = 1 << 16
_FILES: Final = 3
"""With each order: the child's standard input, its output, and where its exit code is to be written."""
_SERVER: Final = f"from {__name__} import main; main()"
_STDERR: Final = 2
_NAME_LENGTH: Final = 15
"""Of a process, as `ps` and `top` show it: the kernel keeps no more."""


class Order(msgspec.Struct, frozen=True):
    """A service to fork: the function of its command (``module:function``), and the words on its command line."""

    entry: str
    words: list[str]


class ForkServerError(BootprintError):
    """The server cannot be started."""


class Forked:
    """A forked service, with as much of `subprocess.Popen` as a `ProcessGroup` needs."""

    def __init__(self, pid: int, stdin: BinaryIO, status: BinaryIO) -> None:
        self.pid = pid
        self.stdin = stdin
        self.returncode: int | None = None
        self._status = status

    def poll(self) -> int | None:
        """Its exit code (negative: a signal's number), None while it runs."""
        return self._ended(0.0)

    def wait(self, timeout: float | None = None) -> int:
        """Its exit code, waited for; `subprocess.TimeoutExpired` if it does not end in time."""
        code = self._ended(timeout)
        if code is None:
            raise subprocess.TimeoutExpired(f"forked {self.pid}", timeout or 0.0)
        return code

    def _ended(self, timeout_s: float | None) -> int | None:
        if self.returncode is None and _is_readable(self._status, timeout_s):
            told = self._status.read()
            self._status.close()
            if not told:  # the server died: nobody knows of this one any more, and two of it must not be
                self.kill()
            self.returncode = int(told or -signal.SIGKILL)
        return self.returncode

    def terminate(self) -> None:
        """SIGTERM, unless it is known to have ended."""
        self._signal(signal.SIGTERM)

    def kill(self) -> None:
        """SIGKILL, unless it is known to have ended."""
        self._signal(signal.SIGKILL)

    def _signal(self, number: signal.Signals) -> None:
        if self.returncode is None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, number)


def _is_readable(file: BinaryIO, within_s: float | None) -> bool:
    """Whether something, or the end, can be read. (`select.select` knows only the first 1024 descriptors.)"""
    poll = select.poll()
    poll.register(file, select.POLLIN)
    return bool(poll.poll(None if within_s is None else 1000.0 * within_s))


class ForkServer:
    """The parent's side: starts the server when it is first wanted, and again if it has died."""

    def __init__(self, commands: Sequence[str]) -> None:
        """``commands``: console scripts of this installation; what is not installed is left out."""
        self._entries = {name: entry for name in commands if (entry := _entry_of(name))}
        self._link: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int | None:
        """The server's process, if it was wanted yet."""
        return None if self._process is None else self._process.pid

    def serves(self, command: str) -> bool:
        """Whether this command can be forked."""
        return command in self._entries

    def start(self, command: str, arguments: Sequence[str], output: BinaryIO | None) -> Forked:
        """Fork a service; ``output`` None is the parent's own standard error."""
        order = Order(self._entries[command], [command, *arguments])
        output_fd = _STDERR if output is None else output.fileno()
        stdin_read, stdin = os.pipe()
        status, status_write = os.pipe()
        try:
            pid = self._asked(order, (stdin_read, output_fd, status_write))
        except BaseException:
            os.close(stdin)
            os.close(status)
            self.close()  # an answer that was not waited for would be taken for the next one's
            raise
        finally:
            os.close(stdin_read)
            os.close(status_write)
        return Forked(pid, os.fdopen(stdin, "wb", buffering=0), os.fdopen(status, "rb", buffering=0))

    def _asked(self, order: Order, files: Sequence[int]) -> int:
        """The process id that the server answers with; it is started anew once."""
        for _ in range(2):
            with suppress(OSError):
                link = self._link or self._open()
                socket.send_fds(link, [msgspec.json.encode(order)], files)
                if answer := link.recv(_LONGEST_ORDER):
                    return int(answer)
            self.close()
        raise ForkServerError(f"{' '.join(order.words[:1])} cannot be forked: its server ends at once")

    def _open(self) -> socket.socket:
        link, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with its:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _SERVER, str(its.fileno()), *self._entries.values()],
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},  # numpy's threads would not survive a fork
                pass_fds=[its.fileno()],
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is for the parent
            )
        self._link = link
        return link

    def close(self) -> None:
        """End the server; what it has forked goes on until it is asked after."""
        if self._link is not None:
            self._link.close()
            self._link = None
        if self._process is not None:
            self._process.wait()
            self._process = None


def _entry_of(command: str) -> str | None:
    return next((script.value for script in entry_points(group="console_scripts", name=command)), None)


# -- the server's side --------------------------------------------------------------------------------------------


def serve(link: socket.socket) -> Order | None:
    """Fork as ordered until the link closes (None); in each child: what it is to be."""
    ends = _Ends()
    poll = select.poll()
    for source in (link, ends.bell):
        poll.register(source, select.POLLIN)
    while True:
        for ready, _ in poll.poll():
            if ready == ends.bell.fileno():
                ends.tell()
                continue
            data, files, _, _ = socket.recv_fds(link, _LONGEST_ORDER, _FILES)
            if not data:
                return None
            order = msgspec.json.decode(data, type=Order)
            stdin, output, status = files
            pid = os.fork()
            if pid == 0:
                link.close()
                ends.forget()
                os.close(status)
                _become(order.words[0], stdin, output)
                return order
            os.close(stdin)
            os.close(output)
            ends.expect(pid, status)
            with suppress(OSError):  # the parent is gone: the next look shows it
                link.send(str(pid).encode())


class _Ends:
    """Children's ends: the kernel's signal rings a bell, and each one's exit code goes to who waits for it."""

    def __init__(self) -> None:
        self._status: dict[int, int] = {}
        self.bell, self._ringer = socket.socketpair()
        self.bell.setblocking(False)
        self._ringer.setblocking(False)
        signal.signal(signal.SIGCHLD, lambda *_: None)  # without a handler it would not ring
        signal.set_wakeup_fd(self._ringer.fileno())

    def expect(self, pid: int, status: int) -> None:
        """A child, and the pipe for its exit code."""
        self._status[pid] = status

    def tell(self) -> None:
        """Write the codes of all that have ended."""
        with suppress(BlockingIOError):
            self.bell.recv(_LONGEST_ORDER)
        with suppress(ChildProcessError):
            while (ended := os.waitpid(-1, os.WNOHANG))[0]:
                status = self._status.pop(ended[0])
                with suppress(BrokenPipeError):
                    os.write(status, str(os.waitstatus_to_exitcode(ended[1])).encode())
                os.close(status)

    def forget(self) -> None:
        """In a child: these are others' ends."""
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        self.bell.close()
        self._ringer.close()
        for status in self._status.values():
            os.close(status)


def _become(name: str, stdin: int, output: int) -> None:
    """A process with its own session, input, output and name."""
    os.setsid()
    for source, targets in ((stdin, (0,)), (output, (1, 2))):
        for target in targets:
            os.dup2(source, target)
        os.close(source)
    with suppress(OSError):
        Path("/proc/self/comm").write_text(name[:_NAME_LENGTH], encoding="utf-8")


def _preload(entries: Sequence[str]) -> None:
    for entry in entries:
        module = import_module(entry.split(":")[0])
        getattr(module, "preload", lambda: None)()
    gc.collect()
    gc.freeze()  # no child's collection touches, and so copies, what all of them share


def main() -> None:
    """The server: ``sys.argv`` holds its link's descriptor and what may be forked.

    Returns in the server when its parent is gone, and in each child when its service has ended.
    """
    link, *entries = sys.argv[1:]
    _preload(entries)
    order = serve(socket.socket(fileno=int(link)))
    if order is not None:
        sys.argv = order.words
        resolve_name(order.entry)()
