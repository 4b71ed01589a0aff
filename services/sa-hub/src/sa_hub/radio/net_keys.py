"""The keys of one radio net: each sender's own, derived from the group key, and how a new group key takes over."""

from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal, Protocol

from cryptography.hazmat.primitives.ciphers.aead import AESCCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from bootprint.clock import NS_PER_S

GROUP_KEY_BYTES: Final = 32
OVERLAP_NS: Final = 24 * 3600 * NS_PER_S
"""For so long after the roll-over frames sealed with the old key are opened still, unless that was lost."""
TagBytes = Literal[4, 8]


class Keys(Protocol):
    """What frames of a net are sealed with, and opened, at a time."""

    @property
    def tag_bytes(self) -> TagBytes:
        """Length of the tag."""

    def sending(self, now_ns: int) -> "NetKeys":
        """The keys to seal with."""

    def accepted(self, now_ns: int) -> "tuple[NetKeys, ...]":
        """The keys to open with, the likeliest first."""


@dataclass(frozen=True)
class NetKeys:
    """The keys of one net under one group key. Net and tag length are bound in, so frames do not cross nets."""

    group_key: bytes
    net: str
    tag_bytes: TagBytes

    @cached_property
    def _ciphers(self) -> dict[int, AESCCM]:
        return {}

    def cipher(self, sender: int) -> AESCCM:
        """The cipher of one sender."""
        if sender not in self._ciphers:
            self._ciphers[sender] = AESCCM(self.key(sender), tag_length=self.tag_bytes)
        return self._ciphers[sender]

    def key(self, sender: int) -> bytes:
        """The 32 bytes of one sender's own key."""
        info = b"bootprint radio 2|%d|%d|" % (self.tag_bytes, sender) + self.net.encode()
        return HKDF(algorithm=SHA256(), length=32, salt=None, info=info).derive(self.group_key)

    def sending(self, _now_ns: int) -> "NetKeys":
        """These, always."""
        return self

    def accepted(self, _now_ns: int) -> "tuple[NetKeys, ...]":
        """These alone."""
        return (self,)


@dataclass(frozen=True, slots=True)
class NextKey:
    """The group key that takes over at ``from_ns``; ``overlap_ns``: how long the old one is opened after that."""

    group_key: bytes
    from_ns: int
    overlap_ns: int = OVERLAP_NS


@dataclass(frozen=True, slots=True)
class RollOver:
    """An old key and a new one: senders change at ``from_ns``, receivers take both from now to the overlap's end.

    Without overlap a lost key is worth nothing from that moment on.
    """

    old: NetKeys
    new: NetKeys
    from_ns: int
    overlap_ns: int = OVERLAP_NS

    @property
    def tag_bytes(self) -> TagBytes:
        """Length of the tag."""
        return self.new.tag_bytes

    def sending(self, now_ns: int) -> NetKeys:
        """The new ones when it is time."""
        return self.new if now_ns >= self.from_ns else self.old

    def accepted(self, now_ns: int) -> tuple[NetKeys, ...]:
        """Both, those that senders use first, until the overlap is over."""
        if now_ns < self.from_ns:
            return self.old, self.new
        return (self.new, self.old) if now_ns < self.from_ns + self.overlap_ns else (self.new,)


def keys_of(net: str, tag_bytes: TagBytes, group_key: bytes, next_key: NextKey | None) -> Keys:
    """The keys of a net, with a roll-over if there is a next group key."""
    keys = NetKeys(group_key, net, tag_bytes)
    if next_key is None:
        return keys
    return RollOver(keys, NetKeys(next_key.group_key, net, tag_bytes), next_key.from_ns, next_key.overlap_ns)
