"""A satellite receiver's stream, NMEA and UBX mixed as configured, to readings in UTC."""

from collections import Counter
from collections.abc import Iterable

from sensor_gateway.decoders.gnss_frame import NMEA_MARKER, measure_for
from sensor_gateway.decoders.gnss_nmea import NmeaDecoder
from sensor_gateway.decoders.gnss_ubx import UbxDecoder
from sensor_gateway.framing import Framer
from sensor_gateway.readings import MessageReading, Reading, StampedFix
from sensor_gateway.settings import Device


class GnssDecoder:
    """One receiver's bytes; where both protocols come, UBX is the better told and NMEA is left aside."""

    def __init__(self, device: Device) -> None:
        self.counts: Counter[str] = Counter()
        protocols = device.protocol.split("+")
        self._source = device.gnss_name
        self._framer = Framer(*measure_for(ubx="ubx" in protocols, nmea="nmea" in protocols), self.counts)
        self._nmea = NmeaDecoder(self.counts, device.geoid_undulation_m)
        self._ubx = UbxDecoder(self.counts)
        self._has_pvt = False

    def feed(self, data: bytes, received_ns: int) -> list[Reading]:
        """The fixes that these bytes complete."""
        return self._decode(self._framer.feed(data), received_ns)

    def cut(self, received_ns: int) -> list[Reading]:
        """The stream ended: what is still whole, and the epoch that was being told."""
        readings = self._decode(self._framer.cut(), received_ns)
        return readings if self._has_pvt else readings + self._readings(self._nmea.finish(received_ns))

    def notes(self) -> list[str]:
        """Nothing a person must know."""
        return []

    def _decode(self, frames: Iterable[bytes], received_ns: int) -> list[Reading]:
        readings: list[Reading] = []
        for frame in frames:
            self.counts["frames"] += 1
            readings += self._readings(self._fixes(frame, received_ns))
        return readings

    def _fixes(self, frame: bytes, received_ns: int) -> list[StampedFix]:
        if not frame.startswith(NMEA_MARKER):
            fixes = self._ubx.packet(frame, received_ns)
            self._has_pvt = self._has_pvt or bool(fixes)
            return fixes
        return [] if self._has_pvt else self._nmea.sentence(frame, received_ns)

    def _readings(self, fixes: Iterable[StampedFix]) -> list[Reading]:
        return [MessageReading(self._source, None, fix, stamped_by) for fix, stamped_by in fixes]
