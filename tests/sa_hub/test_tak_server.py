"""A real TAK server (taky) between our command post and a real TAK client (pytak), plain and with TLS."""

import asyncio
import configparser
import contextlib
import importlib.util
import socket
import subprocess
import sys
import time
import warnings
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, closing
from pathlib import Path

import pytest

from bootprint.bus import Envelope
from bootprint.config import load_computer
from bootprint.display import Ages
from bootprint.foreign import ForeignTrack
from bootprint.messages import Observation, Track
from bootprint.service import Context, Options
from proving_ground.exercises.processes.free_ports import free_ports
from sa_hub.tak.event import CotEvent, from_xml, to_xml
from sa_hub.tak.settings import TakSettings
from sa_hub.tak.sink import TakSink
from support.certificates import write_certificates
from support.hub_processes import CP, write_computer, write_realm
from support.waiting import PATIENCE_S, wait_until

pytestmark = [
    pytest.mark.processes,
    # How pytak sets up TLS.
    pytest.mark.filterwarnings("ignore:ssl.OP_NO:DeprecationWarning", "ignore:Disabled TLS:UserWarning"),
    pytest.mark.skipif(
        not (importlib.util.find_spec("taky") and importlib.util.find_spec("pytak")),
        reason="taky and pytak are not installed: TAK is not tested against a real server",
    ),
]
S = 1_000_000_000


@pytest.fixture(params=["tcp", "tls"])
def server(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """taky; its url."""
    (port,) = free_ports(1, socket.SOCK_STREAM)
    write_certificates(tmp_path)
    (tmp_path / "taky.conf").write_text(
        f"""
[taky]
bind_ip=127.0.0.1
root_dir={tmp_path}
[cot_server]
port={port}
[ssl]
enabled={"true" if request.param == "tls" else "false"}
client_cert_required=true
cert={tmp_path}/server.crt
key={tmp_path}/server.key
ca={tmp_path}/ca.crt
cert_db={tmp_path}/certificates.txt
"""
    )
    (tmp_path / "certificates.txt").touch()
    command = [sys.executable, "-W", "ignore", "-m", "taky.cot", "-c", str(tmp_path / "taky.conf")]
    with (tmp_path / "taky.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)

    def is_up() -> bool:
        assert process.poll() is None, (tmp_path / "taky.log").read_text()
        return answers(port)

    try:
        wait_until(is_up, timeout_s=60.0, what="taky answers")
        yield f"{request.param}://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(timeout=30)


def answers(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), timeout=1).close()
    except OSError:
        return False
    return True


def sink(folder: Path, url: str, announce: Callable[[Envelope], None]) -> TakSink:
    """Our side, as a command post has it."""
    write_realm(folder)
    config = write_computer(
        folder, "cp", 'role = "command_post"', 'bind = "127.0.0.1:0"\npeers = []\nrate_bits_per_s = 9600'
    )
    context = Context("sa-hub", load_computer(config), Options(config=config))
    files = {"ca": "../ca.crt", "cert": "../client.crt", "key": "../client.key"}
    settings = TakSettings(url=url, **(files if url.startswith("tls") else {}))
    return TakSink(context, settings, Ages(75 * S, 180 * S), announce, exercise=True, where="test")


def track() -> Envelope:
    message = Track(
        time_ns=time.time_ns(),
        soldier="a1",
        number=1,
        state="fresh",
        latitude_deg=59.35,
        longitude_deg=18.07,
        height_m=50.0,
        accuracy_m=2.0,
        mode="boots",
    )
    return Envelope(CP.address("track", "a1"), message)


@asynccontextmanager
async def client(folder: Path, url: str, hello: bytes) -> AsyncIterator["asyncio.Queue[bytes]"]:
    """A pytak client at the server that has said who it is, and what it hears."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that aiohttp, which is not needed here, is not there
        import pytak

    config = configparser.ConfigParser()
    config["client"] = {
        "COT_URL": url,
        "PYTAK_TLS_CLIENT_CERT": f"{folder}/client.crt",
        "PYTAK_TLS_CLIENT_KEY": f"{folder}/client.key",
        "PYTAK_TLS_CLIENT_CAFILE": f"{folder}/ca.crt",
        "PYTAK_TLS_DONT_CHECK_HOSTNAME": "1",
    }
    heard: asyncio.Queue[bytes] = asyncio.Queue()
    reader, writer = await pytak.protocol_factory(config["client"])
    await pytak.TXWorker(asyncio.Queue(), config["client"], writer).send_data(hello)
    task = asyncio.create_task(pytak.RXWorker(heard, config["client"], reader).run())
    yield heard
    task.cancel()
    writer.close()
    with contextlib.suppress(OSError, asyncio.CancelledError):
        await writer.wait_closed()


async def exchange(folder: Path, url: str, ours: TakSink, announced: list[Envelope]) -> CotEvent:
    """Our soldier's event as the client gets it; the client's own reach ``announced``."""
    now = time.time_ns() // 1_000_000 * 1_000_000
    details = {"contact": {"callsign": "Bravo"}, "__group": {"name": "Red", "role": "HQ"}, "takv": {}}
    friend = CotEvent(
        "B1", "a-f-G-U-C", "m-g", now, now, now + 60 * S, 59.0, 18.0, 40.0, 5.0, details=details
    )
    marker = CotEvent("m1", "a-h-G-U-C-I", "h-e", now, now, now + 60 * S, 59.1, 18.0, remarks="two men")
    ours.take([])
    async with client(folder, url, to_xml(friend) + to_xml(marker)) as heard:
        deadline = time.monotonic() + 30.0
        event = None
        while event is None or len(announced) < 2:
            assert time.monotonic() < deadline, (event, announced)
            await asyncio.to_thread(ours.take, [track()])
            while event is None and not heard.empty():
                found = from_xml(heard.get_nowait().split(b"?>")[-1].strip())
                event = found if found.uid == "bootprint-bp-a1" else None
            await asyncio.sleep(0.05)
    return event


def test_our_squad_is_seen_and_others_are_heard(server: str, tmp_path: Path) -> None:
    announced: list[Envelope] = []
    with closing(sink(tmp_path, server, announced.append)) as ours:
        event = asyncio.run(exchange(tmp_path, server, ours, announced))
        assert ours.counters()["heard_refused"] == 0
    assert (event.type, event.how) == ("a-f-G-U-C-I", "m-f")
    assert event.detail("contact", "callsign") == "Alpha 1"
    assert event.latitude_deg == pytest.approx(59.35, abs=1e-6)
    assert event.ce_m is not None
    assert 2.0 <= event.ce_m < 5.0
    assert 70 * S < event.stale_ns - event.start_ns <= 76 * S
    friend, marker = (envelope.message for envelope in announced)
    assert isinstance(friend, ForeignTrack)
    assert (friend.callsign, friend.team, friend.affiliation) == ("Bravo", "Red", "friend")
    assert isinstance(marker, Observation)
    assert (marker.code, marker.text) == ("infantry", "two men")


def test_a_server_that_comes_back_is_connected_to_again(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as first:
        port = first.getsockname()[1]
        with closing(sink(tmp_path, f"tcp://127.0.0.1:{port}", lambda _: None)) as ours:
            ours.take([track()])
            accepted, _ = first.accept()
            accepted.settimeout(PATIENCE_S)
            assert b"bootprint-bp-a1" in accepted.recv(4096)
            accepted.close()
            with pytest.raises(OSError, match=r"closed the connection|reset"):
                wait_until(lambda: ours.take([]), what="the broken connection")
            ours.take([])
            again, _ = first.accept()
            again.close()
