"""State that outlives its process, saved every few seconds so that a restart goes on where it was.

A file of state holds two slots that are written in turn and in place: header, payload. Whoever is killed while it
writes, and a power cut with half a slot on the disk, leave the other slot whole. Nothing is synced while a service
works: what a process that is killed has written, the kernel keeps, and writes to the disk within half a minute by
itself (Linux, ``dirty_expire_centisecs``); older state is good for nothing here. Files are for their owner's eyes.

Damaged state is as good as none, and said so; so is state of another kind, version or owner.
"""

import os
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_MAGIC: Final = b"bpstate1"
_KIND_BYTES: Final = 16
_HEADER: Final = struct.Struct(
    "<8s16sHQqII"
)  # magic, kind, version, turn, time ns, payload's bytes and CRC-32
_OWNER_ONLY: Final = 0o600
_SLOTS: Final = 2


class StateError(ValueError):
    """A file of state holds nothing that can be gone on from; says why."""


@dataclass(frozen=True, slots=True)
class Kept:
    """What is saved: a payload, and the event time (UTC ns) that it is of."""

    time_ns: int
    payload: bytes


@dataclass(frozen=True, slots=True)
class Form:
    """What a file's state is: ``kind`` (up to 16 letters), ``version`` of its payload, most bytes of it."""

    kind: str
    version: int
    capacity: int

    @property
    def slot_bytes(self) -> int:
        """From one slot's beginning to the next one's: header and payload, in whole pages."""
        return -(-(_HEADER.size + self.capacity) // 4096) * 4096


@dataclass(frozen=True, slots=True)
class _Slot:
    """A slot that was read: whole (``kept``), or what is wrong with it; neither where nothing is."""

    turn: int = -1
    kept: Kept | None = None
    fault: str | None = None


class StateFile:
    """One file of state; `load` once, then `save` as often as wanted."""

    def __init__(self, path: Path, form: Form) -> None:
        self.path = path
        self.form = form
        self._file: int | None = None
        self._turn = 0

    def load(self) -> Kept | None:
        """The newest whole slot, None if there is no file; StateError or OSError if nothing can be read."""
        if not self.path.exists():
            return None
        data = self.path.read_bytes()
        size = self.form.slot_bytes
        slots = [self._slot(data[number * size : (number + 1) * size]) for number in range(_SLOTS)]
        self._turn = max(slot.turn for slot in slots) + 1
        whole = max(slots, key=lambda slot: (slot.kept is not None, slot.turn))
        faults = [slot.fault for slot in slots if slot.fault]
        if whole.kept is None:
            raise StateError(faults[0] if faults else "empty")
        return whole.kept

    def _slot(self, data: bytes) -> _Slot:
        if not any(data):
            return _Slot()
        if len(data) < _HEADER.size:
            return _Slot(fault="damaged: cut off")
        magic, kind, version, turn, time_ns, length, checksum = _HEADER.unpack_from(data)
        payload = data[_HEADER.size : _HEADER.size + length]
        if magic != _MAGIC or len(payload) != length or _checksum(data, payload) != checksum:
            return _Slot(fault="damaged: its checksum is wrong")
        name = kind.rstrip(b"\0").decode(errors="replace")
        if (name, version) != (self.form.kind, self.form.version):
            return _Slot(turn, fault=f"of {name} version {version}, not {self.form.kind} {self.form.version}")
        return _Slot(turn, Kept(time_ns, payload))

    def save(self, kept: Kept) -> None:
        """Write the slot whose turn it is; OSError if that cannot be (a full disk), and the other slot stays."""
        if len(kept.payload) > self.form.capacity:
            raise OSError(f"{self.path}: {len(kept.payload)} B of state, room for {self.form.capacity}")
        kind = self.form.kind.encode().ljust(_KIND_BYTES, b"\0")
        fields = (_MAGIC, kind, self.form.version, self._turn, kept.time_ns, len(kept.payload))
        bare = _HEADER.pack(*fields, 0)
        data = _HEADER.pack(*fields, _checksum(bare, kept.payload)) + kept.payload
        self._write(data, self._turn % _SLOTS * self.form.slot_bytes)
        self._turn += 1

    def _write(self, data: bytes, offset: int) -> None:
        file = self._open()
        if os.pwrite(file, data, offset) != len(data):
            raise OSError(f"{self.path}: no room for {len(data)} B")

    def _open(self) -> int:
        if self._file is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, _OWNER_ONLY)
            os.fchmod(self._file, _OWNER_ONLY)
        return self._file

    def close(self) -> None:
        """The orderly end: what was saved is on the disk; safe to call twice."""
        if self._file is None:
            return
        try:
            os.fsync(self._file)
        finally:
            os.close(self._file)
            self._file = None


def _checksum(header: bytes, payload: bytes) -> int:
    """CRC-32 of the header but for the checksum itself, and of the payload."""
    return zlib.crc32(payload, zlib.crc32(header[: _HEADER.size - 4]))
