"""A real router for tests, on a free port of loopback."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager

from bootprint.zenoh_bus import EmbeddedRouter


def free_endpoint() -> str:
    """An endpoint nobody listens at now."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@contextmanager
def running_router(endpoint: str | None = None) -> Iterator[str]:
    """A router's endpoint while it runs."""
    router = EmbeddedRouter(endpoint or free_endpoint())
    try:
        yield router.endpoint
    finally:
        router.close()
