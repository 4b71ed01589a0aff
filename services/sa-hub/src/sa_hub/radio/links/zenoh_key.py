"""Frames over zenoh, where there is bandwidth: all of a net are clients of one router and share a key.

The key ``{realm}/@air1/{net}/{number}`` is no topic: selectors of the bus do not match it, so a picture never leaks
past the seal. The session is opened, and after a loss opened again, in a thread of its own.
"""

import contextlib
import threading
from collections.abc import Callable
from typing import Final

from bootprint.errors import BusError
from bootprint.keys.credentials import Credentials
from bootprint.topics import FRAMES
from bootprint.zenoh_bus import ZenohBus, open_bus
from sa_hub.radio.link_profile import LinkProfile

_PATIENCE_S: Final = 2.0


class ZenohLink:
    """One session at the net's router. ``realm`` and ``number`` are ours."""

    def __init__(
        self,
        profile: LinkProfile,
        on_frame: Callable[[bytes], None],
        realm: str,
        number: int,
        credentials: Credentials | None,
    ) -> None:
        assert profile.router is not None
        self.name = profile.name
        self.send_faults = 0
        self.garbled = 0  # zenoh gives whole messages
        self._router = profile.router
        self._credentials = credentials
        self._on_frame = on_frame
        self._net = f"{realm}/{FRAMES}/{profile.name}"
        self._own_key = f"{self._net}/{number}"
        self._bus: ZenohBus | None = None
        self._put: Callable[[bytes], None] | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._open, name=f"link {profile.name}", daemon=True)

    @property
    def busy(self) -> bool:
        """Whether the router is not there; zenoh looks for it by itself."""
        return self._bus is None or self._put is None or not self._bus.is_connected()

    @property
    def fault(self) -> str:
        """That the router is not there."""
        return f"no router at {self._router}" if self.busy else ""

    def start(self) -> None:
        """Look for the router until it is there."""
        self._thread.start()

    def poll(self) -> None:
        """Nothing to do: the link's thread hands over what arrives."""

    def send(self, data: bytes) -> None:
        """Put one frame on the net's key."""
        try:
            if self._put is None:
                raise BusError("not connected")
            self._put(data)
        except BusError:
            self.send_faults += 1

    def close(self) -> None:
        """Close the session."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()
        if self._bus is not None:
            self._bus.close()

    def _open(self) -> None:
        while self._bus is None and not self._stopping.is_set():
            with contextlib.suppress(BusError):
                self._bus = open_bus(
                    self._router,
                    credentials=self._credentials,
                    timeout_s=_PATIENCE_S,
                    should_stop=self._stopping.is_set,
                )
        if self._bus is not None:
            self._bus.subscribe_raw(f"{self._net}/*", self._arrived)
            self._put = self._bus.raw_publisher(self._own_key)

    def _arrived(self, key: str, payload: bytes) -> None:
        if key != self._own_key:
            self._on_frame(payload)
