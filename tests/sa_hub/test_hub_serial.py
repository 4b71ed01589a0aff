"""The serial link on real pseudo-terminals, joined by a line that is as slow as its baud rate."""

import queue
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from sa_hub.radio.link_profile import LinkProfile
from sa_hub.radio.links.framing import framed
from sa_hub.radio.links.serial_line import SerialLink
from support.serial_pair import BITS_PER_BYTE, SerialPair
from support.waiting import PATIENCE_S, wait_until

BAUD = 9600
GUARD_S = 0.05


class Modems:
    """Two links at the ends of one line, and what each heard."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.line = SerialPair(folder, BAUD)
        stack.callback(self.line.close)
        self.heard: tuple[queue.Queue[bytes], queue.Queue[bytes]] = (queue.Queue(), queue.Queue())
        self.links = tuple(
            SerialLink(
                LinkProfile(
                    name="squad",
                    kind="serial",
                    port=str(end.path),
                    baud=BAUD,
                    guard_s=GUARD_S,
                    rate_bits_per_s=1200,
                ),
                heard.put,
            )
            for end, heard in zip(self.line.ends, self.heard, strict=True)
        )
        for link in self.links:
            stack.callback(link.close)
            link.start()
        self.line.start()
        for link in self.links:
            wait_until(lambda link=link: not link.fault, what="the port is open")  # type: ignore[misc]

    def say(self, end: int, frame: bytes) -> None:
        """Send as the hub does: not before the link is free."""
        wait_until(lambda: not self.links[end].busy, what="the link is free")
        self.links[end].send(frame)


@pytest.fixture
def modems(tmp_path: Path) -> Iterator[Modems]:
    with ExitStack() as stack:
        yield Modems(tmp_path, stack)


def test_frames_cross_unchanged_both_ways(modems: Modems) -> None:
    for frame in (b"\x00\x00", bytes(range(250)), b"last"):
        modems.say(0, frame)
        assert modems.heard[1].get(timeout=PATIENCE_S) == frame
        modems.say(1, frame[::-1])
        assert modems.heard[0].get(timeout=PATIENCE_S) == frame[::-1]
    assert [link.send_faults for link in modems.links] == [0, 0]
    assert [link.garbled for link in modems.links] == [0, 0]


def test_a_link_is_busy_until_the_line_has_carried_its_frame(modems: Modems) -> None:
    frame = bytes(100)
    begin_s = time.monotonic()
    modems.links[0].send(frame)
    assert modems.links[0].busy
    wait_until(lambda: not modems.links[0].busy)
    on_line_s = len(framed(frame)) * BITS_PER_BYTE / BAUD
    assert time.monotonic() - begin_s >= on_line_s
    last_left_s = modems.line.ends[0].passed[-1][0]
    assert last_left_s <= time.monotonic()
    assert modems.heard[1].get(timeout=PATIENCE_S) == frame


def test_a_second_frame_is_refused_while_one_waits(modems: Modems) -> None:
    modems.line.inject(0, b"\x55" * 20)  # somebody speaks: the first frame has to wait
    wait_until(lambda: modems.links[0].busy, what="the noise is heard")
    modems.links[0].send(b"first")
    modems.links[0].send(b"second")
    assert modems.heard[1].get(timeout=PATIENCE_S) == b"first"
    assert modems.links[0].send_faults == 1


def test_nobody_speaks_while_the_other_is_heard(modems: Modems) -> None:
    """A frame handed over in the middle of the other's leaves only when the guard time is over."""
    modems.links[0].send(bytes(200))
    wait_until(lambda: len(modems.line.ends[0].passed) > 20, what="the first bytes are through")
    modems.links[1].send(b"me too")
    assert modems.heard[0].get(timeout=PATIENCE_S) == b"me too"
    others_end_s = modems.line.ends[0].passed[-1][0]
    first_of_ours_s = modems.line.ends[1].passed[0][0]
    assert first_of_ours_s > others_end_s + GUARD_S
    assert modems.heard[1].get(timeout=PATIENCE_S) == bytes(200)


def test_noise_is_counted_and_costs_no_frame(modems: Modems) -> None:
    for index in range(5):
        modems.line.inject(1, b"\x13\x37\xffnoise" * (index + 1))
        modems.say(0, b"frame %d" % index)
        assert modems.heard[1].get(timeout=PATIENCE_S) == b"frame %d" % index
    assert modems.links[1].garbled == 5


def test_an_unplugged_modem_is_busy_and_comes_back_by_itself(modems: Modems) -> None:
    link = modems.links[1]
    modems.line.unplug(1)
    wait_until(lambda: bool(link.fault), what="the loss is noticed")
    assert link.busy
    link.send(b"into nothing")
    assert link.send_faults == 1
    modems.line.plug(1)
    wait_until(lambda: not link.busy, what="the port is open again")
    modems.say(0, b"welcome back")
    assert modems.heard[1].get(timeout=PATIENCE_S) == b"welcome back"
    modems.say(1, b"here I am")
    assert modems.heard[0].get(timeout=PATIENCE_S) == b"here I am"
