"""A tiny real service for the scaffold's tests: repeats pressures, fails on one of 13 Pa."""

from collections.abc import Iterable

from bootprint.bus import Envelope
from bootprint.figures import Figures
from bootprint.messages import Pressure
from bootprint.service import Context, CorePart, Service


class EchoCore:
    """Sends every pressure on under the source ``echo``."""

    def __init__(self) -> None:
        self._heard = 0

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        message = envelope.message
        assert isinstance(message, Pressure)
        if message.pressure_pa == 13.0:
            raise RuntimeError("thirteen")
        self._heard += 1
        if envelope.address.source != "echo":
            yield Envelope(envelope.address.with_subject("pressure", "echo"), message)

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        return ()

    def figures(self) -> Figures:
        return Figures(counters={"heard": self._heard})


def build(context: Context) -> CorePart:
    return CorePart(EchoCore())


if __name__ == "__main__":
    Service("echo", "Repeats pressures.", ("pressure",), build).main()
