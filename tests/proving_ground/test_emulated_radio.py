"""The emulated radio net over real sockets."""

import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from proving_ground.exercises.processes.emulated_radio import Air, EmulatedNet, NetProfile
from support.waiting import PATIENCE_S, wait_until

FAST = NetProfile("test", rate_bits_per_s=1e6, latency_s=0.0)


@contextmanager
def on_air(
    profile: NetProfile, members: int, speed: float = 1.0
) -> Iterator[tuple[EmulatedNet, list[socket.socket]]]:
    """A running net and its members' sockets."""
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(members)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
        each.settimeout(PATIENCE_S)
    net = EmulatedNet(profile, {f"m{n}": each.getsockname()[1] for n, each in enumerate(sockets)}, speed)
    net.start()
    try:
        yield net, sockets
    finally:
        net.close()
        for each in sockets:
            each.close()


def test_all_but_the_sender_hear_a_datagram() -> None:
    with on_air(FAST, 4) as (net, members):
        members[1].sendto(b"contact", ("127.0.0.1", net.port))
        for hearer in (0, 2, 3):
            assert members[hearer].recv(100) == b"contact"
        wait_until(lambda: net.counts.delivered == 3)
        members[1].setblocking(False)
        try:
            members[1].recv(100)
            raise AssertionError("the sender heard itself")
        except BlockingIOError:
            pass


def test_the_channel_carries_no_more_than_its_rate() -> None:
    profile = NetProfile("slow", rate_bits_per_s=8000.0, latency_s=0.0, header_bytes=20)
    with on_air(profile, 2, speed=4.0) as (net, (sender, hearer)):
        before = time.monotonic()
        for _ in range(10):
            sender.sendto(b"x" * 80, ("127.0.0.1", net.port))
        for _ in range(10):
            hearer.recv(100)
        # Ten frames of 100 bytes are one second of air, a quarter of that at four times the speed.
        assert time.monotonic() - before >= 0.25
        assert net.counts.bytes == 1000


def test_loss_is_counted_and_as_large_as_asked() -> None:
    lossy = NetProfile("lossy", rate_bits_per_s=1e9, latency_s=0.0, loss=0.3, seed=5)
    with on_air(lossy, 2) as (net, (sender, _)):
        for sent in range(1, 1001):
            sender.sendto(b"x", ("127.0.0.1", net.port))
            wait_until(lambda sent=sent: net.counts.delivered + net.counts.lost == sent)
        share = net.counts.lost / net.counts.datagrams
        assert 0.25 < share < 0.35


def test_a_member_that_left_does_not_disturb_the_others() -> None:
    with on_air(FAST, 3) as (net, members):
        members[2].close()
        for n in range(20):
            members[0].sendto(b"%d" % n, ("127.0.0.1", net.port))
        assert [members[1].recv(10) for _ in range(20)] == [b"%d" % n for n in range(20)]


def test_a_named_radios_key_up_takes_its_time_on_the_air() -> None:
    """VHF at 1.2 kbit/s: 0.3 s of key-up, then 8 + 22 bytes take 0.2 s; after 0.2 s more everyone has heard."""
    air = Air(NetProfile.of_radio("vhf", "vhf-1200"), ["a", "b"], zero_s=0.0)
    air.transmit("a", bytes(22), 1.0)
    air.transmit("b", bytes(22), 1.0)
    assert [delivery.due_s for delivery in air.arrived(10.0)] == pytest.approx([1.7, 2.2])
    assert air.counts.bytes == 2 * (45 + 30)


def test_a_nets_own_figures_go_before_the_radios() -> None:
    own = NetProfile.of_radio(
        "net", "vhf-2400", rate_bits_per_s=1200.0, header_bytes=0, latency_s=None, loss=0.1
    )
    assert (own.rate_bits_per_s, own.header_bytes, own.latency_s, own.loss) == (1200.0, 0, 0.2, 0.1)
    assert own.medium.air_bytes(20) == 45 + 20
    assert NetProfile.of_radio("net", None) == NetProfile("net", 9600.0, latency_s=0.05, header_bytes=28)
