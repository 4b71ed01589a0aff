"""Pretend sensors for tests: MAVLink frames of a boot, and a device behind a real pseudo-terminal."""

import os
import tty
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as dialect

UTC_NS = 1_780_000_000_000_000_000
PERIOD_US = 5_000


class MavlinkSender:
    """Packs messages as one system and component would."""

    def __init__(self, system: int = 1, component: int = 1) -> None:
        self._link = dialect.MAVLink(None, srcSystem=system, srcComponent=component)

    def pack(self, message: dialect.MAVLink_message, *, version1: bool = False) -> bytes:
        """The message as a frame."""
        frame = bytes(message.pack(self._link, force_mavlink1=version1))
        self._link.seq = (self._link.seq + 1) % 256
        return frame

    def imu(self, number: int, instance: int = 0, updated: int = 0x3F) -> bytes:
        """The ``number``-th HIGHRES_IMU of a 200 Hz unit; its x acceleration is its number."""
        return self.pack(
            dialect.MAVLink_highres_imu_message(
                1_000_000 + number * PERIOD_US,
                *(float(number), 0.5, 9.75),
                *(0.25, -0.5, 0.125),
                *(0.25, -0.125, 0.5),
                *(1013.25, 0.0, 0.0, 20.5),
                updated,
                instance,
            )
        )

    def imus(self, first: int, count: int) -> list[bytes]:
        """So many frames from the ``first`` on."""
        return [self.imu(number) for number in range(first, first + count)]


class PtyDevice:
    """A serial device that can be plugged and unplugged; ``path`` stays the same, as under /dev/serial/by-id."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "boot"
        self._master: int | None = None

    def plug(self) -> None:
        """A new pseudo-terminal behind the same path."""
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.path.symlink_to(os.ttyname(slave))
        os.close(slave)

    def unplug(self) -> None:
        """The far end is gone: readers get EIO, the path vanishes."""
        if self._master is not None:
            self.path.unlink()
            os.close(self._master)
            self._master = None

    def write(self, data: bytes) -> None:
        """All of ``data`` down the line."""
        assert self._master is not None, "not plugged in"
        while data:
            data = data[os.write(self._master, data) :]

    def running(self) -> Iterator["PtyDevice"]:
        """Plugged in for the length of a fixture."""
        self.plug()
        yield self
        with suppress(FileNotFoundError):
            self.unplug()


def nmea(body: str) -> bytes:
    """A sentence with its checksum."""
    checksum = 0
    for byte in body.encode():
        checksum ^= byte
    return f"${body}*{checksum:02X}\r\n".encode()
