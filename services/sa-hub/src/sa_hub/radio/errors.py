"""What can be wrong with bytes from the air; every fault has a short cause under which it is counted."""


class FrameError(Exception):
    """Bytes from the air are no frame, or not one for us. ``cause`` names the counter it belongs to."""

    def __init__(self, cause: str, detail: str) -> None:
        super().__init__(f"{cause}: {detail}")
        self.cause = cause
