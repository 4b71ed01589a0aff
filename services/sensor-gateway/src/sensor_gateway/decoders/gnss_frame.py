"""Frames of satellite receivers: UBX packets and NMEA sentences, whole and with their checksums right."""

from functools import reduce

from sensor_gateway.framing import NEED_MORE, NO_FRAME, Measure

UBX_MARKER, NMEA_MARKER = b"\xb5", b"$"
_UBX_SECOND = 0x62
_UBX_OVERHEAD = 8
_UBX_MAX_PAYLOAD = 4096
_NMEA_MAX_BYTES = 128


def measure_for(*, ubx: bool, nmea: bool) -> tuple[bytes, Measure]:
    """The start markers and the measure of a stream that carries these protocols."""

    def measure(buffer: bytearray, at: int) -> int:
        return measure_ubx(buffer, at) if buffer[at] == UBX_MARKER[0] else measure_nmea(buffer, at)

    return (UBX_MARKER if ubx else b"") + (NMEA_MARKER if nmea else b""), measure


def measure_ubx(buffer: bytearray, at: int) -> int:
    """The length of the UBX packet at ``at`` (u-blox interface description, section 3)."""
    available = len(buffer) - at
    if available > 1 and buffer[at + 1] != _UBX_SECOND:
        return NO_FRAME
    if available < 6:
        return NEED_MORE
    payload = int.from_bytes(buffer[at + 4 : at + 6], "little")
    if payload > _UBX_MAX_PAYLOAD:
        return NO_FRAME
    length = payload + _UBX_OVERHEAD
    if available < length:
        return NEED_MORE
    checksum = bytes(buffer[at + length - 2 : at + length])
    return length if checksum == _fletcher(buffer[at + 2 : at + length - 2]) else NO_FRAME


def _fletcher(data: bytearray) -> bytes:
    """The 8-bit Fletcher checksum of RFC 1145."""
    a = b = 0
    for byte in data:
        a = (a + byte) & 0xFF
        b = (b + a) & 0xFF
    return bytes((a, b))


def measure_nmea(buffer: bytearray, at: int) -> int:
    """The length of the NMEA sentence at ``at``, its line end included."""
    end = buffer.find(b"\n", at, at + _NMEA_MAX_BYTES)
    if end < 0:
        return NEED_MORE if len(buffer) - at < _NMEA_MAX_BYTES else NO_FRAME
    body, star, checksum = bytes(buffer[at + 1 : end]).rstrip(b"\r").partition(b"*")
    computed = b"%02X" % reduce(lambda x, y: x ^ y, body, 0)
    return end + 1 - at if star and checksum.upper() == computed else NO_FRAME
