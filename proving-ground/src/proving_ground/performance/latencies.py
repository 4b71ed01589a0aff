"""How late each service's word is: host time from a sensor's stamp until the message is on its computer's bus."""

from collections import defaultdict
from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np

from bootprint.bus import Envelope
from bootprint.clock import EventClock
from bootprint.messages import ImuBatch, Position, Track
from bootprint.topics import Identity
from bootprint.zenoh_bus import ZenohBus, open_bus

SAID_BY: Final = {
    "sensor-gateway": "imu",
    "pdr-engine": "foot_pose",
    "fusion": "position",
    "sa-hub": "track",
}
_COASTING: Final = "coasting"


class Latencies:
    """Listens at some computers' routers from its making on; what comes before `begin` is not counted."""

    def __init__(self, clock: EventClock, computers: Sequence[tuple[Identity, str]]) -> None:
        self._clock = clock
        self._counts = False
        self._seconds: dict[str, list[float]] = defaultdict(list)
        self._buses: list[ZenohBus] = []
        for identity, router in computers:
            bus = open_bus(router)
            self._buses.append(bus)
            for service, subject in SAID_BY.items():
                bus.subscribe(identity.selector(subject), partial(self._take, service, identity.soldier))

    def begin(self) -> None:
        """Count from now on."""
        self._counts = True

    def _take(self, service: str, soldier: str, envelope: Envelope) -> None:
        """In one of the bus's threads, one for each service and computer."""
        if not self._counts or not _is_sensed(envelope, soldier):
            return
        seconds = self._clock.host_seconds_since(_newest_ns(envelope))
        if seconds is not None:
            self._seconds[service].append(seconds)

    def percentiles_ms(self, service: str) -> tuple[float | None, float | None]:
        """Median and 99th percentile of what a service said; None if it said nothing."""
        seconds = self._seconds[service]
        if not seconds:
            return None, None
        median, most = np.percentile(seconds, (50.0, 99.0))
        return 1e3 * float(median), 1e3 * float(most)

    def close(self) -> None:
        """Listen no longer."""
        for bus in self._buses:
            bus.close()


def _is_sensed(envelope: Envelope, soldier: str) -> bool:
    """Whether a sensor of this computer's own soldier is behind it: what coasts is late by design."""
    match envelope.message:
        case Position() as position:
            return position.mode != _COASTING
        case Track() as track:
            return track.via == "own" and track.soldier == soldier and track.mode != _COASTING
    return True


def _newest_ns(envelope: Envelope) -> int:
    """The stamp of the newest thing that a message tells of: of a batch the last sample."""
    message = envelope.message
    if isinstance(message, ImuBatch):
        return int(np.frombuffer(message.sample_time_ns, "<i8")[-1])
    return message.time_ns
