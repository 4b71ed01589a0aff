"""The table of topics and the keys made from it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bootprint import messages as m
from bootprint.errors import WireError
from bootprint.topics import BY_SUBJECT, SUBJECT_OF, TOPICS, Address, Identity, parse_key
from support.messages import addresses, quick

A3 = Identity("bp", "alpha", "a3")


def test_every_message_type_has_exactly_one_subject() -> None:
    assert set(SUBJECT_OF) == set(m.Message.__subclasses__())
    assert len(TOPICS) == len(BY_SUBJECT) == len(SUBJECT_OF)


def test_the_example_of_the_design() -> None:
    address = A3.address("imu", "left_foot")
    assert address.key == "bp/@v1/alpha/a3/imu/left_foot"
    assert address.topic.message is m.ImuBatch
    assert A3.selector("imu") == "bp/@v1/alpha/a3/imu/*"
    assert address.with_subject("pressure").key == "bp/@v1/alpha/a3/pressure/left_foot"
    assert address.with_subject("gnss", "rover").key == "bp/@v1/alpha/a3/gnss/rover"


@quick
@given(address=st.sampled_from(sorted(BY_SUBJECT)).flatmap(addresses))
def test_keys_are_taken_apart_as_they_were_made(address: Address) -> None:
    assert parse_key(address.key) == address


@pytest.mark.parametrize(
    "key",
    [
        "",
        "/",
        "bp/@v1/alpha/a3/imu",
        "bp/@v1/alpha/a3/imu/left_foot/x",
        "bp/@v2/alpha/a3/imu/left_foot",
        "bp/v1/alpha/a3/imu/left_foot",
        "bp/@v1/alpha/a3/teapot/left_foot",
        "bp/@v1/alpha/a3/imu/",
        "/@v1/alpha/a3/imu/left_foot",
        "bp/@v1/*/a3/imu/left_foot",
        "bp/@v1/alpha/a 3/imu/left_foot",
        "bp/@v1/alpha/ä3/imu/left_foot",
        "bp/@v1/alpha/a3/imu/left_foot\n",
        "bp/@v1/alpha/a3/imu/" + "x" * 65,
    ],
)
def test_other_keys_are_refused(key: str) -> None:
    with pytest.raises(WireError, match="key"):
        parse_key(key)


@quick
@given(key=st.text(max_size=80))
def test_any_text_is_an_address_or_a_wire_error(key: str) -> None:
    with pytest.raises(WireError):
        parse_key(key)


@pytest.mark.parametrize("part", ["", "a/b", "*", "@v1", "a b", "x" * 65, "a\n"])
def test_identities_refuse_what_cannot_stand_in_a_key(part: str) -> None:
    for fields in ((part, "alpha", "a3"), ("bp", part, "a3"), ("bp", "alpha", part)):
        with pytest.raises(ValueError, match="must be 1 to 64"):
            Identity(*fields)
    with pytest.raises(ValueError, match="source"):
        A3.address("imu", part)


def test_an_unknown_subject_is_told_with_the_known_ones() -> None:
    with pytest.raises(KeyError, match=r"unknown subject 'imus'; known: imu, pressure"):
        A3.address("imus", "left_foot")
