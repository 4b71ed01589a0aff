"""The zenoh bus against a real router in this process."""

import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from bootprint import wire, zenoh_bus
from bootprint.bus import Envelope
from bootprint.errors import BusError
from bootprint.messages import FootStep, Health, ImuBatch, Pressure
from bootprint.topics import BY_SUBJECT, Identity
from bootprint.zenoh_bus import EmbeddedRouter, open_bus
from support.routers import free_endpoint, running_router
from support.waiting import wait_until

A1 = Identity("bp", "alpha", "a1")


def pressure(sequence: int) -> Envelope:
    message = Pressure(time_ns=sequence, sequence=sequence, pressure_pa=101_325.0 + sequence)
    return Envelope(A1.address("pressure", "baro"), message)


def step(sequence: int) -> Envelope:
    message = FootStep(
        time_ns=sequence,
        sequence=sequence,
        start_time_ns=sequence - 1,
        displacement_m=(1.0, 0.0, 0.0),
        heading_change_rad=0.0,
        covariance=(0.0,) * 10,
    )
    return Envelope(A1.address("foot_step", "left_foot"), message)


def batch(number: int) -> Envelope:
    times = np.array([number], dtype=np.int64)
    samples = np.zeros((1, 3))
    return Envelope(A1.address("imu", "left_foot"), ImuBatch.from_arrays(number, times, samples, samples))


def test_messages_arrive_in_order_and_typed() -> None:
    with running_router() as router:
        sender, receiver = open_bus(router), open_bus(router)
        heard: list[Envelope] = []
        receiver.subscribe(A1.selector("pressure"), heard.append)
        sent = [pressure(n) for n in range(200)]
        wait_until(lambda: (sender.publish(pressure(0)), heard)[1], what="the subscription stands")
        wait_until(lambda: heard[-1] == pressure(0))
        heard.clear()
        for envelope in sent:
            sender.publish(envelope)
        wait_until(lambda: sent[-1] in heard, what="the last message")
        assert [e for e in heard if e.message.sequence > 0] == sent[1:]
        sender.close()
        receiver.close()


def test_late_subscriber_gets_missed_events_and_newest_state_but_no_old_samples() -> None:
    with running_router() as router:
        sender, witness, late = open_bus(router), open_bus(router), open_bus(router)
        seen: list[Envelope] = []
        witness.subscribe(A1.selector("health"), seen.append)
        for n in range(1, 6):
            sender.publish(step(n))
            sender.publish(pressure(n))
            sender.publish(
                Envelope(A1.address("health", "x"), Health(time_ns=n, sequence=n, service="x", state="ok"))
            )
        wait_until(
            lambda: seen and seen[-1].message.sequence == 5, what="the router has passed everything on"
        )
        heard: list[Envelope] = []
        for subject in ("foot_step", "pressure", "health"):
            late.subscribe(A1.selector(subject), heard.append)
        wait_until(lambda: len(heard) >= 6, what="five steps and one state")
        sender.publish(pressure(99))
        wait_until(lambda: pressure(99) in heard, what="a fresh sample")
        subjects = [e.address.subject for e in heard]
        assert subjects.count("foot_step") == 5
        assert subjects.count("health") == 1
        assert subjects.count("pressure") == 1
        for bus in (sender, witness, late):
            bus.close()


def test_events_survive_a_router_that_is_replaced() -> None:
    endpoint = free_endpoint()
    router = EmbeddedRouter(endpoint)
    sender, receiver = open_bus(endpoint), open_bus(endpoint)
    heard: list[int] = []
    receiver.subscribe(A1.selector("foot_step"), lambda e: heard.append(e.message.sequence))
    sender.publish(step(1))
    wait_until(lambda: 1 in heard)
    router.close()
    for n in (2, 3, 4):
        sender.publish(step(n))
    router = EmbeddedRouter(endpoint)
    wait_until(lambda: sender.is_connected() and receiver.is_connected(), what="both found the new router")
    sender.publish(step(5))
    wait_until(lambda: set(heard) >= {1, 2, 3, 4, 5}, timeout_s=30.0, what="steps sent while no router ran")
    sender.close()
    receiver.close()
    router.close()


def test_inertial_samples_that_no_router_carried_come_later_and_in_order() -> None:
    endpoint = free_endpoint()
    router = EmbeddedRouter(endpoint)
    sender, receiver = open_bus(endpoint), open_bus(endpoint)
    heard: list[int] = []
    receiver.subscribe(A1.selector("imu"), lambda e: heard.append(e.message.sequence))
    sender.publish(batch(1))
    wait_until(lambda: 1 in heard)
    router.close()
    for n in range(2, 60):
        sender.publish(batch(n))
    router = EmbeddedRouter(endpoint)
    numbers = iter(range(60, 10_000))
    wait_until(lambda: sender.publish(batch(next(numbers))) or len(heard) > 60, timeout_s=30.0)
    assert heard == list(range(1, len(heard) + 1))
    sender.close()
    receiver.close()
    router.close()


def test_garbage_on_a_key_is_counted_and_survived() -> None:
    with running_router() as router:
        sender, receiver = open_bus(router), open_bus(router)
        heard: list[Envelope] = []
        receiver.subscribe(A1.selector("pressure"), heard.append)
        raw: list[tuple[str, bytes]] = []
        receiver.subscribe_raw("bp/@v1/**", lambda key, payload: raw.append((key, payload)))
        key = A1.address("pressure", "baro").key
        wait_until(lambda: (sender._session.put(key, b"\xc1 not msgpack"), receiver.rejected)[1])
        sender.publish(pressure(7))
        wait_until(lambda: pressure(7) in heard)
        assert (key, b"\xc1 not msgpack") in raw
        sender.close()
        receiver.close()


def test_an_inlet_keeps_messages_until_they_are_taken() -> None:
    with running_router() as router:
        sender, receiver = open_bus(router), open_bus(router)
        inlet = receiver.open_inlet(A1.selector("foot_step"))
        garbage_key = "bp/@v1/alpha/a1/nonsense/x"
        garbage = receiver.open_inlet(garbage_key)
        for n in range(1, 21):
            sender.publish(step(n))
        taken: list[Envelope] = []
        wait_until(lambda: (taken.extend(inlet.take()), len(taken) >= 20)[1], what="twenty steps")
        assert taken == [step(n) for n in range(1, 21)]
        assert list(inlet.take()) == []
        wait_until(
            lambda: (sender._session.put(garbage_key, b"\xff"), list(garbage.take()), receiver.rejected)[2],
            what="the garbage counted",
        )
        assert receiver.overruns == 0
        sender.close()
        receiver.close()


def test_an_inlet_rings_for_what_has_come_and_keeps_it() -> None:
    with running_router() as router:
        sender, receiver = open_bus(router), open_bus(router)
        rung: list[None] = []
        inlet = receiver.open_inlet(A1.selector("foot_step"), lambda: rung.append(None))
        for n in range(1, 4):
            sender.publish(step(n))
        wait_until(lambda: len(rung) == 3, what="three bells")
        assert list(inlet.take()) == [step(1), step(2), step(3)]
        assert list(inlet.take()) == []
        sender.close()
        receiver.close()


def test_a_full_inlet_is_counted_and_goes_on_with_the_newest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zenoh_bus, "_CHANNEL_SIZE", 8)
    with running_router() as router:
        sender, receiver, witness = open_bus(router), open_bus(router), open_bus(router)
        inlet = receiver.open_inlet(A1.selector("pressure"))
        heard: list[Envelope] = []
        witness.subscribe(A1.selector("pressure"), heard.append)
        wait_until(lambda: (sender.publish(pressure(0)), heard)[1], what="the subscriptions stand")
        list(inlet.take())
        for n in range(1, 41):
            sender.publish(pressure(n))
        wait_until(lambda: heard[-1] == pressure(40), what="the last message")
        taken: list[Envelope] = []
        wait_until(lambda: (taken.extend(inlet.take()), pressure(40) in taken)[1], what="the newest")
        assert receiver.overruns >= 1
        assert len(taken) < 40
        for bus in (sender, receiver, witness):
            bus.close()


def test_liveliness_tells_who_runs() -> None:
    with running_router() as router:
        service, watcher = open_bus(router), open_bus(router)
        service.declare_alive(A1, "fusion")
        wait_until(lambda: watcher.alive(A1.selector("health")) == {"bp/@v1/alpha/a1/health/fusion"})
        service.close()
        wait_until(lambda: watcher.alive(A1.selector("health")) == set())
        watcher.close()


def test_no_router_is_an_error_in_words() -> None:
    endpoint = free_endpoint()
    with pytest.raises(BusError, match=f"no router at {endpoint}.*bootprint router"):
        open_bus(endpoint, timeout_s=0.3)


@pytest.mark.parametrize("router", ["bogus", "", "tcp/127.0.0.1"])
def test_an_address_that_is_none_is_an_error_in_words(router: str) -> None:
    with pytest.raises(BusError, match="router"):
        open_bus(router, timeout_s=0.3)


def test_the_bus_knows_whether_its_router_is_there() -> None:
    endpoint = free_endpoint()
    with running_router(endpoint):
        bus = open_bus(endpoint)
        assert bus.is_connected()
    wait_until(lambda: not bus.is_connected(), what="the router is gone")
    with running_router(endpoint):
        wait_until(bus.is_connected, what="the router is back")
        bus.close()


def test_decoders_stand_before_any_thread_asks_for_one() -> None:
    # Two threads that build msgspec decoders of one struct at once crash the process.
    script = (
        "import sys, threading; sys.setswitchinterval(1e-6);"
        "from bootprint import wire; from bootprint.messages import ImuBatch, Pressure;"
        "data = wire.encode(Pressure(time_ns=1, pressure_pa=1.0));"
        "threads = [threading.Thread(target=wire.decode, args=('pressure', data)) for _ in range(24)];"
        "[t.start() for t in threads]; [t.join() for t in threads]"
    )
    for _ in range(3):
        assert subprocess.run([sys.executable, "-c", script], timeout=30).returncode == 0
    assert set(wire._DECODERS) == set(BY_SUBJECT)


def test_waiting_for_a_router_can_be_interrupted() -> None:
    stop = threading.Event()
    stop.set()
    before = time.monotonic()
    with pytest.raises(BusError):
        open_bus(free_endpoint(), timeout_s=60.0, should_stop=stop.is_set)
    assert time.monotonic() - before < 30.0


def test_a_taken_port_is_an_error_in_words() -> None:
    with running_router() as endpoint, pytest.raises(BusError, match="cannot start a router"):
        EmbeddedRouter(endpoint)


def test_lossless_bus_loses_nothing_to_a_slow_subscriber() -> None:
    with running_router() as router:
        sender, receiver = open_bus(router, lossless=True), open_bus(router, lossless=True)
        heard: list[int] = []
        gate = threading.Event()

        def slow(envelope: Envelope) -> None:
            gate.wait(10.0)
            heard.append(envelope.message.sequence)

        receiver.subscribe(A1.selector("pressure"), slow)
        wait_until(
            lambda: sender._session.declare_publisher(pressure(0).address.key).matching_status.matching
        )

        def send() -> None:
            for n in range(20_000):
                sender.publish(pressure(n))

        sending = threading.Thread(target=send)
        sending.start()
        gate.set()
        sending.join(60.0)
        wait_until(lambda: len(heard) >= 20_000, timeout_s=30.0, what="every message")
        assert heard == list(range(20_000))
        sender.close()
        receiver.close()
