"""Counters that never repeat: blocks reserved on disk before the first number of them is used.

A nonce used twice under one key gives the key stream away, so after a power cut no number may come again. A block
is on disk, synced, before it is handed out.

An epoch is a second of the host clock, counted from 2020, and is handed out when that second is over: whoever takes
one later, even with the file lost, takes a later one. So every start takes a fresh epoch, unless the clock has not
passed the last one (it was set back): then the next block of that epoch, for epochs never run ahead of the clock.
"""

import fcntl
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Protocol

import msgspec

from bootprint.errors import ConfigError
from sa_hub.radio.layout import COUNTER_BITS, EPOCH_BITS

BLOCK: Final = 1024
EPOCHS: Final = 1 << EPOCH_BITS
COUNTERS: Final = 1 << COUNTER_BITS
_YEAR_2020_S: Final = 1_577_836_800  # 2020-01-01 UTC


@dataclass(frozen=True, slots=True)
class Block:
    """Counters ``first`` … ``end − 1`` of one epoch, this process's own for ever."""

    epoch: int
    first: int
    end: int


class CounterSource(Protocol):
    """Where a sealer gets its counters from."""

    def reserve(self) -> Block:
        """A block that nobody was given before and nobody will be given again."""


class MemoryCounters:
    """Counters for one process that keeps no state: simulations and tests, never a real key."""

    def __init__(self, epoch: int = 1, block: int = BLOCK) -> None:
        self._epoch = epoch
        self._block = block
        self._next = 0

    def reserve(self) -> Block:
        """The next block; of the next epoch when this one's counters are used up."""
        if self._next + self._block > COUNTERS:
            self._epoch, self._next = self._epoch + 1, 0
        first, self._next = self._next, self._next + self._block
        return Block(self._epoch, first, self._next)


class _Reserved(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file's content: every counter of earlier epochs, and those below ``end`` of this one, are gone."""

    epoch: Annotated[int, msgspec.Meta(ge=0, lt=EPOCHS)]
    end: Annotated[int, msgspec.Meta(ge=0)]


class FileCounters:
    """Counters reserved in a file; several processes on one file never get the same block.

    ``earlier_life``: a file that only a hub which had counters can have written. If it is there and the counters
    are not, they were lost, and a clock that was set back meanwhile would bring nonces again: ConfigError.
    """

    def __init__(
        self,
        path: Path,
        host_time_s: Callable[[], float],
        block: int = BLOCK,
        *,
        earlier_life: Path | None = None,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._path = path
        self._host_time_s = host_time_s
        self._block = block
        self._earlier_life = earlier_life
        self._sleep = sleep
        self._mine: _Reserved | None = None

    def reserve(self) -> Block:
        """Go on in our epoch if it is still the file's last, else take a fresh one; on disk before it returns.

        Waits up to a second until the epoch's own second is over.
        """
        with self._locked():
            stored = self._read()
            block = self._first(self._checked_clock()) if stored is None else self._next(stored)
            reserved = _Reserved(block.epoch, block.end)
            self._write(reserved)
            self._mine = reserved
        self._outlast(block.epoch)
        return block

    def _first(self, clock_s: float) -> Block:
        return Block(int(clock_s), 0, self._block)

    def _next(self, stored: _Reserved) -> Block:
        room = stored.end + self._block <= COUNTERS
        clock_s = self._clock_s()
        fresh = stored.epoch < int(clock_s) < EPOCHS
        if room and (stored == self._mine or not fresh):
            return Block(stored.epoch, stored.end, stored.end + self._block)
        if fresh:
            return self._first(clock_s)
        if stored.epoch + 1 >= EPOCHS:
            raise ConfigError(
                f"{self._path}: all radio counters are used up; make a new group key, then delete this"
            )
        return Block(stored.epoch + 1, 0, self._block)

    def _clock_s(self) -> float:
        """Seconds since 2020."""
        return self._host_time_s() - _YEAR_2020_S

    def _checked_clock(self) -> float:
        """The clock where no counters are stored; ConfigError if nothing vouches for fresh nonces then."""
        if self._earlier_life is not None and self._earlier_life.exists():
            raise ConfigError(
                f"{self._path}: the radio counters are lost, but {self._earlier_life.name} shows an earlier life; "
                f"restore the file, or make a new group key and delete {self._earlier_life.name}"
            )
        clock_s = self._clock_s()
        if not 0.0 <= clock_s < EPOCHS:
            raise ConfigError(
                f"{self._path}: no radio counters yet, and this computer's clock is not between 2020 and 2054; "
                "set it before the first start"
            )
        return clock_s

    def _outlast(self, epoch: int) -> None:
        """Wait until the epoch's second is over, so that nobody who starts after us can take it."""
        left_s = epoch + 1 - self._clock_s()
        if 0.0 < left_s <= 1.0:
            self._sleep(left_s)

    def _read(self) -> _Reserved | None:
        try:
            return msgspec.json.decode(self._path.read_bytes(), type=_Reserved)
        except FileNotFoundError:
            return None
        except (msgspec.MsgspecError, OSError) as error:
            raise ConfigError(
                f"{self._path}: damaged radio counters ({error}); restore the file, "
                f"or make a new group key and delete all of {self._path.stem}.*"
            ) from error

    def _write(self, reserved: _Reserved) -> None:
        try:
            write_synced(self._path, msgspec.json.encode(reserved))
        except OSError as error:
            raise ConfigError(f"{self._path}: radio counters cannot be kept there: {error}") from error

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Hold the file's lock, so that two processes reserve one after the other."""
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            lock = os.open(self._path.with_suffix(".lock"), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise ConfigError(f"{self._path}: radio counters cannot be kept there: {error}") from error
        try:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield
        finally:
            os.close(lock)


def write_synced(path: Path, data: bytes) -> None:
    """Replace the file so that after a power cut it is the old one or the new one, and now is the new one."""
    fresh = path.with_name(f"{path.name}.new")
    with fresh.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    fresh.replace(path)
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
