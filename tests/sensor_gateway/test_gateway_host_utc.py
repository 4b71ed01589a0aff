"""The host's clock against satellite time: when it is corrected, and what that does to a boot's stamps."""

from itertools import pairwise

import pytest

from bootprint.bus import Envelope
from bootprint.messages import GnssFix, ImuBatch
from bootprint.topics import Identity
from sensor_gateway.host_utc import HostUtc
from sensor_gateway.intake import Intake
from sensor_gateway.settings import Device, Sensor
from support.sensor_device import UTC_NS, MavlinkSender
from support.ubx_receiver import pvt_at

A1 = Identity("bp", "alpha", "a1")
MS, S = 1_000_000, 1_000_000_000
DELAY_NS = 120 * MS


def state(host: HostUtc, seconds: range, *, behind_ns: int, delay_ns: int = DELAY_NS) -> None:
    """One fix a second on a host whose clock is so far behind UTC."""
    for second in seconds:
        utc_ns = UTC_NS + second * S
        host.state_utc(utc_ns - behind_ns + delay_ns + (second % 3) * 50 * MS, utc_ns)


@pytest.mark.parametrize("behind_s", [-3600, -2, 2, 3600, 20 * 365 * 86_400])
def test_five_fixes_that_agree_correct_the_clock_up_to_a_fix_s_delay(behind_s: int) -> None:
    host = HostUtc()
    state(host, range(4), behind_ns=behind_s * S)
    assert host.offset_ns == 0
    state(host, range(4, 30), behind_ns=behind_s * S)
    assert host.offset_ns == behind_s * S - DELAY_NS
    assert host.steps == 1
    direction = "behind" if behind_s > 0 else "ahead of"
    assert f"{abs(behind_s - 0.12):.1f} s {direction} satellite time" in host.note


def test_a_clock_within_a_second_is_left_alone() -> None:
    host = HostUtc()
    state(host, range(60), behind_ns=700 * MS)
    assert (host.offset_ns, host.steps, host.note) == (0, 0, "")


def test_a_backlog_that_arrives_at_once_is_no_statement() -> None:
    """Ten seconds of fixes at 10 Hz, all at one time."""
    host = HostUtc()
    for number in range(100):
        host.state_utc(UTC_NS + 10 * S + number, UTC_NS + number * 100 * MS)
    assert host.steps == 0


def test_single_wrong_words_and_a_wrapped_week_counter_are_not_believed() -> None:
    host = HostUtc()
    for second in range(100):
        wrong_ns = 3600 * S if second % 4 else 0
        host.state_utc(UTC_NS + second * S, UTC_NS + second * S + wrong_ns)
    for second in range(100, 130):
        host.state_utc(UTC_NS + second * S, UTC_NS + second * S - 1024 * 7 * 86_400 * S)
    assert host.steps == 0


def test_a_clock_that_is_set_right_needs_no_offset_any_more() -> None:
    host = HostUtc()
    state(host, range(10), behind_ns=3600 * S)
    state(host, range(10, 20), behind_ns=0)
    assert (host.offset_ns, host.steps) == (0, 2)


@pytest.mark.parametrize("behind_s", [-3600, 3600])
def test_a_receiver_corrects_the_stamps_of_a_boot_on_another_wire(behind_s: int) -> None:
    """The boot knows no UTC; its stamps come to satellite time, less the delay of a fix, and stay in order."""
    host = HostUtc()
    boot = Intake(A1, Device(imus=(Sensor(system=1, place="left_foot"),)), host)
    receiver = Intake(A1, Device(protocol="ubx"), host)
    sender = MavlinkSender()
    batches: list[Envelope] = []
    fixes: list[Envelope] = []
    for number in range(200 * 20):
        now_ns = UTC_NS + number * 5 * MS - behind_s * S
        batches += boot.feed(sender.imu(number), now_ns)
        if number % 200 == 24:
            fixes += receiver.feed(pvt_at(UTC_NS + number // 200 * S), now_ns)
    messages = [envelope.message for envelope in batches if isinstance(envelope.message, ImuBatch)]
    assert int(messages[0].times[0]) == UTC_NS - behind_s * S
    number = int(messages[-1].accel[-1, 0])  # a pretend sample's x is its number
    assert int(messages[-1].times[-1]) == UTC_NS + number * 5 * MS - DELAY_NS
    assert len([envelope for envelope in fixes if isinstance(envelope.message, GnssFix)]) == 20
    backs = [b.time_ns < a.time_ns for a, b in pairwise(messages)]
    assert sum(backs) == (1 if behind_s < 0 else 0)
    assert boot.counters()["clock_set_backs"] == sum(backs)


def test_a_fix_without_sure_time_corrects_nothing() -> None:
    host = HostUtc()
    receiver = Intake(A1, Device(protocol="ubx"), host)
    for second in range(20):
        frame = pvt_at(UTC_NS + second * S, gnssFixOk=second % 2, fullyResolved=1 - second % 2)
        receiver.feed(frame, UTC_NS + second * S + 3600 * S)
    assert host.steps == 0
