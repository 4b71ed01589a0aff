"""A map of rooms as a sealed parcel: AES-256-GCM with a fresh random nonce, compressed inside.

The key is the sender's own, HKDF-SHA256 of the group key like those of frames but under a name of its own, so that
neither opens the other. A parcel names its sender in clear; who repeats an old one changes nothing, for a map only
replaces an older one. Maps are few (one in ten seconds at most), so that random nonces never meet.
"""

import os
import zlib
from collections.abc import Iterable
from typing import Final

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from bootprint import wire
from bootprint.errors import WireError
from bootprint.rooms import RoomMap
from bootprint.topics import SUBJECT_OF

MOST_BYTES: Final = 200_000
_VERSION: Final = b"R1"
_NONCE_BYTES: Final = 12
_HEAD_BYTES: Final = len(_VERSION) + 2


class ParcelError(Exception):
    """A parcel that is none of this realm's: ``cause`` for counting."""

    def __init__(self, cause: str) -> None:
        super().__init__(cause)
        self.cause = cause


def _cipher(group_key: bytes, sender: int, net: str) -> AESGCM:
    info = b"bootprint rooms 1|%d|" % sender + net.encode()
    return AESGCM(HKDF(algorithm=SHA256(), length=32, salt=None, info=info).derive(group_key))


def seal(rooms: RoomMap, group_key: bytes, sender: int, net: str) -> bytes:
    """Version and sender in clear, nonce, sealed map."""
    head = _VERSION + sender.to_bytes(2, "big")
    nonce = os.urandom(_NONCE_BYTES)
    packed = zlib.compress(wire.encode(rooms), 6)
    return head + nonce + _cipher(group_key, sender, net).encrypt(nonce, packed, head)


def open_parcel(data: bytes, group_keys: Iterable[bytes], net: str) -> tuple[int, RoomMap]:
    """Sender's number and map; ParcelError (size, version, forged, damaged) otherwise."""
    if not _HEAD_BYTES + _NONCE_BYTES < len(data) <= MOST_BYTES:
        raise ParcelError("size")
    head, rest = data[:_HEAD_BYTES], data[_HEAD_BYTES:]
    if not head.startswith(_VERSION):
        raise ParcelError("version")
    sender = int.from_bytes(head[len(_VERSION) :], "big")
    nonce, sealed = rest[:_NONCE_BYTES], rest[_NONCE_BYTES:]
    for group_key in group_keys:
        try:
            packed = _cipher(group_key, sender, net).decrypt(nonce, sealed, head)
        except InvalidTag:
            continue
        return sender, _unpacked(packed)
    raise ParcelError("forged")


def _unpacked(packed: bytes) -> RoomMap:
    unpacker = zlib.decompressobj()
    try:
        payload = unpacker.decompress(packed, wire.MAX_MESSAGE_BYTES)
        if unpacker.unconsumed_tail:
            raise ParcelError("size")
        rooms = wire.decode(SUBJECT_OF[RoomMap], payload)
    except (zlib.error, WireError) as error:
        raise ParcelError("damaged") from error
    assert isinstance(rooms, RoomMap)
    return rooms
