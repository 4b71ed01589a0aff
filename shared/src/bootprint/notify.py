"""Tells systemd that a process is ready, and alive: the datagrams of sd_notify(3), nothing where nobody asked."""

import os
import socket


def notify(state: str) -> bool:
    """Send e.g. ``READY=1`` or ``WATCHDOG=1`` to who started us; whether somebody listens."""
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address:
        return False
    if address.startswith("@"):
        address = "\0" + address[1:]
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as channel:
            channel.connect(address)
            channel.sendall(state.encode())
    except OSError:
        return False
    return True
