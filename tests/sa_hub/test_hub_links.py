"""UDP links over real loopback sockets: unicast, multicast, and addresses that cannot be used."""

import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from bootprint.errors import ConfigError
from proving_ground.exercises.processes.free_ports import free_ports
from sa_hub.radio.links.udp import UdpLink
from sa_hub.settings import LinkProfile
from support.hub_squad import START_NS, S, Walk, hub, position
from support.link_ears import Ears
from support.waiting import PATIENCE_S

GROUP = "239.255.77.7"


def profile(name: str = "squad", **options: object) -> LinkProfile:
    return LinkProfile(name=name, rate_bits_per_s=1200, **options)  # type: ignore[arg-type]


@pytest.fixture
def opened() -> Iterator[Callable[[LinkProfile], tuple[UdpLink, Ears]]]:
    """Makes running links that are closed in the end."""
    with ExitStack() as stack:

        def make(link_profile: LinkProfile) -> tuple[UdpLink, Ears]:
            ears = Ears(lambda on_frame: UdpLink(link_profile, on_frame))
            assert isinstance(ears.link, UdpLink)
            stack.callback(ears.link.close)
            return ears.link, ears

        yield make


Make = Callable[[LinkProfile], tuple[UdpLink, Ears]]


def test_a_datagram_reaches_every_peer_unchanged(opened: Make) -> None:
    ears = [opened(profile(bind="127.0.0.1:0")) for _ in range(2)]
    mouth, _ = opened(profile(bind="127.0.0.1:0", peers=tuple(f"localhost:{link.port}" for link, _ in ears)))
    for data in (b"\x00\xff one", b"", bytes(1400)):
        mouth.send(data)
        for _, inbox in ears:
            assert inbox.get() == data
    assert mouth.send_faults == 0


def test_a_multicast_group_is_heard_by_all_its_members(opened: Make) -> None:
    (port,) = free_ports(1, socket.SOCK_DGRAM)
    options = {"bind": f"{GROUP}:{port}", "peers": (f"{GROUP}:{port}",), "interface": "127.0.0.1"}
    one, one_hears = opened(profile(**options))
    _, two_hears = opened(profile(**options))
    one.send(b"to all")
    assert two_hears.get() == b"to all"
    assert one_hears.get() == b"to all"  # its own echo, which the hub knows by its sender


def test_a_peer_that_is_not_there_does_no_harm(opened: Make) -> None:
    ear, inbox = opened(profile(bind="127.0.0.1:0"))
    (nobody,) = free_ports(1, socket.SOCK_DGRAM)
    mouth, _ = opened(profile(bind="127.0.0.1:0", peers=(f"127.0.0.1:{nobody}", f"127.0.0.1:{ear.port}")))
    for index in range(3):
        mouth.send(b"%d" % index)
    assert [inbox.get() for _ in range(3)] == [b"0", b"1", b"2"]


def test_what_the_system_refuses_to_send_is_counted(opened: Make) -> None:
    mouth, _ = opened(profile(bind="127.0.0.1:0", peers=("127.0.0.1:9",)))
    mouth.send(bytes(70_000))
    assert mouth.send_faults == 1


def test_closing_twice_frees_the_socket() -> None:
    link = UdpLink(profile(bind="127.0.0.1:0"), lambda data: None)
    link.start()
    link.close()
    link.close()
    with pytest.raises(OSError, match="descriptor"):
        _ = link.port


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"bind": "6970"}, "must be host:port"),
        ({"bind": "127.0.0.1:99999"}, "must be host:port"),
        ({"peers": ("127.0.0.1",)}, "must be host:port"),
        ({"peers": ("no.such.host.invalid:1",)}, "is not known"),
        ({"bind": "192.0.2.1:6970"}, "cannot use 192.0.2.1:6970"),
    ],
)
def test_addresses_that_cannot_be_used_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        UdpLink(profile(**options), lambda data: None)
    assert "'squad'" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_every_peers_copy_is_paid_for() -> None:
    """Real datagrams to three peers, counted where they arrive, against the law of the budget."""
    ears = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(3)]
    with ExitStack() as stack:
        for ear in ears:
            stack.enter_context(ear)
            ear.bind(("127.0.0.1", 0))
            ear.settimeout(PATIENCE_S)
        peers = tuple(f"127.0.0.1:{ear.getsockname()[1]}" for ear in ears)
        link_profile = profile(bind="127.0.0.1:0", peers=peers)
        link = UdpLink(link_profile, lambda data: None)
        stack.callback(link.close)
        core = hub("a1", link_profile)
        air_bytes = 0
        for step in range(600):
            now_ns = START_NS + step * S // 10
            # Turns all the time: there is more to say than three copies' budget allows.
            core.handle(position("a1", now_ns, Walk(speed_m_s=25.0 * (-1) ** step)))
            core.tick(now_ns)
            for frame in core.take_frames():
                link.send(frame.data)
                air_bytes += sum(len(ear.recv(2048)) + link_profile.header_bytes for ear in ears)
            assert 8 * air_bytes <= 1200 * step / 10
        assert 8 * air_bytes > 0.9 * 1200 * 60
        assert core._nets["squad"].meter.bytes_sent == air_bytes
