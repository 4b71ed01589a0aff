"""`bootprint watch` in a terminal on a live bus: two real hubs, a radio link, and keys that somebody presses."""

import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest

from bootprint.bus import Envelope
from bootprint.messages import Alert, Fix, Message, Observation, Position, Status
from bootprint.mgrs import mgrs
from bootprint.topics import Identity
from proving_ground.exercises.processes.stage import free_ports
from support.hub_processes import A1, CP, Hub, running, write_computer, write_realm
from support.hub_squad import ORIGIN, START_NS, Walk, position
from support.terminal import running_in_terminal
from support.waiting import wait_until

pytestmark = pytest.mark.processes
LINK = 'bind = "127.0.0.1:{}"\npeers = ["127.0.0.1:{}"]\nrate_bits_per_s = 9600'
PATIENCE_S = 60.0


@contextmanager
def standing(hub: Hub, identity: Identity, east_m: float) -> Iterator[None]:
    """Fusion's word, five times a second: the soldier stands there."""
    stop = threading.Event()
    template = position(identity.soldier, START_NS, Walk(east_m=east_m, speed_m_s=0.0)).message
    assert isinstance(template, Position)

    def tell() -> None:
        while not stop.wait(0.2):
            now = msgspec.structs.replace(template, time_ns=time.time_ns())
            hub.bus.publish(Envelope(identity.address("position", "fusion"), now))

    thread = threading.Thread(target=tell)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def test_what_is_typed_reaches_the_other_end_of_the_radio_and_its_answer_the_screen(tmp_path: Path) -> None:
    write_realm(tmp_path)
    one, two = free_ports(2, socket.SOCK_DGRAM)
    soldier = write_computer(tmp_path, "a1", 'role = "soldier"', LINK.format(one, two))
    post = write_computer(tmp_path, "cp", 'role = "command_post"', LINK.format(two, one))
    said: list[Message] = []
    with running(soldier, A1) as a1, running(post, CP) as cp:
        for subject in ("alert", "status", "observation"):
            cp.bus.subscribe(CP.selector(subject), lambda envelope: said.append(envelope.message))
        fixes = a1.bus.open_inlet(A1.selector("fix"))
        router = f"unixsock-stream/{soldier.parent / 'router'}"
        watch = [sys.executable, "-c", "from bootprint.cli import main; main()", "watch"]
        command = [*watch, "--config", str(soldier), "--router", router]
        with (
            standing(a1, A1, 0.0),
            standing(cp, CP, 40.0),
            running_in_terminal(command) as terminal,
        ):
            wait_until(
                lambda: mgrs(ORIGIN.latitude_deg, ORIGIN.longitude_deg)[:6] in terminal.text,
                PATIENCE_S,
                "own place",
            )
            wait_until(lambda: " 40 " in terminal.text, PATIENCE_S, "the friend 40 m off")

            def sent(keys: str, kind: type[Message]) -> None:
                """Type, until it is heard at the other end."""
                terminal.type(keys)
                heard = f"what {keys!r} says; the screen: {terminal.text[-300:]}"
                wait_until(lambda: any(isinstance(each, kind) for each in said), PATIENCE_S, heard)

            sent("acontact two men\r", Alert)
            sent("swounded 40\r", Status)
            sent("ovehicle 90 200 truck\r", Observation)
            terminal.type("x59.35 18.07\r")
            found: list[Envelope] = []
            wait_until(lambda: found.extend(fixes.take()) or found, PATIENCE_S, "the fix")
            answer = Alert(time_ns=time.time_ns(), soldier="cp", kind="withdraw", text="back to the trucks")
            cp.bus.publish(Envelope(CP.address("alert", "person"), answer))
            wait_until(lambda: "back to the trucks" in terminal.text, PATIENCE_S, "the answer on the screen")
            terminal.type("q")
            assert terminal.process.wait(timeout=30) == 0
    (fix,) = (each.message for each in found)
    assert isinstance(fix, Fix)
    assert (fix.latitude_deg, fix.longitude_deg) == (59.35, 18.07)
    kinds = {type(each): each for each in reversed(said)}  # the first of each kind
    assert getattr(kinds[Alert], "text", "") == "two men"
    status, seen = kinds[Status], kinds[Observation]
    assert isinstance(status, Status)
    assert isinstance(seen, Observation)
    assert (status.soldier, status.condition, status.battery_pct) == ("a1", "wounded", 40.0)
    assert (seen.soldier, seen.code, seen.text) == ("a1", "vehicle", "truck")
    assert seen.longitude_deg == pytest.approx(18.07 + 200.0 / 56_900.0, abs=1e-4)
