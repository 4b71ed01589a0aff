"""The page's web application: routes from the table of endpoints, access before each, files, live telling."""

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from bootprint.errors import BootprintError
from sa_hub.page.access import COOKIE, SESSION_S, Access, Principal, Rates
from sa_hub.page.asking import Ask, Fault, Refused, body_of, query_of
from sa_hub.page.basemap_routes import basemap_routes
from sa_hub.page.desk import Desk
from sa_hub.page.endpoints import ENDPOINTS, ROOT, Endpoint
from sa_hub.page.live import LIVE_PATH, Browsers
from sa_hub.page.openapi import openapi
from sa_hub.page.past import Download
from sa_hub.page.settings import PageSettings

STATIC: Final = Path(__file__).parent / "static"
MOST_BYTES: Final = 16_384
_HEADERS: Final = {
    "content-security-policy": (
        "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
        "worker-src 'self' blob:; connect-src 'self' ws: wss:; frame-ancestors 'none'; base-uri 'none'"
    ),
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
}
_NOT_BUILT: Final = (
    "<!doctype html><meta charset=utf-8><title>bootprint</title><body style='font:16px system-ui;margin:4em'>"
    "<h1>The page is not built</h1><p>The hub runs and its interface answers below "
    "<a href='/api/v1/openapi.json'>/api/v1</a>, but the map's files are not there. "
    "Build them with <code>make page</code> (it needs npm packages once) and load this again."
)


class Login(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A token, shown once for a session."""

    token: str


@dataclass(frozen=True)
class Door:
    """Everything that stands before the desk: who may come in, how often."""

    access: Access
    reads: Rates
    changes: Rates

    def principal(self, connection: HTTPConnection) -> Principal | None:
        """Who asks."""
        scheme, _, bearer = connection.headers.get("authorization", "").partition(" ")
        token = bearer.strip() if scheme.lower() == "bearer" else None
        return self.access.who(token, connection.cookies.get(COOKIE), time.monotonic())

    def check_site(self, connection: HTTPConnection) -> None:
        """Refused (403) if another site is behind this."""
        host, origin = connection.headers.get("host", ""), connection.headers.get("origin")
        if not self.access.host_is_ours(host):
            raise Refused(403, f"this page is not called {host!r}: open it as localhost")
        if not self.access.origin_is_ours(origin, host):
            raise Refused(403, f"requests from {origin} are not taken")

    def check_guest(self, connection: HTTPConnection) -> None:
        """Refused for another site, or without a token where one is wanted."""
        self.check_site(connection)
        if self.principal(connection) is None:
            raise Refused(401, "want a token: Authorization: Bearer …")

    def check_role(self, connection: HTTPConnection, endpoint: Endpoint) -> Principal:
        """Who asks; Refused if they may not, or too often."""
        self.check_site(connection)
        principal = self.principal(connection)
        if principal is None:
            raise Refused(401, "want a token: Authorization: Bearer …")
        if not principal.may(endpoint.role):
            raise Refused(403, f"the role {principal.role!r} may not; it takes {endpoint.role!r}")
        rates = self.changes if endpoint.changes else self.reads
        if not rates.allows(f"{principal.name} {client_of(connection)}", time.monotonic()):
            raise Refused(429, "too many requests; wait a moment")
        return principal


def build_app(desk: Desk, settings: PageSettings, static: Path = STATIC) -> ASGIApp:
    """The application around a desk; ``static`` holds the built page."""
    door = Door(Access(settings), Rates(settings.reads_per_s), Rates(settings.changes_per_s))
    browsers = Browsers(desk, settings.most_clients, settings.updates_per_s)

    @asynccontextmanager
    async def lifespan(_app: Starlette) -> AsyncIterator[None]:
        async with _running(browsers):
            yield

    async def live(socket: WebSocket) -> None:
        await _live(socket, door, browsers)

    routes: list[BaseRoute] = [
        *(Route(ROOT + each.path, _route(each, desk, door), methods=[each.method]) for each in ENDPOINTS),
        *_sessions(desk, door),
        Route(f"{ROOT}/openapi.json", _openapi),
        *basemap_routes(desk.basemap, door.check_guest),
        WebSocketRoute(LIVE_PATH, live),
        _page(static),
    ]
    app = Starlette(routes=routes, lifespan=lifespan, exception_handlers={Refused: _refused})
    return Guarded(GZipMiddleware(app, minimum_size=1024, compresslevel=5))


class Guarded:
    """Gives every answer the headers that keep other sites out of the page."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                guards = [(name.encode(), value.encode()) for name, value in _HEADERS.items()]
                message["headers"] = [*message.get("headers", []), *guards]
            await send(message)

        await self._app(scope, receive, send_guarded)


@asynccontextmanager
async def _running(browsers: Browsers) -> AsyncIterator[None]:
    beat = asyncio.create_task(browsers.run())
    try:
        yield
    finally:
        beat.cancel()
        with suppress(asyncio.CancelledError):
            await beat


def client_of(connection: HTTPConnection) -> str:
    """The address that asks."""
    return connection.client.host if connection.client else "unknown"


def _route(endpoint: Endpoint, desk: Desk, door: Door) -> Callable[[Request], Awaitable[Response]]:
    async def answer(request: Request) -> Response:
        desk.catch_up()
        if not endpoint.changes:
            principal = door.check_role(request, endpoint)
            return _answer(await _asked(endpoint, desk, await _ask(endpoint, request, principal)))
        return await _audited(endpoint, desk, door, request)

    return answer


async def _audited(endpoint: Endpoint, desk: Desk, door: Door, request: Request) -> Response:
    """A change: whatever comes of it is noted, refusals too."""
    who, asked, status = "nobody", None, 500
    try:
        principal = door.check_role(request, endpoint)
        who = principal.name
        ask = await _ask(endpoint, request, principal)
        asked = ask.body
        answer = _json(await _asked(endpoint, desk, ask))
        status = answer.status_code
    except Refused as refused:
        status = refused.status
        raise
    else:
        return answer
    finally:
        now_s = desk.post.now_ns() / 1e9
        desk.audit.note(now_s, who, client_of(request), request.url.path, status, asked)


async def _ask(endpoint: Endpoint, request: Request, principal: Principal) -> Ask:
    body = None if endpoint.body is None else body_of(await limited_body(request), endpoint.body)
    query = None if endpoint.query is None else query_of(dict(request.query_params), endpoint.query)
    return Ask(principal, body, query, dict(request.path_params))


async def _asked(endpoint: Endpoint, desk: Desk, ask: Ask) -> Any:
    try:
        if endpoint.slow:
            return await run_in_threadpool(endpoint.handler, desk, ask)
        return endpoint.handler(desk, ask)
    except BootprintError as error:  # the archive is out of reach, or damaged
        raise Refused(503, str(error)) from error


async def limited_body(request: Request) -> bytes:
    """The body; Refused (413, 415) if it is too large or not JSON, which other sites' forms cannot send."""
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        raise Refused(415, "want content-type: application/json")
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > MOST_BYTES:
            raise Refused(413, f"the body is larger than {MOST_BYTES} bytes")
    return bytes(body)


def _sessions(desk: Desk, door: Door) -> list[Route]:
    """Showing a token for a session, and ending it."""

    async def login(request: Request) -> Response:
        door.check_site(request)
        if not door.changes.allows(f"login {client_of(request)}", time.monotonic()):
            raise Refused(429, "too many requests; wait a moment")
        login = body_of(await limited_body(request), Login)
        assert isinstance(login, Login)
        opened = door.access.open_session(login.token, time.monotonic())
        who = "nobody" if opened is None else opened[1].name
        status = 401 if opened is None else 200
        desk.audit.note(desk.post.now_ns() / 1e9, who, client_of(request), request.url.path, status, None)
        if opened is None:
            raise Refused(401, "this token is not known")
        answer = _json({"who": opened[1].name, "role": opened[1].role})
        secure = request.url.scheme == "https"
        answer.set_cookie(
            COOKIE, opened[0], max_age=int(SESSION_S), httponly=True, samesite="strict", secure=secure
        )
        return answer

    async def logout(request: Request) -> Response:
        door.check_site(request)
        door.access.close_session(request.cookies.get(COOKIE))
        answer = _json({})
        answer.delete_cookie(COOKIE)
        return answer

    path = f"{ROOT}/session"
    return [Route(path, login, methods=["POST"]), Route(path, logout, methods=["DELETE"])]


async def _live(socket: WebSocket, door: Door, browsers: Browsers) -> None:
    try:
        door.check_site(socket)
        if door.principal(socket) is None:
            raise Refused(401, "want a token")
    except Refused as refused:
        await socket.close(4000 + refused.status, refused.reason)
        return
    await browsers.attend(socket, lambda: door.principal(socket) is not None)


async def _openapi(_request: Request) -> Response:
    return _json(openapi())


def _page(static: Path) -> BaseRoute:
    if (static / "index.html").is_file():
        return Mount("/", StaticFiles(directory=static, html=True))
    return Route("/", _not_built)


async def _not_built(_request: Request) -> Response:
    return HTMLResponse(_NOT_BUILT, status_code=503)


async def _refused(_request: Request, error: Exception) -> Response:
    assert isinstance(error, Refused)
    headers = {"www-authenticate": "Bearer"} if error.status == 401 else None
    return Response(
        msgspec.json.encode(Fault(error.reason)), error.status, headers, media_type="application/json"
    )


def _answer(value: Any) -> Response:
    if isinstance(value, Download):
        remove = BackgroundTask(value.path.unlink, missing_ok=True)
        return FileResponse(value.path, filename=value.name, background=remove)
    return _json(value)


def _json(value: Any) -> Response:
    return Response(
        msgspec.json.encode(value), media_type="application/json", headers={"cache-control": "no-store"}
    )
