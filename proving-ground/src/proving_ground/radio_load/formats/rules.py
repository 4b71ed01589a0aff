"""Update rules of others' systems, as their sources or standards give them."""

import math
from typing import Final

from proving_ground.radio_load.formats.format import Moment

_FIRST_WITHIN_S: Final = 10.0
_GOLDEN: Final = 0.618034
_JUST_S: Final = 1e-6  # stamps are multiples of 0.2 s, which no float is


def _first_s(number: int, within_s: float) -> float:
    """When a device speaks first: devices are not switched on at one moment."""
    return (number * _GOLDEN % 1.0) * within_s


class FixedInterval:
    """Every ``interval_s``, whatever happens."""

    def __init__(self, interval_s: float, number: int) -> None:
        self._interval_s = interval_s
        self._next_s = _first_s(number, interval_s)

    def due(self, moment: Moment) -> bool:
        """Whether the interval is over."""
        if moment.time_s < self._next_s - _JUST_S:
            return False
        self._next_s += self._interval_s
        return True


class AtakDynamic:
    """ATAK-CIV's "Dynamic" strategy with its defaults on mesh networks (class ReportingRate).

    Standing (below 1 mph) every 30 s; moving every 20 s − 18 s · share, where share is the way of the speed from
    1 mph to 30 mph; at once when the speed has changed by 7 mph. Turning does not count.
    """

    STANDING_S: Final = 30.0
    SLOW_S, FAST_S = 20.0, 2.0
    SLOW_M_S, FAST_M_S = 0.44704, 13.4112
    CHANGE_M_S: Final = 3.12928

    def __init__(self, number: int) -> None:
        self._last_s = _first_s(number, _FIRST_WITHIN_S) - self.STANDING_S
        self._speed_m_s = 0.0

    def interval_s(self, speed_m_s: float) -> float:
        """Between reports at this speed."""
        if speed_m_s < self.SLOW_M_S:
            return self.STANDING_S
        # The source adds its least speed, in m/s, to a percentage; kept, since it is what is on the air.
        percent = self.SLOW_M_S + 100.0 * (speed_m_s - self.SLOW_M_S) / (self.FAST_M_S - self.SLOW_M_S)
        return max(self.FAST_S, self.SLOW_S - (self.SLOW_S - self.FAST_S) * percent / 100.0)

    def due(self, moment: Moment) -> bool:
        """Whether interval or change of speed ask for a report."""
        speed_m_s = math.hypot(moment.east_m_s, moment.north_m_s)
        changed = abs(speed_m_s - self._speed_m_s) > self.CHANGE_M_S
        if not changed and moment.time_s - self._last_s < self.interval_s(speed_m_s) - _JUST_S:
            return False
        self._last_s, self._speed_m_s = moment.time_s, speed_m_s
        return True


class SmartDistance:
    """Meshtastic's smart position: moved by 100 m and 5 min gone, else every hour (firmware defaults)."""

    DISTANCE_M: Final = 100.0
    LEAST_S: Final = 300.0
    AT_LEAST_EVERY_S: Final = 3600.0

    def __init__(self, number: int) -> None:
        self._first_s = _first_s(number, _FIRST_WITHIN_S)
        self._last: Moment | None = None

    def due(self, moment: Moment) -> bool:
        """Whether distance and time, or time alone, ask for a report."""
        if self._last is None:
            due = moment.time_s >= self._first_s
        else:
            silence_s = moment.time_s - self._last.time_s + _JUST_S
            gone_m = math.hypot(moment.east_m - self._last.east_m, moment.north_m - self._last.north_m)
            due = silence_s >= self.AT_LEAST_EVERY_S or (
                silence_s >= self.LEAST_S and gone_m >= self.DISTANCE_M
            )
        if due:
            self._last = moment
        return due


class DeadReckoning:
    """DIS (IEEE 1278.1): the linear prediction off by 1 m, the heading by 3°, or 5 s of silence."""

    POSITION_M: Final = 1.0
    HEADING_RAD: Final = math.radians(3.0)
    HEARTBEAT_S: Final = 5.0
    MOVING_M_S: Final = 0.5  # below, a direction of motion says little of where somebody faces

    def __init__(self, number: int) -> None:
        self._first_s = _first_s(number, self.HEARTBEAT_S)
        self._last: Moment | None = None
        self._heading_rad = 0.0

    def due(self, moment: Moment) -> bool:
        """Whether a receiver's prediction or its patience is at its end."""
        last = self._last
        heading_rad = self._heading_of(moment)
        if last is None:
            due = moment.time_s >= self._first_s
        else:
            elapsed_s = moment.time_s - last.time_s
            off_m = math.hypot(
                moment.east_m - last.east_m - last.east_m_s * elapsed_s,
                moment.north_m - last.north_m - last.north_m_s * elapsed_s,
            )
            turned = abs(math.remainder(heading_rad - self._heading_rad, 2.0 * math.pi)) > self.HEADING_RAD
            due = off_m > self.POSITION_M or turned or elapsed_s >= self.HEARTBEAT_S - _JUST_S
        if due:
            self._last, self._heading_rad = moment, heading_rad
        return due

    def _heading_of(self, moment: Moment) -> float:
        """Where a soldier faces: where they walk; who stands faces where they last walked."""
        if math.hypot(moment.east_m_s, moment.north_m_s) < self.MOVING_M_S:
            return self._heading_rad
        return math.atan2(moment.north_m_s, moment.east_m_s)
