"""A device's own clock mapped to UTC. Pure: the host's receive time is handed in.

The offset is that of the least delayed samples (`offset_line`), or of the device's own statements of UTC once
it has satellite time. What is applied moves towards it slowly, so that intervals stay true and no stamp goes
back. A device that restarts, or whose clock leaps or wraps, begins a new epoch and is counted.

A statement that contradicts what is known by more than a second is believed when others confirm it. Only when the
best known offset stays behind the applied one by more than a second, which would take minutes or years to make up
slowly, do stamps go back, once; that is counted, too.
"""

from sensor_gateway.doubt import Doubt
from sensor_gateway.offset_line import MinimumDelayLine

_NS_PER_S = 1_000_000_000
# A gap between what both clocks say of an interval that is no delay and no disorder any more.
_LEAP_NS = _NS_PER_S
# Samples that stay so late for so long are not delayed: the host's clock was set forward.
_STAYS_LATE_NS = 2 * _NS_PER_S
# Contradicting statements of UTC that must agree; how long (device time) the offset must stay too far ahead.
_STATEMENTS = 3
_STAYS_AHEAD_NS = 5 * _NS_PER_S
# How fast the applied offset follows, in seconds per second: an interval is never wrong by more.
_SLEW = 0.005


class DeviceClock:
    """Maps stamps of one device clock, ns since whatever, to UTC ns."""

    def __init__(self) -> None:
        self.resets = 0
        self.steps = 0
        self.set_backs = 0
        self.doubted = 0
        self._doubt = Doubt(_STATEMENTS, _LEAP_NS)
        self._ahead_for_ns = 0
        self._by_arrival = MinimumDelayLine()
        self._by_device = MinimumDelayLine()
        self._newest_device_ns: int | None = None
        self._received_ns = 0
        self._late_since_ns: int | None = None
        self._applied_ns = 0
        self._last_utc_ns: int | None = None

    def utc_ns(self, device_ns: int, received_ns: int) -> int:
        """UTC of a stamp received now; later for a later stamp unless ``set_backs`` has risen."""
        self.observe(device_ns, received_ns)
        utc = device_ns + self._applied_ns
        if self._last_utc_ns is None or utc > self._last_utc_ns:
            self._last_utc_ns = utc
        return utc

    def observe(self, device_ns: int, received_ns: int) -> None:
        """The device's clock stood here, at the latest, when the host's stood there."""
        newest = self._newest_device_ns
        if newest is None:
            self._begin_epoch(device_ns, received_ns)
        elif self._has_leapt(device_ns, device_ns - newest, received_ns):
            self.resets += 1
            self._begin_epoch(device_ns, received_ns)
        elif device_ns > newest:
            self._add(device_ns, received_ns)
            self._follow(device_ns - newest, self.target_ns(device_ns))
            self._newest_device_ns, self._received_ns = device_ns, received_ns

    def state_utc(self, device_ns: int, utc_ns: int) -> None:
        """The device itself says which UTC a stamp of its clock is; stamps are cut off, never ahead."""
        offset_ns = utc_ns - device_ns
        contradicts = abs(offset_ns - self.target_ns(device_ns)) > _LEAP_NS
        if contradicts and self._last_utc_ns is not None:
            self.doubted += 1
            settled_ns = self._doubt.settle(device_ns, offset_ns)
            if settled_ns is None:
                return
            self.steps += bool(self._by_device)
            self._by_device.clear()
            offset_ns = settled_ns
        self._doubt.clear()
        self._by_device.add(device_ns, offset_ns)
        if self._last_utc_ns is None:
            self._applied_ns = self.target_ns(device_ns)

    def target_ns(self, device_ns: int) -> int:
        """The best known offset at a stamp: UTC minus device time."""
        line = self._by_device or self._by_arrival
        return line.at(device_ns)

    @property
    def behind_ns(self) -> int:
        """How far the applied offset still is from the best known one."""
        newest = self._newest_device_ns
        return 0 if newest is None else self.target_ns(newest) - self._applied_ns

    def _lateness_ns(self, device_ns: int, received_ns: int) -> int:
        """How much later than undelayed this sample came."""
        return received_ns - device_ns - self._by_arrival.at(device_ns)

    def _has_leapt(self, device_ns: int, step_ns: int, received_ns: int) -> bool:
        """Whether the device's clock went back, or ahead of a host's clock that was not set back itself."""
        host_set_back = received_ns < self._received_ns - _LEAP_NS
        ahead = self._lateness_ns(device_ns, received_ns) < -_LEAP_NS
        return step_ns < -_LEAP_NS or (ahead and not host_set_back)

    def _begin_epoch(self, device_ns: int, received_ns: int) -> None:
        self._by_arrival.clear()
        self._by_device.clear()
        self._doubt.clear()
        self._late_since_ns = None
        self._ahead_for_ns = 0
        self._by_arrival.add(device_ns, received_ns - device_ns)
        self._newest_device_ns, self._received_ns = device_ns, received_ns
        self._applied_ns = received_ns - device_ns
        if self._last_utc_ns is not None:
            self._applied_ns = max(self._applied_ns, self._last_utc_ns + 1 - device_ns)

    def _add(self, device_ns: int, received_ns: int) -> None:
        lateness_ns = self._lateness_ns(device_ns, received_ns)
        if lateness_ns < -_LEAP_NS or self._stays_late(lateness_ns, received_ns):
            self.steps += 1
            self._by_arrival.clear()
            self._late_since_ns = None
        self._by_arrival.add(device_ns, received_ns - device_ns)

    def _stays_late(self, lateness_ns: int, received_ns: int) -> bool:
        if lateness_ns < _LEAP_NS:
            self._late_since_ns = None
            return False
        if self._late_since_ns is None:
            self._late_since_ns = received_ns
        return received_ns - self._late_since_ns > _STAYS_LATE_NS

    def _follow(self, elapsed_ns: int, target_ns: int) -> None:
        """Step forward over a leap, and back over one that lasts; otherwise move slowly."""
        error_ns = target_ns - self._applied_ns
        self._ahead_for_ns = self._ahead_for_ns + elapsed_ns if error_ns < -_LEAP_NS else 0
        if error_ns > _LEAP_NS:
            self._applied_ns = target_ns
        elif self._ahead_for_ns > _STAYS_AHEAD_NS:
            self.set_backs += 1
            self._last_utc_ns = target_ns + (self._newest_device_ns or 0)
            self._ahead_for_ns, self._applied_ns = 0, target_ns
        else:
            limit_ns = int(_SLEW * elapsed_ns)
            self._applied_ns += max(-limit_ns, min(limit_ns, error_ns))
