"""Ways for a frame to leave this computer; each gives whole frames, unchanged or not at all."""

from typing import Protocol


class Link(Protocol):
    """One way out and in. Frames that arrive are handed to a callback: by `poll`, or by a thread of the link's own.

    Where the system keeps what arrives, nobody is woken for it: a picture is as good a tenth of a second later, and
    on a busy net wake-ups would cost more than all frames.
    """

    name: str
    send_faults: int
    """Frames that were to go and did not."""

    @property
    def garbled(self) -> int:
        """Pieces that came in and were no frame."""

    @property
    def busy(self) -> bool:
        """Whether a frame cannot go now: the last one is still leaving, somebody speaks, or the way is gone."""

    @property
    def fault(self) -> str:
        """What is wrong with the way, empty if nothing is; it mends by itself when the way is back."""

    def start(self) -> None:
        """Begin to receive."""

    def poll(self) -> None:
        """Hand over what has arrived, if no thread does."""

    def send(self, data: bytes) -> None:
        """Send one frame, without waiting; what cannot go is lost and counted, as on the air."""

    def close(self) -> None:
        """Stop receiving and free everything; safe to call twice."""
