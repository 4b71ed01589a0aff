"""Ports of loopback for an exercise's routers, radio nets and page."""

import random
import socket
from itertools import chain, islice
from typing import Final

_OWN_PORTS: Final = (10_000, 32_000)


def free_ports(count: int, kind: socket.SocketKind) -> list[int]:
    """Ports that are free on loopback now, of those that the system gives to nobody who only asks for any.

    A port from the system's own range could go to the next socket that asks before its process has come to bind it.
    """
    first = random.SystemRandom().randrange(*_OWN_PORTS)
    free = (
        port
        for port in chain(range(first, _OWN_PORTS[1]), range(_OWN_PORTS[0], first))
        if is_free(port, kind)
    )
    return list(islice(free, count))


def is_free(port: int, kind: socket.SocketKind) -> bool:
    with socket.socket(socket.AF_INET, kind) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True
