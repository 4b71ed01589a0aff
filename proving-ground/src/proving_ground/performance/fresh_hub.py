"""A command post's hub in a process of its own, to be measured from outside.

``python -m proving_ground.performance.fresh_hub FRAMES SOLDIERS SECONDS`` imports what the service imports, builds
the hub, plays the frames (a MessagePack list of (event time ns, bytes)) at their times, and says one line of JSON:
what it did, and its resident memory in MB.
"""

import importlib
import sys
from dataclasses import asdict
from pathlib import Path

import msgspec
import psutil

from proving_ground.performance.hub_company import Company, HeardFrame
from proving_ground.performance.hub_work import keep_picture

_SERVICE = "sa_hub.main"


def main(frames: Path, soldiers: int, duration_s: int) -> None:
    """Play, and say what it took."""
    importlib.import_module(_SERVICE)  # for its weight: bus, scaffold and all
    rows = msgspec.msgpack.decode(frames.read_bytes(), type=list[tuple[int, bytes]])
    heard = [HeardFrame(time_ns, data) for time_ns, data in rows]
    work = keep_picture(Company(soldiers), heard, duration_s)
    resident_mb = psutil.Process().memory_info().rss / 1e6
    sys.stdout.write(msgspec.json.encode(asdict(work) | {"resident_mb": resident_mb}).decode() + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
