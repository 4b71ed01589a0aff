"""A small disk of its own for a test: it gets full, and can be made read-only; needs root, and says so."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest


@dataclass(frozen=True)
class Disk:
    """A mounted tmpfs."""

    path: Path

    def fill(self) -> Path:
        """A file that takes all the room that is left; remove it to have room again."""
        filler = self.path / "filler"
        with filler.open("wb", buffering=0) as file:
            for size in (4096, 1):
                try:
                    while True:
                        file.write(bytes(size))
                except OSError:
                    continue
        return filler

    def read_only(self, wanted: bool) -> None:
        """Nothing can be written any more, or again."""
        _run("mount", "-o", f"remount,{'ro' if wanted else 'rw'}", str(self.path))


@contextmanager
def small_disk(folder: Path, size_kb: int) -> Iterator[Disk]:
    """A disk of so many kilobytes at a folder that is made for it."""
    folder.mkdir()
    if os.geteuid() != 0:
        pytest.skip("NEEDS ROOT for a disk of its own")
    try:
        _run("mount", "-t", "tmpfs", "-o", f"size={size_kb}k", "tmpfs", str(folder))
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"A DISK OF ITS OWN cannot be mounted here: {error}")
    try:
        yield Disk(folder)
    finally:
        _run("umount", "--lazy", str(folder))


def _run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True, timeout=20)
