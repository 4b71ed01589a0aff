"""Where browsers get the basemap: a PMTiles file by ranges of bytes, or an MBTiles file's description and tiles."""

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Final, TypeVar

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

from bootprint.errors import ConfigError
from sa_hub.page import basemap
from sa_hub.page.asking import Refused

T = TypeVar("T")
Check = Callable[[Request], None]
_KEPT: Final = {"cache-control": "private, max-age=3600"}


def basemap_routes(path: Path | None, check: Check) -> list[BaseRoute]:
    """Routes below ``/basemap``; ``check`` raises Refused for whoever may not look on at all."""

    def file_of(request: Request) -> Path:
        check(request)
        if path is None:
            raise Refused(404, "no basemap: want [hub.page] basemap in computer.toml")
        return path

    async def whole(request: Request) -> Response:
        return FileResponse(file_of(request), media_type="application/octet-stream")

    async def description(request: Request) -> Response:
        found = await _read(basemap.tile_json, file_of(request))
        return Response(msgspec.json.encode(found), media_type="application/json")

    async def tile(request: Request) -> Response:
        zoom, column, row = (request.path_params[each] for each in ("zoom", "column", "row"))
        found = await _read(lambda file: basemap.tile(file, zoom, column, row), file_of(request))
        if found is None:
            return Response(status_code=204, headers=_KEPT)  # outside of the area there is nothing to see
        return Response(found.data, media_type=found.media, headers=_KEPT)

    ways: list[tuple[str, Callable[[Request], Awaitable[Response]]]] = [
        ("/basemap", whole),
        ("/basemap/tiles.json", description),
        ("/basemap/{zoom:int}/{column:int}/{row:int}", tile),
    ]
    return [Route(where, answer) for where, answer in ways]


async def _read(read: Callable[[Path], T], path: Path) -> T:
    """From the disk, in a thread that may wait for it."""
    try:
        return await run_in_threadpool(read, path)
    except (ConfigError, OSError) as error:
        raise Refused(503, str(error)) from error
