"""Soldiers as vehicles of a ground station: HEARTBEAT and GLOBAL_POSITION_INT, one MAVLink system each.

A soldier's roster number is the system's id. The place is where the soldier is believed to be now. Of one who is
lost nothing is said, so that the ground station reports lost contact by its own rules.
"""

import math
import socket
from collections.abc import Iterator
from typing import Any, Final

from pymavlink.dialects.v20 import common as dialect

from bootprint.bus import Envelope
from bootprint.clock import EventClock
from bootprint.display import Ages, Shown, shown
from bootprint.messages import Track
from sa_hub.outputs.settings import MavlinkOutSettings, address_of

_SYSTEMS: Final = range(1, 255)  # 255 is the ground station's own
_UNKNOWN_HEADING: Final = 65535
_LEAST_SPEED_M_S: Final = 0.3
_NS_PER_MS: Final = 1_000_000
_STATES: Final = {"fresh": dialect.MAV_STATE_ACTIVE, "stale": dialect.MAV_STATE_STANDBY}


class Vehicles:
    """The frames for everyone, by time; ``begin_ns`` is when the systems booted."""

    def __init__(self, begin_ns: int, undulation_m: float, ages: Ages) -> None:
        self.unnumbered: set[int] = set()
        """Roster numbers that cannot be a MAVLink system."""
        self._begin_ns = begin_ns
        self._undulation_m = undulation_m
        self._ages = ages
        self._tracks: dict[int, Track] = {}
        self._senders: dict[int, Any] = {}

    def tell(self, track: Track) -> None:
        """Take in a track."""
        if track.number in _SYSTEMS:
            self._tracks[track.number] = track
        else:
            self.unnumbered.add(track.number)

    def frames(self, now_ns: int) -> Iterator[bytes]:
        """Two frames for everyone who is not lost, as of now."""
        for number, track in self._tracks.items():
            view = shown(track, now_ns, self._ages)
            if view.state != "lost":
                yield self._frame(number, _heartbeat(view))
                yield self._frame(number, self._position(track, view, now_ns))

    def _frame(self, number: int, message: Any) -> bytes:
        sender = self._senders.get(number)
        if sender is None:
            autopilot = dialect.MAV_COMP_ID_AUTOPILOT1
            sender = self._senders[number] = dialect.MAVLink(None, srcSystem=number, srcComponent=autopilot)
        frame = bytes(message.pack(sender))
        sender.seq = (sender.seq + 1) % 256
        return frame

    def _position(self, track: Track, view: Shown, now_ns: int) -> Any:
        east, north = track.east_velocity_m_s, track.north_velocity_m_s
        course_deg = math.degrees(math.atan2(east, north)) % 360.0
        altitude_mm = round(((track.height_m or 0.0) - self._undulation_m) * 1e3)
        return dialect.MAVLink_global_position_int_message(
            time_boot_ms=max(0, now_ns - self._begin_ns) // _NS_PER_MS & 0xFFFF_FFFF,
            lat=round(view.latitude_deg * 1e7),
            lon=round(view.longitude_deg * 1e7),
            alt=altitude_mm if track.height_m is not None else 0,
            relative_alt=0,
            vx=_cm_s(north),
            vy=_cm_s(east),
            vz=0,
            hdg=_heading(course_deg) if math.hypot(east, north) >= _LEAST_SPEED_M_S else _UNKNOWN_HEADING,
        )


def _heartbeat(view: Shown) -> Any:
    return dialect.MAVLink_heartbeat_message(
        type=dialect.MAV_TYPE_GROUND_ROVER,  # the nearest to a walker that ground stations draw
        autopilot=dialect.MAV_AUTOPILOT_GENERIC,
        base_mode=0,
        custom_mode=0,
        system_status=_STATES[view.state],
        mavlink_version=3,
    )


def _cm_s(speed_m_s: float) -> int:
    return max(-32768, min(32767, round(speed_m_s * 100.0)))


def _heading(course_deg: float) -> int:
    """In hundredths of a degree, 0 to 35999."""
    return round(course_deg * 100.0) % 36_000


class MavlinkSink:
    """Sends the vehicles' frames as datagrams, all of a moment together."""

    name = "mavlink_out"
    most = 10_000
    keeps = False

    def __init__(self, settings: MavlinkOutSettings, clock: EventClock, ages: Ages, where: str) -> None:
        self.interval_s = settings.interval_s
        self._to = [address_of(each, f"{where}.to") for each in settings.to]
        self._clock = clock
        self._vehicles = Vehicles(clock.now_ns(), settings.geoid_undulation_m, ages)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._sent = 0

    def wants(self, envelope: Envelope) -> bool:
        """Tracks."""
        return isinstance(envelope.message, Track)

    def take(self, envelopes: list[Envelope]) -> None:
        """Tell where everyone is now; nobody there to hear it is no fault."""
        for envelope in envelopes:
            if isinstance(envelope.message, Track):
                self._vehicles.tell(envelope.message)
        for frame in self._vehicles.frames(self._clock.now_ns()):
            for address in self._to:
                self._socket.sendto(frame, address)
                self._sent += 1

    def counters(self) -> dict[str, int]:
        """Datagrams sent, and soldiers whose numbers are no system ids."""
        return {"sent": self._sent, "unnumbered": len(self._vehicles.unnumbered)}

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
