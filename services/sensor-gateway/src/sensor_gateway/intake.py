"""One device's stream of bytes made into messages: decoded, stamped in UTC, checked, batched, numbered. Pure."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator

from bootprint.bus import Envelope
from bootprint.messages import GnssFix, ImuBatch
from bootprint.topics import BY_SUBJECT, SUBJECT_OF, Identity
from sensor_gateway.batching import ImuBatcher, Samples, mags
from sensor_gateway.clock import DeviceClock
from sensor_gateway.decoders.gnss import GnssDecoder
from sensor_gateway.decoders.mavlink import MavlinkDecoder
from sensor_gateway.host_utc import HostUtc
from sensor_gateway.rates import RateMeter
from sensor_gateway.readings import ClockId, Decoder, ImuReading, MessageReading, Reading, TimeReading
from sensor_gateway.settings import Device
from sensor_gateway.stamp_line import StampLine
from sensor_gateway.stamps import restamped

# A source is silent when it misses three messages, and a second more.
_SILENT_MESSAGES, _SILENT_S = 3.0, 1.0
# Pressure is expected at 10 Hz, but a HIGHRES_IMU may carry it at 200 Hz: of faster sources every nth is kept.
_PRESSURE_INTERVAL_NS = 75_000_000
_DROPPED = {"duplicate": "duplicates", "back": "stamps_back"}


def make_decoder(device: Device) -> Decoder:
    """The decoder of a device's protocol."""
    return MavlinkDecoder(device) if device.protocol == "mavlink" else GnssDecoder(device)


class Intake:
    """The messages of one device. What is not finite, out of range, repeated or late is dropped and counted.

    Times handed in are the host's; ``host`` knows how far they are from UTC.
    """

    def __init__(self, identity: Identity, device: Device, host: HostUtc | None = None) -> None:
        self._identity = identity
        self._host = HostUtc() if host is None else host
        self._device = device
        self._decoder = make_decoder(device)
        self._counts: Counter[str] = Counter()
        self._clocks: defaultdict[ClockId, DeviceClock] = defaultdict(DeviceClock)
        self._batchers: dict[str, ImuBatcher] = {}
        self._lines: defaultdict[tuple[str, str, bool], StampLine] = defaultdict(StampLine)
        self._sequences: Counter[tuple[str, str]] = Counter()
        self._heard_ns: dict[tuple[str, str], int] = {}
        self._host_ns = 0
        self._rates = RateMeter()

    def feed(self, data: bytes, host_ns: int) -> list[Envelope]:
        """Take bytes that came when the host's clock stood here."""
        self._host_ns = host_ns
        received_ns = self._host.utc_ns(host_ns)
        return self._messages(self._decoder.feed(data, received_ns), received_ns)

    def cut(self, host_ns: int) -> list[Envelope]:
        """The stream was cut (unplugged, or the end): drop the half message, give out all that is whole."""
        self._host_ns = host_ns
        received_ns = self._host.utc_ns(host_ns)
        return [*self._messages(self._decoder.cut(received_ns), received_ns), *self._flush()]

    def tick(self, host_ns: int) -> list[Envelope]:
        """A batch whose sensor fell silent does not wait for its next sample."""
        now_ns = self._host.utc_ns(host_ns)
        due = [place for place, batcher in self._batchers.items() if batcher.is_due(now_ns)]
        return [self._batch(place, self._batchers[place].take()) for place in due]

    def counters(self) -> dict[str, int]:
        """Counts since the start."""
        clocks = self._clocks.values()
        return {
            **(self._decoder.counts + self._counts),
            "clock_resets": sum(clock.resets for clock in clocks),
            "clock_steps": sum(clock.steps for clock in clocks),
            "clock_set_backs": sum(clock.set_backs for clock in clocks),
            "clock_statements_doubted": sum(clock.doubted for clock in clocks),
        }

    def gauges(self) -> dict[str, float]:
        """Rates since the last call, and how far applied clock offsets are from the best known."""
        behind_ns = max((abs(clock.behind_ns) for clock in self._clocks.values()), default=0)
        return {**self._rates.take(), "clock_behind_ms": behind_ns / 1e6}

    def silent(self, host_ns: int, opened_ns: int) -> list[str]:
        """The sensors from which nothing has come for too long, since it was opened at least."""
        return [
            f"{subject}/{source} is silent"
            for subject, source in self._device.expected()
            if host_ns - self._heard_ns.get((subject, source), opened_ns) > _silence_ns(subject)
        ]

    def notes(self) -> list[str]:
        """What else a person should know."""
        return self._decoder.notes()

    def _messages(self, readings: Iterable[Reading], received_ns: int) -> list[Envelope]:
        return [envelope for reading in readings for envelope in self._take(reading, received_ns)]

    def _take(self, reading: Reading, received_ns: int) -> Iterator[Envelope]:
        if isinstance(reading, TimeReading):
            self._take_time(reading, received_ns)
        elif isinstance(reading, ImuReading):
            yield from self._take_sample(reading, received_ns)
        else:
            yield from self._take_message(reading, received_ns)

    def _take_time(self, reading: TimeReading, received_ns: int) -> None:
        clock = self._clocks[reading.clock]
        clock.observe(reading.device_ns, received_ns)
        if reading.utc_ns is not None:
            clock.state_utc(reading.device_ns, reading.utc_ns)

    def _take_sample(self, reading: ImuReading, received_ns: int) -> Iterator[Envelope]:
        if not all(map(math.isfinite, (*reading.accel_m_s2, *reading.gyro_rad_s))):
            self._counts["not_finite"] += 1
            return
        utc_ns = self._clocks[reading.clock].utc_ns(reading.device_ns, received_ns)
        if not self._advances("imu", reading.place, utc_ns):
            return
        batcher = self._batchers.get(reading.place)
        if batcher is None:
            batcher = ImuBatcher(self._device.batch_size, self._device.batch_age_ns)
            self._batchers[reading.place] = batcher
        for samples in batcher.add(utc_ns, reading):
            yield self._batch(reading.place, samples)

    def _take_message(self, reading: MessageReading, received_ns: int) -> Iterator[Envelope]:
        message, source = reading.message, reading.source
        subject = SUBJECT_OF[type(message)]
        shift_ns = 0
        if reading.clock is not None:
            shift_ns = self._clocks[reading.clock].utc_ns(message.time_ns, received_ns) - message.time_ns
        else:
            self._compare_with_host(reading)
        if not self._advances(subject, source, message.time_ns + shift_ns, reading.stamped_by == "arrival"):
            return
        try:
            stamped = restamped(message, shift_ns, self._next_sequence(subject, source))
        except ValueError:  # a start so far back that it fits no stamp
            self._counts["messages_invalid"] += 1
            return
        yield Envelope(self._identity.address(subject, source), stamped)

    def _compare_with_host(self, reading: MessageReading) -> None:
        message = reading.message
        if isinstance(message, GnssFix) and message.fix_kind != "none" and reading.stamped_by == "sensor":
            self._host.state_utc(self._host_ns, message.time_ns)

    def _advances(self, subject: str, source: str, utc_ns: int, by_arrival: bool = False) -> bool:
        """Whether a stamp comes in order after those before it from this source.

        Stamps by arrival, from a receiver that has no time yet, may be ahead of the receiver's own by as much as
        the host's clock is: they have a line of their own.
        """
        line = self._lines[subject, source, by_arrival]
        if subject == "pressure" and 0 < utc_ns - (line.newest_ns or 0) < _PRESSURE_INTERVAL_NS:
            self._counts["pressure_thinned"] += 1
            return False
        order = line.take(utc_ns)
        if order in _DROPPED:
            self._counts[_DROPPED[order]] += 1
            return False
        self._counts["stamps_set_back"] += order == "set_back"
        self._heard_ns[subject, source] = self._host_ns
        self._rates.count(subject, source, 1, utc_ns)
        return True

    def _flush(self) -> list[Envelope]:
        waiting = [(place, batcher.take()) for place, batcher in self._batchers.items()]
        return [self._batch(place, samples) for place, samples in waiting if samples]

    def _batch(self, place: str, samples: Samples) -> Envelope:
        batch = ImuBatch.from_arrays(
            self._next_sequence("imu", place),
            [utc_ns for utc_ns, _ in samples],
            [reading.accel_m_s2 for _, reading in samples],
            [reading.gyro_rad_s for _, reading in samples],
            mags(samples),
        )
        return Envelope(self._identity.address("imu", place), batch)

    def _next_sequence(self, subject: str, source: str) -> int:
        sequence = self._sequences[subject, source]
        self._sequences[subject, source] += 1
        return sequence


def _silence_ns(subject: str) -> int:
    rate_hz = BY_SUBJECT[subject].rate_hz or 1.0
    return round((_SILENT_S + _SILENT_MESSAGES / rate_hz) * 1e9)
