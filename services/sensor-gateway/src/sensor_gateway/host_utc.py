"""How far the host's clock is from UTC, by the word of satellite receivers; one for all sources of a gateway. Pure.

A receiver's fix arrives some tenths of a second after the time it tells, so differences within a second mean
nothing. Greater ones are believed when several fixes over several seconds agree; what had piled up somewhere and
arrives at once does not.
"""

from sensor_gateway.doubt import Doubt

_NS_PER_S = 1_000_000_000
_LEAP_NS = _NS_PER_S
_STATEMENTS, _SPAN_NS, _AGREE_NS = 5, 4 * _NS_PER_S, _NS_PER_S // 2
# 2026-01-01: an earlier date is that of a receiver whose week counter of 1024 weeks has wrapped.
_EARLIEST_NS = 1_767_225_600 * _NS_PER_S


class HostUtc:
    """Host time plus ``offset_ns`` is UTC."""

    def __init__(self) -> None:
        self.offset_ns = 0
        self.steps = 0
        self._doubt = Doubt(_STATEMENTS, _AGREE_NS, _SPAN_NS)

    def utc_ns(self, host_ns: int) -> int:
        """UTC, as well as it is known, when the host's clock stands here."""
        return host_ns + self.offset_ns

    def state_utc(self, host_ns: int, utc_ns: int) -> None:
        """A receiver with a fix said that it is this UTC; the word arrived at this host time."""
        if utc_ns < _EARLIEST_NS:
            return
        offset_ns = utc_ns - host_ns
        if abs(offset_ns - self.offset_ns) <= _LEAP_NS:
            self._doubt.clear()
            return
        settled_ns = self._doubt.settle(host_ns, offset_ns)
        if settled_ns is not None:
            self.offset_ns = settled_ns if abs(settled_ns) > _LEAP_NS else 0
            self.steps += 1

    @property
    def note(self) -> str:
        """What a person should do about it; empty while the host's clock is right."""
        if self.offset_ns == 0:
            return ""
        direction = "behind" if self.offset_ns > 0 else "ahead of"
        return f"this computer's clock is {abs(self.offset_ns) / _NS_PER_S:.1f} s {direction} satellite time"
