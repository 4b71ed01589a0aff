"""Operating-system processes that belong to this one: started with a line to their parent, stopped without remains.

Every child runs with ``--stop-on-eof`` and a pipe on its standard input: when the parent dies, however it dies,
the pipe closes and the child ends. A normal stop closes the pipes, waits, then terminates, then kills.
Commands that are started again and again can be forked from a server that has imported them (`fork_server`).
"""

import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

from bootprint.errors import BootprintError
from bootprint.fork_server import Forked, ForkServer, ForkServerError

_GRACE_S = 6.0
Child = subprocess.Popen[bytes] | Forked
_FORCES: tuple[Callable[[Child], None], ...] = (
    lambda _: None,  # its input is closed: it ends by itself
    lambda child: child.terminate(),
    lambda child: child.kill(),
)


class ProcessError(BootprintError):
    """A process could not be started or ended early."""


@dataclass(frozen=True)
class ProcessSpec:
    """A service to run: the command (a console script of this installation), its arguments and its log file.

    Without ``log`` it writes where its parent does; ``append`` keeps what the file holds from earlier lives.
    """

    name: str
    command: str
    arguments: tuple[str, ...]
    log: Path | None
    append: bool = False


class ProcessGroup:
    """Processes of one parent; a context manager that leaves none behind."""

    def __init__(self, forked: Sequence[str] = ()) -> None:
        """``forked``: commands to be forked from a server that has them imported, instead of started afresh."""
        self._running: dict[str, tuple[ProcessSpec, Child]] = {}
        self._server = ForkServer(forked)

    def start(self, spec: ProcessSpec) -> None:
        """Start one process; ProcessError if its command is not installed."""
        arguments = [*spec.arguments, "--stop-on-eof"]
        with _opened(spec) as log:
            if self._server.serves(spec.command):
                process: Child = self._forked(spec.command, arguments, log)
            else:
                process = _popen(spec.command, arguments, log)
        self._running[spec.name] = (spec, process)

    def _forked(self, command: str, arguments: Sequence[str], log: BinaryIO | None) -> Forked:
        try:
            return self._server.start(command, arguments, log)
        except ForkServerError as error:
            raise ProcessError(str(error)) from error

    @property
    def pids(self) -> dict[str, int]:
        """Process id by name."""
        return {name: process.pid for name, (_, process) in self._running.items()}

    @property
    def all_pids(self) -> dict[str, int]:
        """The same with the ``fork-server``, if there is one: all that this group costs."""
        server = {} if self._server.pid is None else {"fork-server": self._server.pid}
        return self.pids | server

    def failed(self) -> list[str]:
        """One line for each process that ended with an error: its name, exit code and last words."""
        return [
            f"{name} {end_of(code)}{_last_words(spec)}"
            for name, (spec, process) in self._running.items()
            if (code := process.poll())
        ]

    def reap(self) -> dict[str, int]:
        """Those that have ended, with their exit codes; they are no longer of the group."""
        codes = {name: process.poll() for name, (_, process) in self._running.items()}
        ended = {name: code for name, code in codes.items() if code is not None}
        for name in ended:
            self._let_go(name)
        return ended

    def take_dead(self, ours: Callable[[str], bool]) -> list[tuple[str, int]]:
        """Those that ended with an error, of ``ours`` by name, with their exit codes; no longer of the group."""
        codes = {name: process.poll() for name, (_, process) in self._running.items() if ours(name)}
        dead = [(name, code) for name, code in codes.items() if code]
        for name, _ in dead:
            self._let_go(name)
        return dead

    def _let_go(self, name: str) -> None:
        _, process = self._running.pop(name)
        if process.stdin:
            process.stdin.close()

    def check(self) -> None:
        """ProcessError if any process has ended with an error."""
        if lines := self.failed():
            raise ProcessError("; ".join(lines))

    def kill(self, name: str) -> None:
        """One process is gone without warning, and nobody is to wonder; nothing if it does not run."""
        _, process = self._running.pop(name, (None, None))
        if process is not None:
            process.kill()
            process.wait()
            if process.stdin:
                process.stdin.close()

    def stop(self, names: Collection[str] | None = None) -> None:
        """End all (or those named): close their input, then terminate, then kill; returns when none is left."""
        ended = [name for name in self._running if names is None or name in names]
        processes = [self._running[name][1] for name in ended]
        if names is not None:
            for name in ended:
                del self._running[name]
        for process in processes:
            if process.stdin:
                process.stdin.close()
        for force in _FORCES:
            for process in processes:
                if process.poll() is None:
                    force(process)
            if _all_ended(processes, _GRACE_S):
                break
        if names is None:
            self._server.close()

    def __enter__(self) -> "ProcessGroup":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


def _popen(command: str, arguments: Sequence[str], log: BinaryIO | None) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [_find(command), *arguments],
        stdin=subprocess.PIPE,
        stdout=log,
        stderr=log,
        start_new_session=True,  # Ctrl-C reaches the parent, which then stops its children in order
    )


def _all_ended(processes: list[Child], within_s: float) -> bool:
    deadline = time.monotonic() + within_s
    for process in processes:
        try:
            process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            return False
    return True


def end_of(code: int) -> str:
    """How a process with this exit code ended, in words."""
    return f"was killed by signal {-code}" if code < 0 else f"ended with exit code {code}"


def _find(command: str) -> str:
    beside = Path(sys.executable).parent / command
    found = str(beside) if beside.exists() else shutil.which(command)
    if found is None:
        raise ProcessError(f"command {command!r} is not installed here; run `make setup`")
    return found


def _opened(spec: ProcessSpec) -> AbstractContextManager[BinaryIO | None]:
    return nullcontext() if spec.log is None else spec.log.open("ab" if spec.append else "wb")


def _last_words(spec: ProcessSpec) -> str:
    if spec.log is None:
        return ""
    lines = spec.log.read_text(errors="replace").strip().splitlines()
    return f"; its last words in {spec.log}: {lines[-1] if lines else '(no output)'}"
