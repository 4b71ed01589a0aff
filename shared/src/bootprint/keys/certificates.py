"""X.509 as a realm needs it: one authority, and certificates for computers that are servers and clients at once.

P-256 throughout, which every TLS library speaks; profiles by RFC 5280.
"""

import ipaddress
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from typing import Final

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from bootprint.errors import ConfigError

LOCAL_HOSTS: Final = ("127.0.0.1", "localhost")
"""Every computer's own services connect to it by these names."""
_EARLIER: Final = timedelta(days=1)
"""Computers' clocks may be late when a certificate is new."""


def new_key() -> ec.EllipticCurvePrivateKey:
    """A fresh P-256 key."""
    return ec.generate_private_key(ec.SECP256R1())


def authority_certificate(
    realm: str, key: ec.EllipticCurvePrivateKey, days: int, now: datetime
) -> x509.Certificate:
    """The realm's own root, signed by itself; it may sign computers, and nothing that signs further."""
    name = _name(f"bootprint {realm}")
    return (
        _builder(name, name, key, days, now)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
        .sign(key, hashes.SHA256())
    )


def computer_certificate(
    name: str,
    hosts: Iterable[str],
    key: ec.EllipticCurvePrivateKey,
    authority: x509.Certificate,
    authority_key: ec.EllipticCurvePrivateKey,
    days: int,
    now: datetime,
) -> x509.Certificate:
    """A computer's certificate, good for the hosts by which others reach its router, and for itself."""
    usage = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH])
    return (
        _builder(_name(name), authority.subject, key, days, now)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(usage, critical=False)
        .add_extension(x509.SubjectAlternativeName([*map(_host, (*LOCAL_HOSTS, *hosts))]), critical=False)
        .sign(authority_key, hashes.SHA256())
    )


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, days: int, now: datetime
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _EARLIER)
        .not_valid_after(now + timedelta(days=days))
    )


def _name(common_name: str) -> x509.Name:
    try:
        return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])
    except ValueError as error:
        raise ConfigError(f"{common_name!r} cannot be a certificate's name: {error}") from error


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        encipher_only=False,
        decipher_only=False,
    )


def _host(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        pass
    try:
        return x509.DNSName(host)
    except ValueError as error:
        raise ConfigError(f"--host {host!r} is neither an address nor a host's name: {error}") from error


def pem_of(certificate: x509.Certificate) -> bytes:
    """A certificate as text."""
    return certificate.public_bytes(serialization.Encoding.PEM)


def key_pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    """A private key as text, not encrypted: the file's mode guards it, for a computer starts without a person."""
    return key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )


def certificate_of(data: bytes, where: str) -> x509.Certificate:
    """A certificate from text; ConfigError if it is none."""
    try:
        return x509.load_pem_x509_certificate(data)
    except ValueError:
        raise ConfigError(f"{where}: is no certificate in PEM") from None


def key_of(data: bytes, where: str) -> ec.EllipticCurvePrivateKey:
    """A private key from text; ConfigError, which tells nothing of it, if it is none."""
    try:
        key = serialization.load_pem_private_key(data, password=None)
    except (ValueError, TypeError):
        raise ConfigError(f"{where}: is no private key in PEM") from None
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise ConfigError(f"{where}: is no elliptic-curve key, want one made by `bootprint keys`")
    return key


def common_name(certificate: x509.Certificate) -> str:
    """The name that routers know a computer by."""
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def fingerprint(certificate: x509.Certificate) -> str:
    """SHA-256 of a certificate, for people to compare: 8 groups of 4 hexadecimal digits, 128 bits."""
    digits = certificate.fingerprint(hashes.SHA256()).hex()[:32]
    return " ".join(digits[start : start + 4] for start in range(0, 32, 4))


def check_signed_by(certificate: x509.Certificate, authority: x509.Certificate, where: str) -> None:
    """ConfigError if another authority signed it."""
    try:
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature):
        raise ConfigError(f"{where}: is not signed by this realm's authority") from None


def until(certificate: x509.Certificate) -> datetime:
    """When it ends, UTC."""
    return certificate.not_valid_after_utc.astimezone(UTC)
