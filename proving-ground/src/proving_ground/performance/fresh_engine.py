"""A pdr-engine in a process of its own, to be measured from outside.

``python -m proving_ground.performance.fresh_engine WALK.npy`` imports what the service imports, builds its core
with the kernel compiled, and plays the walk (n, 7: s, m/s², rad/s) to both boots in batches of ten. It says
``result`` when the first message is out and ``done`` when the walk is over, and stays until its input ends.
"""

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bootprint.bus import Envelope
from bootprint.messages import ImuBatch
from bootprint.topics import Identity
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from pdr_engine.foot import warm_up

RESULT, DONE = "result", "done"
_SERVICE = "pdr_engine.main"
_BATCH = 10
_IDENTITY = Identity("benchmark", "benchmark", "benchmark")


def main(walk: Path) -> None:
    """Play the walk, say how far it has come, and wait."""
    importlib.import_module(_SERVICE)  # for its weight: bus, scaffold and all
    config = PdrConfig()
    warm_up()
    core = EngineCore(config, _IDENTITY)
    said = False
    for envelope in _batches(walk, config.feet):
        if list(core.handle(envelope)) and not said:
            said = True
            _say(RESULT)
    _say(DONE)
    sys.stdin.read()


def _batches(walk: Path, places: tuple[str, ...]) -> Iterator[Envelope]:
    rows = np.load(walk, mmap_mode="r")
    for sequence, start in enumerate(range(0, len(rows), _BATCH)):
        piece = rows[start : start + _BATCH]
        time_ns = np.round(piece[:, 0] * 1e9).astype(np.int64)
        message = ImuBatch.from_arrays(sequence, time_ns, piece[:, 1:4], piece[:, 4:7])
        for place in places:
            yield Envelope(_IDENTITY.address("imu", place), message)


def _say(word: str) -> None:
    sys.stdout.write(f"{word}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
