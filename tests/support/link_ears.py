"""What a radio link hands over, waited for as a hub does: by looking again and again."""

from collections import deque
from collections.abc import Callable

from sa_hub.radio.links import Link
from support.waiting import wait_until


class Ears:
    """Gathers the frames of one link, which ``made`` makes of a callback and which is started."""

    def __init__(self, made: Callable[[Callable[[bytes], None]], Link]) -> None:
        self._frames: deque[bytes] = deque()
        self.link = made(self._frames.append)
        self.link.start()

    def get(self) -> bytes:
        """The next frame."""
        wait_until(self._looked, what="a frame")
        return self._frames.popleft()

    def empty(self) -> bool:
        """Whether nothing waits."""
        return not self._looked()

    def _looked(self) -> bool:
        self.link.poll()
        return bool(self._frames)
