"""Frames on a line of bytes: whatever noise surrounds them, they come through whole or not at all."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sa_hub.radio.link_profile import LONGEST_SERIAL_FRAME_BYTES, SERIAL_FRAMING_BYTES
from sa_hub.radio.links.framing import DELIMITER, Deframer, framed

frames = st.binary(max_size=LONGEST_SERIAL_FRAME_BYTES)


@given(frames)
def test_framing_costs_what_the_budget_pays(frame: bytes) -> None:
    line = framed(frame)
    assert len(line) == len(frame) + SERIAL_FRAMING_BYTES
    assert line.count(DELIMITER) == 2


def test_a_frame_by_hand() -> None:
    """CRC-16/XMODEM of "123456789" is 0x31C3 (its catalogued check value); no zeros inside: one code byte, 12."""
    assert framed(b"123456789") == b"\x00\x0c123456789\x31\xc3\x00"
    # A zero is replaced by the distance to the next one: 1, then the rest.
    assert framed(b"\x00A")[:4] == b"\x00\x01\x04A"


@given(st.lists(frames, max_size=8), st.lists(st.integers(1, 40), min_size=1))
def test_frames_come_out_however_the_bytes_arrive(sent: list[bytes], cuts: list[int]) -> None:
    line, deframer, heard = b"".join(map(framed, sent)), Deframer(), []
    turn = 0
    while line:
        size = cuts[turn % len(cuts)]
        heard += deframer.feed(line[:size])
        line, turn = line[size:], turn + 1
    assert heard == sent
    assert deframer.garbled == 0


@given(st.binary(max_size=2000), frames)
def test_garbage_before_a_frame_costs_no_frame(garbage: bytes, frame: bytes) -> None:
    deframer = Deframer()
    assert list(deframer.feed(garbage + framed(frame)))[-1] == frame


@given(st.binary(min_size=1, max_size=250).map(lambda data: data.replace(b"\x00", b"\x01")), st.data())
def test_a_damaged_byte_is_caught(frame: bytes, data: st.DataObject) -> None:
    """Eight wrong bits in a row are within the sixteen that the check sum always catches (frame without zeros)."""
    line = bytearray(framed(frame))
    at = data.draw(st.integers(2, 1 + len(frame)))
    line[at] ^= data.draw(st.integers(1, 255).filter(lambda flip: flip != line[at]))
    deframer = Deframer()
    assert list(deframer.feed(bytes(line))) == []
    assert deframer.garbled == 1


@pytest.mark.parametrize("chunk", [1, 7, 4096])
def test_memory_stays_bounded(chunk: int) -> None:
    deframer = Deframer()
    for _ in range(200_000 // chunk):
        assert list(deframer.feed(b"\x55" * chunk)) == []
    assert len(deframer._piece) < 300
    assert list(deframer.feed(framed(b"still there"))) == [b"still there"]
    assert deframer.garbled == 1
