"""One soldier's line in one process: the same cores as on the bus, over the deterministic `MemoryBus`.

The same run and configuration give the same bytes, every time.
"""

import heapq
from collections.abc import Iterable, Iterator

from bootprint.bus import Core, Envelope, MemoryBus
from bootprint.config import Origin
from bootprint.messages import Position
from bootprint.topics import Identity
from fusion.config import FusionConfig
from fusion.engine import SUBJECTS as FUSION_SUBJECTS
from fusion.engine import FusionCore
from pdr_engine.config import PdrConfig
from pdr_engine.engine import SUBJECTS as PDR_SUBJECTS
from pdr_engine.engine import EngineCore
from sensor_gateway.recordings.run import Run
from sensor_gateway.sources.run_messages import run_messages
from sensor_gateway.stamps import due_ns


def play_run(
    run: Run,
    identity: Identity,
    origin: Origin,
    pdr: PdrConfig,
    fusion: FusionConfig,
    start_ns: int,
    others: Iterable[Envelope] = (),
) -> MemoryBus:
    """Play a whole run through pdr-engine and fusion; the bus's journal holds all that was said.

    ``others``: further messages of this soldier, in the order of their stamps, that come between the run's.
    """
    bus = MemoryBus()
    engine = EngineCore(pdr, identity, origin)
    fuser = FusionCore(fusion, identity, origin)
    _attach(bus, engine, identity, PDR_SUBJECTS)
    _attach(bus, fuser, identity, FUSION_SUBJECTS)
    run_own = run_messages(run, identity, start_ns)
    for envelope in heapq.merge(run_own, others, key=lambda envelope: due_ns(envelope.message)):
        bus.publish(envelope)
    for last_words in (engine.close, fuser.close):
        for envelope in last_words():
            bus.publish(envelope)
    return bus


def positions_of(bus: MemoryBus) -> Iterator[Position]:
    """The positions in a bus's journal, in the order they were published."""
    return (
        envelope.message for envelope in bus.replayed("position") if isinstance(envelope.message, Position)
    )


def _attach(bus: MemoryBus, core: Core, identity: Identity, subjects: tuple[str, ...]) -> None:
    bus.attach(core, [identity.selector(subject) for subject in subjects])
