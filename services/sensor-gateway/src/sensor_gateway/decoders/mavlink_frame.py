"""MAVLink frames (versions 1 and 2): their length and checksum. https://mavlink.io/en/guide/serialization.html"""

from pymavlink.dialects.v20 import ardupilotmega as dialect

from sensor_gateway.framing import NEED_MORE, NO_FRAME

MARKERS = b"\xfd\xfe"
_V2 = MARKERS[0]
_SIGNED = 0x01
_SIGNATURE_BYTES = 13
_CRC_BYTES = 2


def measure(buffer: bytearray, at: int) -> int:
    """The length of the frame at ``at`` if its checksum holds.

    A message of another dialect cannot be checked and so is skipped like garbage: to believe its length would
    let a false start swallow true frames.
    """
    length = stated_length(buffer, at)
    if length <= 0:
        return length
    return length if checksum_holds(buffer, at) else NO_FRAME


def stated_length(buffer: bytearray, at: int) -> int:
    """The length that the frame's header tells, once all of it is there."""
    available = len(buffer) - at
    if available < 3:
        return NEED_MORE
    is_v2 = buffer[at] == _V2
    flags = buffer[at + 2] if is_v2 else 0
    if flags & ~_SIGNED:
        return NO_FRAME
    length = _checked_bytes(buffer, at) + _CRC_BYTES + (_SIGNATURE_BYTES if flags & _SIGNED else 0)
    return length if available >= length else NEED_MORE


def checksum_holds(buffer: bytearray, at: int) -> bool | None:
    """Whether a whole frame's checksum is right; None if the message is of another dialect."""
    message_id = int.from_bytes(buffer[at + 7 : at + 10], "little") if buffer[at] == _V2 else buffer[at + 5]
    known = dialect.mavlink_map.get(message_id)
    if known is None:
        return None
    end = at + _checked_bytes(buffer, at)
    checksum = dialect.x25crc(buffer[at + 1 : end] + bytes((known.crc_extra,))).crc
    return bool(checksum == int.from_bytes(buffer[end : end + _CRC_BYTES], "little"))


def _checked_bytes(buffer: bytearray, at: int) -> int:
    """Header and payload."""
    return (10 if buffer[at] == _V2 else 6) + buffer[at + 1]
