"""The page's server: uvicorn in a thread of its own, so that no browser can hold up the hub."""

import asyncio
import socket
import ssl
import threading
from pathlib import Path
from typing import Final

import uvicorn
from starlette.types import ASGIApp

from bootprint.errors import ConfigError
from sa_hub.page.settings import PageSettings

_START_S: Final = 10.0
_STOP_S: Final = 5.0
_MOST_MESSAGE: Final = 4096


class PageServer:
    """Serves an application until closed. ``address`` is where browsers find it."""

    def __init__(self, app: ASGIApp, settings: PageSettings, folder: Path, where: str) -> None:
        self._socket = _bound(settings, where)
        scheme = "http" if settings.tls_certificate is None else "https"
        host = f"[{settings.host}]" if ":" in settings.host else settings.host
        self.port: int = self._socket.getsockname()[1]
        self.address = f"{scheme}://{host}:{self.port}/"
        self._server = uvicorn.Server(_config(app, settings, folder, where))
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)

    def start(self) -> None:
        """Begin to serve; connections that come before it is up wait in the socket."""
        self._socket.listen(128)
        self._thread.start()

    def close(self) -> None:
        """Tell the browsers goodbye and stop."""
        self._server.should_exit = True
        if self._thread.ident is not None:
            self._thread.join(_STOP_S)
        self._socket.close()

    def _run(self) -> None:
        asyncio.run(self._server.serve(sockets=[self._socket]))


def _bound(settings: PageSettings, where: str) -> socket.socket:
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    bound = socket.socket(family, socket.SOCK_STREAM)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind((settings.host, settings.port))
    except OSError as error:
        bound.close()
        raise ConfigError(
            f"{where}: cannot serve at {settings.host}:{settings.port}: {error.strerror or error}; "
            "want an address of this computer and a port that is free (0: any)"
        ) from error
    return bound


def _config(app: ASGIApp, settings: PageSettings, folder: Path, where: str) -> uvicorn.Config:
    certificate = settings.tls_certificate
    config = uvicorn.Config(
        app,
        log_config=None,
        access_log=False,
        server_header=False,
        ws="websockets-sansio",
        ws_max_size=_MOST_MESSAGE,
        timeout_graceful_shutdown=1,
        ssl_certfile=None if certificate is None else str(folder / certificate),
        ssl_keyfile=None if settings.tls_key is None else str(folder / settings.tls_key),
    )
    try:
        config.load()
    except (ssl.SSLError, OSError) as error:
        raise ConfigError(f"{where}: certificate and key do not load: {error}") from error
    return config
