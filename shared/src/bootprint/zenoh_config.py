"""Zenoh's own configuration, as plain tables: for sessions of this house, and for a router that it does not run."""

from collections.abc import Sequence
from typing import Any

from bootprint.keys.credentials import Credentials

Table = dict[str, Any]


def client_settings(router: str, credentials: Credentials | None = None) -> Table:
    """A client of one router, that looks for no other."""
    connect = {
        "endpoints": [router],
        "timeout_ms": 0,
        "exit_on_failure": True,
        "retry": {"period_init_ms": 200, "period_max_ms": 500, "period_increase_factor": 2},
    }
    return {
        "mode": "client",
        "connect": connect,
        "listen": {"endpoints": []},
        **_common(credentials),
    }


def router_settings(
    listen: Sequence[str],
    connect: Sequence[str] = (),
    credentials: Credentials | None = None,
    access_control: Table | None = None,
) -> Table:
    """A router; ``connect``: others that it joins as soon as they are there, however long that takes."""
    joined: Table = {"endpoints": list(connect), "timeout_ms": -1, "exit_on_failure": False}
    return {
        "mode": "router",
        "listen": {"endpoints": list(listen)},
        **({"connect": joined} if connect else {}),
        **({"access_control": access_control} if access_control else {}),
        **_common(credentials),
    }


def _common(credentials: Credentials | None) -> Table:
    transport: Table = {"shared_memory": {"enabled": False}}
    if credentials is not None:
        transport["link"] = {"tls": _tls(credentials)}
    return {
        # A router that looks for nobody need not wait for answers (`delay`, half a second) before it routes.
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}, "delay": 0},
        "transport": transport,
    }


def _tls(credentials: Credentials) -> Table:
    """Both ends show a certificate of the realm's authority, the server one for the name it was called by."""
    certificate, key = str(credentials.certificate), str(credentials.key)
    return {
        "root_ca_certificate": str(credentials.authority),
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
    }
