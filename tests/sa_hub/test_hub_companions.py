"""What accompanies a hub: the worker that runs it, and a real command post with all of it."""

import queue
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import msgspec
import pynmeagps
import pytest
from pymavlink.dialects.v20 import common as mavlink

from bootprint.bus import Envelope
from bootprint.config import load_computer
from bootprint.errors import ConfigError
from bootprint.foreign import ForeignTrack
from bootprint.messages import Alert, Message, Observation, Position
from bootprint.service import Context, Options
from sa_hub.companions.worker import Promise, Worker
from sa_hub.history.archive import Archive
from sa_hub.main import build
from sa_hub.tak.event import CotEvent, from_xml, to_xml
from support.hub_processes import CP, running, write_computer, write_realm
from support.hub_squad import START_NS, S, Walk, position
from support.waiting import wait_until


class Sink:
    """Takes what it is given, unless it is told to fail or to wait."""

    name = "sink"
    interval_s = 0.01
    most = 3

    def __init__(self, *, keeps: bool, failures: int = 0) -> None:
        self.keeps = keeps
        self.failures = failures
        self.batches: list[list[Envelope]] = []
        self.may_go = threading.Event()
        self.may_go.set()
        self.closed = False

    def wants(self, envelope: Envelope) -> bool:
        return envelope.message.time_ns >= 0

    def take(self, envelopes: list[Envelope]) -> None:
        self.may_go.wait()
        if envelopes and self.failures:
            self.failures -= 1
            raise OSError("no room")
        self.batches.append(envelopes)

    def counters(self) -> dict[str, int]:
        return {"own": 7}

    def close(self) -> None:
        self.closed = True

    @property
    def taken(self) -> list[int]:
        return [envelope.message.time_ns for batch in self.batches for envelope in batch]


def alerts(*times_ns: int) -> list[Envelope]:
    address = CP.address("alert", "person")
    return [Envelope(address, Alert(time_ns=each, soldier="cp", kind="help")) for each in times_ns]


def test_all_is_taken_in_order_in_bounded_batches() -> None:
    sink = Sink(keeps=False)
    worker = Worker(sink)
    worker.tell(alerts(*range(-2, 8)))
    worker.start()
    worker.close()
    assert sink.taken == list(range(8))
    assert max(map(len, sink.batches)) == 3
    assert sink.closed
    assert worker.figures().counters == {"sink_taken": 8, "sink_dropped": 0, "sink_faults": 0, "sink_own": 7}


@pytest.mark.parametrize(("keeps", "taken"), [(True, [1, 2, 3, 4]), (False, [4])])
def test_what_failed_is_tried_again_only_where_it_is_to_be_kept(
    keeps: bool, taken: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sa_hub.companions.worker._RETRY_S", 0.01)
    sink = Sink(keeps=keeps, failures=1)
    worker = Worker(sink)
    worker.tell(alerts(1, 2, 3))
    worker.start()
    wait_until(lambda: worker.figures().counters["sink_faults"] == 1, what="the fault")
    worker.tell(alerts(4))
    wait_until(lambda: sink.taken[-1:] == [4], what="the last one")
    worker.close()
    assert sink.taken == taken
    assert worker.figures().state == "ok"


def test_a_slow_sink_holds_nobody_up_and_what_is_lost_is_counted() -> None:
    sink = Sink(keeps=True)
    sink.may_go.clear()
    worker = Worker(sink, capacity=5)
    worker.tell(alerts(*range(9)))
    worker.start()
    assert worker.figures().counters["sink_dropped"] == 4
    sink.may_go.set()
    worker.close()
    assert sink.taken == [0, 1, 2, 3, 4]


def test_a_bug_in_a_sink_is_told_and_survived() -> None:
    sink = Sink(keeps=True)
    sink.failures = "many"  # type: ignore[assignment]
    worker = Worker(sink)
    worker.tell(alerts(1))
    worker.start()
    wait_until(lambda: worker.figures().counters["sink_faults"] == 1, what="the fault")
    assert worker.figures().note == "sink: a fault of the program, see the log"
    worker.close()


def test_a_promise_is_kept_when_all_that_was_entrusted_is_and_not_before() -> None:
    sink = Sink(keeps=True)
    sink.may_go.clear()
    worker = Worker(sink)
    worker.start()
    fate = worker.entrust(alerts(1, 2))
    assert worker.entrust(alerts(-1))() == "kept", "the sink does not want it"
    assert fate() == "waiting"
    sink.may_go.set()
    wait_until(lambda: fate() == "kept", what="the promise")
    assert sink.taken == [1, 2]
    worker.close()


def test_what_fails_finds_no_room_or_is_given_up_is_not_kept() -> None:
    sink = Sink(keeps=True, failures=1)
    worker = Worker(sink, capacity=2)
    worker.start()
    failing = worker.entrust(alerts(1))
    wait_until(lambda: failing() != "waiting", what="the fault")
    assert failing() == "unkept"
    assert worker.entrust(alerts(2, 3, 4))() == "unkept", "one found the queue full"
    wait_until(lambda: failing() == "kept", what="the next attempt")
    wait_until(lambda: sink.taken[:3] == [1, 2, 3], what="what had room")
    sink.failures = "many"  # type: ignore[assignment]
    broken = worker.entrust(alerts(5))
    wait_until(lambda: worker.figures().counters["sink_faults"] == 2, what="the fault of the program")
    sink.failures = 0
    after = worker.entrust(alerts(6))
    wait_until(lambda: after() == "kept", what="the one after it")
    assert broken() == "unkept"
    worker.close()


def test_who_keeps_nothing_need_not_be_waited_for() -> None:
    worker = Worker(Sink(keeps=False), capacity=1)
    assert worker.entrust(alerts(1, 2))() == "kept"


def test_a_promise_to_one_is_not_kept_by_what_another_tells(monkeypatch: pytest.MonkeyPatch) -> None:
    laid, go_on = threading.Event(), threading.Event()

    class Gate(queue.Queue[Envelope]):
        """Whoever lays the first envelope stands still behind it."""

        def put_nowait(self, item: Envelope) -> None:
            super().put_nowait(item)
            if not laid.is_set():
                laid.set()
                go_on.wait()

    class OneByOne(Sink):
        most, begun, turns = 1, 0, threading.Semaphore(0)

        def take(self, envelopes: list[Envelope]) -> None:
            if envelopes:
                self.begun += 1
                self.turns.acquire()

    monkeypatch.setattr(queue, "Queue", Gate)
    sink = OneByOne(keeps=True)
    worker = Worker(sink)
    monkeypatch.undo()
    promises: list[Promise] = []
    other = threading.Thread(target=lambda: worker.tell(alerts(1)))
    teller = threading.Thread(target=lambda: promises.append(worker.entrust(alerts(2))))
    other.start()
    laid.wait()
    teller.start()
    teller.join(0.3)  # it may have to wait for the other
    go_on.set()
    for thread in (other, teller):
        thread.join()
    worker.start()
    sink.turns.release()
    wait_until(lambda: sink.begun == 2, what="the second one's turn")
    assert promises[0]() == "waiting", "only the other's is kept"
    sink.turns.release()
    wait_until(lambda: promises[0]() == "kept", what="the promise")
    worker.close()


# -- a real hub ---------------------------------------------------------------------------------------------------

LINK = 'bind = "127.0.0.1:0"\npeers = ["127.0.0.1:9"]\nrate_bits_per_s = 9600'


@pytest.fixture
def ears() -> Iterator[dict[str, socket.socket]]:
    """A socket for each output."""
    made = {name: socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for name in ("tak", "mavlink", "nmea")}
    for each in made.values():
        each.bind(("127.0.0.1", 0))
        each.settimeout(30.0)
    yield made
    for each in made.values():
        each.close()


@pytest.mark.processes
def test_a_command_post_keeps_its_history_and_tells_others(
    tmp_path: Path, ears: dict[str, socket.socket]
) -> None:
    ports = {name: each.getsockname()[1] for name, each in ears.items()}
    hub = (
        'role = "command_post"\nexercise = true\nhistory = {}\n'
        f'tak = {{ url = "udp://127.0.0.1:{ports["tak"]}" }}\n'
        f'mavlink_out = {{ to = ["127.0.0.1:{ports["mavlink"]}"], interval_s = 0.2 }}\n'
        f'nmea = {{ to = ["udp:127.0.0.1:{ports["nmea"]}"], interval_s = 0.2 }}\n'
    )
    write_realm(tmp_path)
    config = write_computer(tmp_path, "cp", hub, LINK)
    heard: list[Message] = []
    url = f"sqlite:///{config.parent}/state/history.db"
    with running(config, CP) as post:
        for subject in ("foreign_track", "observation"):
            post.bus.subscribe(CP.selector(subject), lambda envelope: heard.append(envelope.message))
        template = position("cp", START_NS, Walk()).message
        assert isinstance(template, Position)
        now = msgspec.structs.replace(template, time_ns=time.time_ns(), mode="gnss")

        def tell() -> bool:
            post.bus.publish(Envelope(CP.address("position", "fusion"), now))
            return bool(post.tracks)

        wait_until(tell, what="the own track")
        datagram, sender = ears["tak"].recvfrom(65_536)
        event = from_xml(datagram)
        assert (event.uid, event.how, event.opex) == ("bootprint-bp-cp", "m-g", "e-bp")
        gga = pynmeagps.NMEAReader.parse(ears["nmea"].recv(4096).split(b"\r\n")[0] + b"\r\n")
        assert (gga.msgID, gga.quality) == ("GGA", 1)
        assert gga.lat == pytest.approx(template.latitude_deg, abs=1e-6)
        frames = mavlink.MAVLink(None).parse_buffer(bytearray(ears["mavlink"].recv(4096)))
        assert [frame.get_srcSystem() for frame in frames] == [100]
        stamp = now.time_ns
        friend = CotEvent("B1", "a-f-G-U-C", "m-g", stamp, stamp, stamp + 60 * S, 59.0, 18.0)
        marker = CotEvent("m1", "a-h-G-U-C-I", "h-e", stamp, stamp, stamp + 60 * S, 59.1, 18.0)
        for each in (to_xml(friend), to_xml(marker), b"<event"):
            ears["tak"].sendto(each, sender)
        wait_until(lambda: len(heard) == 2, what="a foreign track and an observation")
        wait_until(
            lambda: any(each.counters.get("tak_heard_refused") == 1 for each in post.health),
            what="the count of what was refused",
        )
        with closing(Archive(url, create=False)) as archive:
            wait_until(
                lambda: archive.count("foreign_track", 0, 2**62) == 1, what="the friend in the archive"
            )
        wait_until(lambda: any(each.counters["history_taken"] > 3 for each in post.health), what="the count")
    assert {type(each) for each in heard} == {ForeignTrack, Observation}
    with closing(Archive(url, create=False)) as archive:
        assert [each.message for each in archive.picture_at(2**62)] == post.tracks[-1:]
        assert archive.count("observation", 0, 2**62) == 1
        assert archive.count("health", 0, 2**62) > 0


def test_only_a_command_post_has_history_tak_and_a_ground_station(tmp_path: Path) -> None:
    write_realm(tmp_path)
    config = write_computer(tmp_path, "a1", "history = {}", LINK)
    context = Context("sa-hub", load_computer(config), Options(config=config))
    with pytest.raises(ConfigError, match=r"\[hub.history\]: only a command_post has one"):
        build(context)


def test_what_is_not_configured_costs_no_memory() -> None:
    code = "import sys, sa_hub.main, sa_hub.commands; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    heavy = {"sqlalchemy", "psycopg", "pymavlink", "takproto", "google.protobuf", "xml.etree"}
    assert heavy.isdisjoint(loaded.split())
