"""A computer's configuration and keys as one file that may travel any way: signed by the authority, encrypted.

    "bootprint bundle 1\\n" | salt (16 B) | nonce (12 B) | AES-256-GCM of MessagePack {content, signature}

The cipher's key is HKDF-SHA256 of a code of 128 random bits, which goes another way than the bundle. The signature
is the authority's, ECDSA with SHA-256 over ``content``; a computer that knows its authority takes no other's.
"""

import base64
import binascii
import re
import secrets
from pathlib import Path
from typing import Final

import msgspec
from cryptography import x509
from cryptography.exceptions import InvalidSignature, InvalidTag
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from bootprint.errors import ConfigError
from bootprint.keys.authority import CA_CERTIFICATE, Authority
from bootprint.keys.certificates import certificate_of, common_name
from bootprint.keys.register import REGISTER, load_register, opened, verify
from bootprint.keys.secret_files import create_secret, next_path, read_secret, replace_secret

_MAGIC: Final = b"bootprint bundle 1\n"
_SALT_BYTES, _NONCE_BYTES, _CODE_BYTES = 16, 12, 16
_LARGEST_BYTES: Final = 16 << 20
_NAME: Final = re.compile(r"(realm\.toml|computer\.toml|keys/[A-Za-z0-9_][A-Za-z0-9_.-]{0,63})\Z")
_KEYS: Final = "keys"


class Content(msgspec.Struct, frozen=True, kw_only=True):
    """What a bundle brings: whose it is, and files by their name relative to the configuration's folder."""

    realm: str
    soldier: str
    number: int
    files: dict[str, bytes]


class _Signed(msgspec.Struct, frozen=True):
    content: bytes
    signature: bytes


def new_code() -> str:
    """A code for one bundle: 26 letters and digits in groups, 128 bits."""
    text = base64.b32encode(secrets.token_bytes(_CODE_BYTES)).decode().rstrip("=").lower()
    return "-".join(text[start : start + 4] for start in range(0, len(text), 4))


def read_code(path: Path) -> str:
    """The code in a file; ConfigError if there is none, or others may read it."""
    return read_secret(path, "code", "it travels apart from its bundle").decode("ascii", "replace").strip()


def pack(authority: Authority, soldier: str, others: dict[str, bytes], code: str) -> bytes:
    """A bundle with a computer's certificate, key and register, and ``others``: more files by name."""
    keys = {f"{_KEYS}/{name}": data for name, data in authority.files_of(soldier).items()}
    register = authority.register
    content = msgspec.msgpack.encode(
        Content(realm=register.realm, soldier=soldier, number=register.number, files=keys | others)
    )
    signature = authority.key.sign(content, ec.ECDSA(hashes.SHA256()))
    salt, number = secrets.token_bytes(_SALT_BYTES), secrets.token_bytes(_NONCE_BYTES)
    plain = msgspec.msgpack.encode(_Signed(content, signature))
    return _MAGIC + salt + number + AESGCM(_cipher_key(code, salt)).encrypt(number, plain, _MAGIC)


def open_bundle(data: bytes, code: str, where: str) -> Content:
    """What a bundle brings; ConfigError if the code is not its own, or anything in it is not as it was packed."""
    start = len(_MAGIC) + _SALT_BYTES
    if not data.startswith(_MAGIC) or len(data) < start + _NONCE_BYTES:
        raise ConfigError(f"{where}: is no bundle of `bootprint keys pack`")
    salt, number = data[len(_MAGIC) : start], data[start : start + _NONCE_BYTES]
    try:
        plain = AESGCM(_cipher_key(code, salt)).decrypt(number, data[start + _NONCE_BYTES :], _MAGIC)
        signed = msgspec.msgpack.decode(plain, type=_Signed)
        content = msgspec.msgpack.decode(signed.content, type=Content)
    except InvalidTag:
        raise ConfigError(f"{where}: does not open: another code's, or damaged on its way") from None
    except msgspec.MsgspecError as error:
        raise ConfigError(f"{where}: is no bundle of this version: {error}") from None
    if strange := [name for name in content.files if not _NAME.match(name)]:
        raise ConfigError(f"{where}: brings {strange[0]!r}, which is no file of a computer")
    _check_signature(content, signed, where)
    return content


def _check_signature(content: Content, signed: _Signed, where: str) -> None:
    try:
        verify(signed.content, signed.signature, authority_of(content, where))
    except InvalidSignature:
        raise ConfigError(f"{where}: is not signed by the authority that it names") from None


def authority_of(content: Content, where: str) -> x509.Certificate:
    """The authority that a bundle names."""
    return certificate_of(content.files.get(f"{_KEYS}/{CA_CERTIFICATE}", b""), where)


def install(content: Content, folder: Path, where: str, *, update: bool) -> list[Path]:
    """Write a bundle's files; ConfigError rather than overwrite, unless it is this computer's newer one."""
    paths = {folder / name: data for name, data in content.files.items()}
    if there := [path for path in paths if path.exists()]:
        if not update:
            raise ConfigError(f"{there[0]}: exists already; --update puts a newer bundle in its place")
        _check_follows(content, folder, where)
    for path, data in paths.items():
        (replace_secret if path.exists() else create_secret)(path, data)
    for path in paths:
        if (following := next_path(path)) not in paths:
            following.unlink(missing_ok=True)  # a roll-over that is over: its key is nobody's next
    return list(paths)


def _check_follows(content: Content, folder: Path, where: str) -> None:
    """Whether a bundle goes on from what is installed: the same authority and soldier, and not older."""
    keys = folder / _KEYS
    authority = _installed(keys / CA_CERTIFICATE)
    if authority != authority_of(content, where):
        raise ConfigError(f"{where}: is another authority's than {keys / CA_CERTIFICATE}; do not use it")
    soldier = common_name(_installed(keys / "computer.crt")).rpartition(".")[0]
    if soldier != content.soldier:
        raise ConfigError(f"{where}: is {content.soldier}'s, this computer is {soldier}'s")
    opened(content.files.get(f"{_KEYS}/{REGISTER}", b""), authority, where)
    present = load_register(keys, authority)
    if content.number < present.number:
        raise ConfigError(
            f"{where}: is older (register {content.number}) than what is here (register {present.number})"
        )


def _installed(path: Path) -> x509.Certificate:
    return certificate_of(read_secret(path, "certificate", "unpack into an empty folder"), str(path))


def _cipher_key(code: str, salt: bytes) -> bytes:
    return HKDF(algorithm=hashes.SHA256(), length=32, salt=salt, info=_MAGIC).derive(_code_bytes(code))


def _code_bytes(code: str) -> bytes:
    text = code.replace("-", "").replace(" ", "").upper()
    try:
        data = base64.b32decode(text + "=" * (-len(text) % 8))
    except binascii.Error:
        data = b""
    if len(data) != _CODE_BYTES:
        raise ConfigError("the code is not one of `bootprint keys pack`: want 26 letters and digits 2-7")
    return data
