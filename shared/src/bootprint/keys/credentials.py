"""What a computer shows to others on the bus, and whom it trusts: paths of its files, never their contents."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bootprint.keys.secret_files import read_secret

SECURE_PROTOCOLS: Final = ("tls/", "quic/")
_MEND: Final = "`bootprint keys unpack` brings it"


@dataclass(frozen=True)
class Credentials:
    """The files of one computer; zenoh reads them itself."""

    authority: Path
    certificate: Path
    key: Path

    def check(self) -> None:
        """ConfigError if one is missing or open to others: better now than a connection that is refused."""
        read_secret(self.authority, "authority's certificate", _MEND)
        read_secret(self.certificate, "certificate", _MEND)
        read_secret(self.key, "key", _MEND)


def credentials_in(keys_dir: Path) -> Credentials:
    """Those of the computer whose keys stand in this folder."""
    return Credentials(keys_dir / "ca.crt", keys_dir / "computer.crt", keys_dir / "computer.key")


def is_secure(endpoint: str) -> bool:
    """Whether both ends show certificates at such an endpoint."""
    return endpoint.startswith(SECURE_PROTOCOLS)


def stays_here(endpoint: str) -> bool:
    """Whether nobody outside this computer can reach such an endpoint."""
    return endpoint.startswith(("tcp/127.", "tcp/localhost:", "tcp/[::1]:", "unixsock-stream/"))
