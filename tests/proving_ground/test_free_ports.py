"""Ports of an exercise's own, which nobody else is given meanwhile."""

import socket

import pytest

from proving_ground.exercises.processes.free_ports import free_ports


@pytest.mark.parametrize("kind", [socket.SOCK_STREAM, socket.SOCK_DGRAM])
def test_free_ports_are_none_that_the_system_would_give_to_the_next_who_asks(kind: socket.SocketKind) -> None:
    ports = free_ports(200, kind)
    assert len(set(ports)) == 200
    assert min(ports) > 1024
    assert max(ports) < 32_768
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", ports[0]))
        assert ports[0] not in free_ports(22_000, kind)
