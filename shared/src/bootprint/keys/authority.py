"""A realm's authority: the folder on the planner's computer that makes, renews and revokes computers' certificates.

``ca.key`` never leaves it. Certificates are named after their soldier and counted (``a3.1``, ``a3.2``): a new one
takes the old one's place in the register, so that what was lost stays locked out under its own name.
"""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import msgspec
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec

from bootprint.errors import ConfigError
from bootprint.keys.certificates import (
    authority_certificate,
    certificate_of,
    common_name,
    computer_certificate,
    key_of,
    key_pem,
    new_key,
    pem_of,
    until,
)
from bootprint.keys.register import REGISTER, Certificate, Register, load_register, signed
from bootprint.keys.secret_files import create_secret, read_secret, replace_secret

CA_KEY: Final = "ca.key"
CA_CERTIFICATE: Final = "ca.crt"
_COMPUTERS: Final = "computers"
_MEND: Final = "`bootprint keys authority` makes one"


@dataclass(frozen=True)
class Authority:
    """An open authority. Methods write what they make at once; ConfigError rather than overwrite a key."""

    folder: Path
    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey
    register: Register

    def issue(self, soldier: str, hosts: tuple[str, ...], days: int, now: datetime) -> "Authority":
        """Make a certificate, and key, for a soldier's computer; one that it had before is revoked."""
        name = f"{soldier}.{self.register.issued(soldier) + 1}"
        key = new_key()
        made = computer_certificate(name, hosts, key, self.certificate, self.key, days, now)
        if until(made) > until(self.certificate):
            left = (until(self.certificate) - now).days
            raise ConfigError(f"--days {days}: the authority itself ends in {left} days; want fewer")
        create_secret(self._path(name, "key"), key_pem(key))
        create_secret(self._path(name, "crt"), pem_of(made))
        entry = Certificate(
            soldier=soldier,
            name=name,
            serial=f"{made.serial_number:x}",
            until_s=int(until(made).timestamp()),
            hosts=hosts,
        )
        valid = tuple(each for each in self.register.valid if each.soldier != soldier)
        return self._registered((*valid, entry), now)

    def revoke(self, soldier: str, now: datetime) -> "Authority":
        """Strike a computer's certificate out; ConfigError if it has none."""
        if self.register.of(soldier) is None:
            known = ", ".join(each.soldier for each in self.register.valid) or "nobody"
            raise ConfigError(f"{soldier!r} has no certificate to revoke (valid: {known})")
        return self._registered(tuple(each for each in self.register.valid if each.soldier != soldier), now)

    def _registered(self, valid: tuple[Certificate, ...], now: datetime) -> "Authority":
        before = self.register
        revoked = (*before.revoked, *(each for each in before.valid if each not in valid))
        register = msgspec.structs.replace(
            before, number=before.number + 1, made_s=int(now.timestamp()), valid=valid, revoked=revoked
        )
        replace_secret(self.folder / REGISTER, signed(register, self.key))
        return Authority(self.folder, self.certificate, self.key, register)

    def files_of(self, soldier: str) -> dict[str, bytes]:
        """What a soldier's computer gets of the authority, by file name; ConfigError if it has no certificate."""
        entry = self.register.of(soldier)
        if entry is None:
            raise ConfigError(f"{soldier!r} has no certificate; `bootprint keys issue` makes one")
        made, key = self._path(entry.name, "crt"), self._path(entry.name, "key")
        return {
            CA_CERTIFICATE: pem_of(self.certificate),
            "computer.crt": read_secret(made, "certificate", "issue it again"),
            "computer.key": read_secret(key, "key", "issue it again"),
            REGISTER: signed(self.register, self.key),
        }

    def _path(self, name: str, kind: str) -> Path:
        return self.folder / _COMPUTERS / f"{name}.{kind}"


def create_authority(folder: Path, realm: str, days: int, now: datetime) -> Authority:
    """Make a realm's authority in a folder; ConfigError if there is one."""
    key = new_key()
    certificate = authority_certificate(realm, key, days, now)
    register = Register(realm=realm, number=1, made_s=int(now.timestamp()))
    create_secret(folder / CA_KEY, key_pem(key))
    create_secret(folder / CA_CERTIFICATE, pem_of(certificate))
    create_secret(folder / REGISTER, signed(register, key))
    return Authority(folder, certificate, key, register)


def open_authority(folder: Path) -> Authority:
    """Read an authority's folder; ConfigError if something is missing, open to others or does not fit together."""
    certificate_path, key_path = folder / CA_CERTIFICATE, folder / CA_KEY
    certificate = certificate_of(read_secret(certificate_path, "authority", _MEND), str(certificate_path))
    key = key_of(read_secret(key_path, "authority's key", _MEND), str(key_path))
    if key.public_key() != certificate.public_key():
        raise ConfigError(f"{key_path}: does not belong to {certificate_path.name}; bring the pair that does")
    return Authority(folder, certificate, key, load_register(folder, certificate))


def check_holds(certificate: x509.Certificate, where: str, now: datetime) -> None:
    """ConfigError if it has ended, or not begun."""
    if now > until(certificate):
        ended = until(certificate).date().isoformat()
        raise ConfigError(f"{where}: ended {ended}; `bootprint keys issue` and `keys pack` renew it")
    if now < certificate.not_valid_before_utc.astimezone(UTC):
        raise ConfigError(
            f"{where}: {common_name(certificate)} has not begun; is this computer's clock right?"
        )
