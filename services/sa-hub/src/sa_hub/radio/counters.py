"""Counters that never repeat: blocks reserved on disk before the first number of them is used.

A nonce used twice under one key gives the key stream away, so after a power cut no number may come again. Every
start takes a fresh epoch; within it, blocks of counters. A block is on disk, synced, before it is handed out.
Where the file is lost, the host clock (minutes since 2020) makes an epoch beyond all earlier ones.
"""

import fcntl
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

import msgspec

from bootprint.errors import ConfigError
from sa_hub.radio.layout import COUNTER_BITS, EPOCH_BITS

BLOCK: Final = 1024
EPOCHS: Final = 1 << EPOCH_BITS
COUNTERS: Final = 1 << COUNTER_BITS
_YEAR_2020_MINUTES: Final = 26_297_280  # minutes from 1970 to 2020-01-01 UTC


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
        """The next block of the one epoch."""
        first, self._next = self._next, self._next + self._block
        return Block(self._epoch, first, self._next)


class _Reserved(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file's content: every counter of earlier epochs, and those below ``end`` of this one, are gone."""

    epoch: int
    end: int


class FileCounters:
    """Counters reserved in a file; several processes on one file never get the same block."""

    def __init__(self, path: Path, host_time_s: Callable[[], float], block: int = BLOCK) -> None:
        self._path = path
        self._host_time_s = host_time_s
        self._block = block
        self._mine: _Reserved | None = None

    def reserve(self) -> Block:
        """Go on in our epoch if it is still the file's last, else take a fresh one; on disk before it returns."""
        with self._locked():
            stored = self._read()
            room = stored is not None and stored.end + self._block <= COUNTERS
            if stored is not None and room and (stored == self._mine or stored.epoch + 1 >= EPOCHS):
                block = Block(stored.epoch, stored.end, stored.end + self._block)
            else:
                block = Block(self._fresh_epoch(stored), 0, self._block)
            reserved = _Reserved(block.epoch, block.end)
            self._write(reserved)
            self._mine = reserved
        return block

    def _fresh_epoch(self, stored: _Reserved | None) -> int:
        minutes = int(self._host_time_s() // 60) - _YEAR_2020_MINUTES
        by_clock = minutes if 0 <= minutes < EPOCHS - 1 else 0
        epoch = max(by_clock, 0 if stored is None else stored.epoch + 1)
        if epoch >= EPOCHS:
            raise ConfigError(
                f"{self._path}: all radio counters are used up; make a new group key, then delete this"
            )
        return epoch

    def _read(self) -> _Reserved | None:
        try:
            return msgspec.json.decode(self._path.read_bytes(), type=_Reserved)
        except FileNotFoundError:
            return None
        except (msgspec.MsgspecError, OSError) as error:
            raise ConfigError(
                f"{self._path}: damaged radio counters ({error}); delete the file and make a new group key"
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
    fresh = path.with_suffix(".new")
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
