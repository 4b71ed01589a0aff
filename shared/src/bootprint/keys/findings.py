"""What there is to say of a computer's certificates: `bootprint keys check`, and a part of `bootprint doctor`."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from typing import Final

from cryptography import x509

from bootprint.config import Computer
from bootprint.errors import ConfigError
from bootprint.findings import Finding, examined
from bootprint.keys.authority import check_holds
from bootprint.keys.certificates import certificate_of, check_signed_by, common_name, key_of, until
from bootprint.keys.register import Register, load_register
from bootprint.keys.secret_files import read_secret

SOON_DAYS: Final = 30
RENEWAL: Final = "`bootprint keys issue` and `keys pack` at the authority, then `keys unpack --update` here"
_MEND: Final = "`bootprint keys unpack` brings it"


@dataclass(frozen=True)
class _Shown:
    """A computer's certificate and its realm's authority."""

    certificate: x509.Certificate
    authority: x509.Certificate


def key_findings(computer: Computer, now: datetime) -> Iterator[Finding]:
    """Certificate, key, authority and register, as far as this computer's bus asks for them."""
    if not computer.is_guarded:
        yield Finding("ok", "certificate", f"none needed: {computer.router} is this computer's alone")
        return
    try:
        shown = _load(computer)
        _check(computer, shown, now)
    except ConfigError as error:
        yield Finding("fault", "certificate", str(error), RENEWAL)
        return
    yield _lasting("certificate", shown.certificate, now)
    yield _lasting("authority", shown.authority, now)
    yield examined("register", partial(_check_register, computer, shown), "admits this computer")


def _load(computer: Computer) -> _Shown:
    files = computer.credentials
    return _Shown(
        certificate_of(read_secret(files.certificate, "certificate", _MEND), str(files.certificate)),
        certificate_of(read_secret(files.authority, "authority's certificate", _MEND), str(files.authority)),
    )


def _check(computer: Computer, shown: _Shown, now: datetime) -> None:
    """ConfigError unless the three files belong together, to this soldier, and hold now."""
    files = computer.credentials
    key = key_of(read_secret(files.key, "key", _MEND), str(files.key))
    if key.public_key() != shown.certificate.public_key():
        raise ConfigError(f"{files.key}: is not the key of {files.certificate.name}")
    check_signed_by(shown.certificate, shown.authority, str(files.certificate))
    check_holds(shown.certificate, str(files.certificate), now)
    check_holds(shown.authority, str(files.authority), now)
    soldier = common_name(shown.certificate).rpartition(".")[0]
    if soldier != computer.member.id:
        raise ConfigError(f"{files.certificate}: is {soldier}'s, this is {computer.member.id}'s computer")


def _lasting(subject: str, certificate: x509.Certificate, now: datetime) -> Finding:
    """Until when it holds, and a warning when that is soon."""
    end = until(certificate)
    days = (end - now).days
    what = f"{common_name(certificate)}, until {end.date().isoformat()} ({days} days)"
    return Finding("warning", subject, what, RENEWAL) if days < SOON_DAYS else Finding("ok", subject, what)


def _check_register(computer: Computer, shown: _Shown) -> None:
    register = load_register(computer.keys_dir, shown.authority)
    check_belongs(register, computer)
    if _name_of(register, computer) != common_name(shown.certificate):
        raise ConfigError(
            f"{common_name(shown.certificate)} is revoked, no router admits it; unpack a newer bundle"
        )


def check_belongs(register: Register, computer: Computer) -> None:
    """ConfigError if it is another realm's."""
    if register.realm != computer.realm.id:
        raise ConfigError(f"the register is of realm {register.realm!r}, this is {computer.realm.id!r}")


def _name_of(register: Register, computer: Computer) -> str:
    certificate = register.of(computer.member.id)
    return "" if certificate is None else certificate.name
