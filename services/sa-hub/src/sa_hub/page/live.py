"""The live side of the page: a WebSocket for each browser, and the beat that tells them all what is new.

Every beat the desk takes in what the hub has said. A browser whose line is still busy with the last telling is left
out and gets everything new at a later beat, so a slow one costs memory for one telling only.
"""

import asyncio
from collections.abc import Callable
from typing import Final

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from sa_hub.page.answers import news
from sa_hub.page.desk import Desk

LIVE_PATH: Final = "/api/v1/live"
_SILENCE_BEATS: Final = 4
"""A telling without news goes out every so many beats: clocks stay right, and a dead line is noticed."""
_SEND_TIMEOUT_S: Final = 20.0


class Browsers:
    """The browsers that look on."""

    def __init__(self, desk: Desk, most: int, updates_per_s: float) -> None:
        self._desk = desk
        self._most = most
        self._beat_s = 1.0 / updates_per_s
        self._beat = asyncio.Condition()
        self._beats = 0
        self._encoder = msgspec.json.Encoder()
        self._told: tuple[tuple[int, int], str] | None = None

    async def run(self) -> None:
        """Beat until cancelled."""
        while True:
            self._desk.catch_up()
            async with self._beat:
                self._beats += 1
                self._beat.notify_all()
            await asyncio.sleep(self._beat_s)

    async def attend(self, socket: WebSocket, still_may: Callable[[], bool]) -> None:
        """Tell one browser until it goes, or ``still_may`` is false; refuse it if there are too many."""
        if self._desk.clients >= self._most:
            await socket.close(1013, "too many browsers")
            return
        self._desk.clients += 1
        await socket.accept()
        listening = asyncio.create_task(_until_gone(socket))
        try:
            await self._tell(socket, listening, still_may)
        finally:
            listening.cancel()
            self._desk.clients -= 1

    async def _tell(
        self, socket: WebSocket, listening: "asyncio.Task[None]", still_may: Callable[[], bool]
    ) -> None:
        revision, told_beat = -1, 0
        while not listening.done() and still_may():
            news_there = self._desk.picture.revision != revision
            if news_there or self._beats - told_beat >= _SILENCE_BEATS:
                told_beat = self._beats
                newest = self._desk.picture.revision
                try:
                    await asyncio.wait_for(socket.send_text(self._telling(revision)), _SEND_TIMEOUT_S)
                except (WebSocketDisconnect, RuntimeError, TimeoutError):
                    return  # it has gone
                revision = newest
            async with self._beat:
                await self._beat.wait()
        if socket.application_state is WebSocketState.CONNECTED and not listening.done():
            await socket.close(4401, "the session is over")

    def _telling(self, revision: int) -> str:
        """What is new since a revision; encoded once for all browsers that have the same."""
        key = revision, self._beats
        if self._told is None or self._told[0] != key:
            self._told = key, self._encoder.encode(news(self._desk, revision)).decode()
        return self._told[1]


async def _until_gone(socket: WebSocket) -> None:
    """Browsers have nothing to say here; what one says is passed over."""
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass
