"""The register of a realm's certificates: which names are good, which are revoked, signed by the authority.

Routers admit whose name stands there and nobody else, so a lost computer is shut out by the next register. The
file is JSON, ``{"register": {…}, "signature": "…"}``: ECDSA with SHA-256 over the bytes of the register itself.
"""

from pathlib import Path
from typing import Final

import msgspec
from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

from bootprint.errors import ConfigError
from bootprint.keys.secret_files import read_secret

REGISTER: Final = "register.json"
_SIGNATURE: Final = ec.ECDSA(hashes.SHA256())


class Certificate(msgspec.Struct, frozen=True, kw_only=True):
    """One certificate: whose, its common name (``a3.2`` is a3's second), serial number, and until when it holds."""

    soldier: str
    name: str
    serial: str
    until_s: int
    hosts: tuple[str, ...] = ()


class Register(msgspec.Struct, frozen=True, kw_only=True):
    """What an authority says of its realm; ``number`` grows with each change, ``made_s`` is UTC seconds."""

    realm: str
    number: int
    made_s: int
    valid: tuple[Certificate, ...] = ()
    revoked: tuple[Certificate, ...] = ()

    def of(self, soldier: str) -> Certificate | None:
        """The certificate that a soldier's computer shows now."""
        return next((each for each in self.valid if each.soldier == soldier), None)

    def issued(self, soldier: str) -> int:
        """How many certificates a soldier's computer was ever given."""
        return sum(each.soldier == soldier for each in (*self.valid, *self.revoked))


class _Signed(msgspec.Struct, frozen=True):
    register: msgspec.Raw
    signature: str


def signed(register: Register, key: ec.EllipticCurvePrivateKey) -> bytes:
    """The register's file."""
    text = msgspec.json.encode(register)
    return msgspec.json.encode(_Signed(msgspec.Raw(text), key.sign(text, _SIGNATURE).hex()))


def opened(data: bytes, authority: x509.Certificate, where: str) -> Register:
    """The register in a file's bytes; ConfigError if it is none, or not signed by that authority."""
    try:
        file = msgspec.json.decode(data, type=_Signed)
        verify(bytes(file.register), bytes.fromhex(file.signature), authority)
        return msgspec.json.decode(file.register, type=Register)
    except InvalidSignature:
        raise ConfigError(f"{where}: is not signed by this realm's authority; do not use it") from None
    except ValueError as error:  # msgspec's own errors derive from it
        raise ConfigError(f"{where}: is no register of certificates: {error}") from None


def load_register(folder: Path, authority: x509.Certificate) -> Register:
    """The register in a folder of keys."""
    path = folder / REGISTER
    data = read_secret(path, "register of certificates", "`bootprint keys unpack` brings it")
    return opened(data, authority, str(path))


def verify(data: bytes, signature: bytes, authority: x509.Certificate) -> None:
    """InvalidSignature unless the authority signed these bytes; ConfigError if it cannot have."""
    key = authority.public_key()
    if not isinstance(key, ec.EllipticCurvePublicKey):
        raise ConfigError(
            "the authority has no elliptic-curve key; want one made by `bootprint keys authority`"
        )
    key.verify(signature, data, _SIGNATURE)
