"""The ``[hub.page]`` section: where the command post's page is served, what lies under its map, who may do what.

.. code-block:: toml

    [hub.page]                      # its presence turns the page on (role = "command_post" only)
    host = "127.0.0.1"              # any other address needs TLS and tokens
    port = 8080
    plan = "plan.geojson"           # buildings: properties.kind and .floor, as exercises have them
    basemap = "area.pmtiles"        # or an MBTiles file; raster or vector tiles

    [[hub.page.tokens]]             # made by `bootprint page token`
    name = "watch officer"
    role = "operate"
    sha256 = "…"
"""

import ipaddress
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec

from bootprint.config import Config
from bootprint.errors import ConfigError
from sa_hub.page.basemap import kind_of

Role = Literal["view", "operate", "admin"]
ROLES: Final[tuple[Role, ...]] = ("view", "operate", "admin")
"""In rising order: each may do what those before it may."""


class Token(Config, frozen=True):
    """Who comes with a token, known by its digest alone, and what they may do."""

    name: Annotated[str, msgspec.Meta(min_length=1, max_length=64)]
    role: Role
    sha256: Annotated[str, msgspec.Meta(pattern="^[0-9a-f]{64}$")]


class PageSettings(Config, frozen=True):
    """Where and to whom the page is served, and how often it tells browsers what is new (host time)."""

    enabled: bool = True
    host: str = "127.0.0.1"
    port: Annotated[int, msgspec.Meta(ge=0, le=65535)] = 8080
    plan: str | None = None
    basemap: str | None = None
    tls_certificate: str | None = None
    tls_key: str | None = None
    tokens: tuple[Token, ...] = ()
    updates_per_s: Annotated[float, msgspec.Meta(ge=1.0, le=5.0)] = 4.0
    changes_per_s: Annotated[float, msgspec.Meta(gt=0.0)] = 5.0
    reads_per_s: Annotated[float, msgspec.Meta(gt=0.0)] = 50.0
    most_clients: Annotated[int, msgspec.Meta(ge=1)] = 32

    @property
    def is_local(self) -> bool:
        """Whether only this computer can reach the page."""
        return is_loopback(self.host)


def is_loopback(host: str) -> bool:
    """Whether a host name or address means this computer."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def check_page(settings: PageSettings, folder: Path, where: str) -> None:
    """ConfigError if the page would be open to others without TLS and tokens, or a file of it is not there."""
    if (settings.tls_certificate is None) != (settings.tls_key is None):
        raise ConfigError(f"{where}: tls_certificate and tls_key belong together; give both or none")
    if not settings.is_local and (settings.tls_certificate is None or not settings.tokens):
        raise ConfigError(
            f"{where}: host {settings.host!r} can be reached by others: "
            "want tls_certificate, tls_key and at least one [[hub.page.tokens]]"
        )
    for key in ("plan", "basemap", "tls_certificate", "tls_key"):
        name: str | None = getattr(settings, key)
        if name is not None and not (folder / name).is_file():
            raise ConfigError(f"{where}.{key}: {folder / name}: no such file")
    if settings.basemap is not None:
        kind_of(folder / settings.basemap)
