"""From readings to messages: batches, numbers, and what is dropped and counted."""

import datetime
import math
from itertools import pairwise

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bootprint.bus import Envelope
from bootprint.messages import CameraMotion, GnssFix, ImuBatch, Pressure
from bootprint.topics import Identity
from sensor_gateway.intake import Intake
from sensor_gateway.settings import Device, Sensor
from support.sensor_device import UTC_NS, MavlinkSender, nmea

A1 = Identity("bp", "alpha", "a1")
MS = 1_000_000
DEVICE = Device(
    imus=(Sensor(system=1, place="left_foot"),),
    gnss=(Sensor(system=1, place="gnss"),),
    camera=(Sensor(system=1, place="helmet"),),
)


def at(number: int) -> int:
    """When the ``number``-th sample of a 200 Hz unit arrives without delay."""
    return UTC_NS + number * 5 * MS


def feed(intake: Intake, sender: MavlinkSender, numbers: list[int]) -> list[Envelope]:
    return [envelope for number in numbers for envelope in intake.feed(sender.imu(number), at(number))]


def batches(envelopes: list[Envelope]) -> list[list[int]]:
    found = [envelope.message for envelope in envelopes]
    return [[int(x) for x in batch.accel[:, 0]] for batch in found if isinstance(batch, ImuBatch)]


def test_ten_samples_a_batch_with_every_sample_s_own_time() -> None:
    (envelope,) = feed(Intake(A1, DEVICE), MavlinkSender(), list(range(10)))
    batch = envelope.message
    assert isinstance(batch, ImuBatch)
    assert list(batch.times) == [at(number) for number in range(10)]
    assert batch.mag is None
    assert batch.gyro[9].tolist() == [0.25, -0.5, 0.125]


def test_a_batch_never_spans_more_than_its_age() -> None:
    """Samples 25 ms apart: three span 50 ms, a fourth would span 75 ms."""
    envelopes = feed(Intake(A1, DEVICE), MavlinkSender(), list(range(0, 50, 5)))
    assert batches(envelopes) == [[0, 5, 10], [15, 20, 25], [30, 35, 40]]


def test_a_silent_sensor_s_samples_do_not_wait() -> None:
    intake = Intake(A1, DEVICE)
    assert feed(intake, MavlinkSender(), [0, 1]) == []
    assert intake.tick(at(0) + 60 * MS) == []
    assert batches(intake.tick(at(0) + 61 * MS)) == [[0, 1]]


def test_repeated_and_late_samples_are_dropped_and_counted() -> None:
    intake = Intake(A1, DEVICE)
    sender = MavlinkSender()
    for number, arrival in ((0, 0), (1, 1), (1, 2), (0, 3), (2, 4)):
        intake.feed(sender.imu(number), at(arrival))
    assert batches(intake.cut(at(5))) == [[0, 1, 2]]
    assert (intake.counters()["duplicates"], intake.counters()["stamps_back"]) == (1, 1)


def test_samples_that_are_not_finite_are_dropped_and_counted() -> None:
    intake = Intake(A1, DEVICE)
    broken = dialect.MAVLink_highres_imu_message(1_000_000, math.nan, *[0.0] * 12, 63, 0)
    sender = MavlinkSender()
    intake.feed(sender.pack(broken) + sender.imu(1), at(1))
    assert batches(intake.cut(at(2))) == [[1]]
    assert intake.counters()["not_finite"] == 1


def test_content_out_of_range_never_reaches_the_bus() -> None:
    """A latitude of 200°, and a camera interval that fits into no 64 bits."""
    intake = Intake(A1, DEVICE)
    sender = MavlinkSender()
    place = dialect.MAVLink_gps_raw_int_message(1_000_000, 3, 2_000_000_000, 0, 0, 100, 100, 0, 0, 8)
    motion = dialect.MAVLink_vision_position_delta_message(1_000_000, 2**63, [0.0] * 3, [0.0] * 3, 50.0)
    assert intake.feed(sender.pack(place) + sender.pack(motion), UTC_NS) == []
    assert intake.counters()["messages_invalid"] == 2


def test_both_times_of_a_camera_motion_are_mapped() -> None:
    intake = Intake(A1, DEVICE)
    motion = dialect.MAVLink_vision_position_delta_message(3_000_000, 100_000, [0.0] * 3, [0.0] * 3, 50.0)
    (envelope,) = intake.feed(MavlinkSender().pack(motion), UTC_NS)
    assert isinstance(envelope.message, CameraMotion)
    assert (envelope.message.start_time_ns, envelope.message.time_ns) == (UTC_NS - 100 * MS, UTC_NS)


def test_rates_in_event_time_and_silence() -> None:
    intake = Intake(A1, DEVICE)
    feed(intake, MavlinkSender(), list(range(201)))
    assert intake.gauges()["rate_hz.imu/left_foot"] == 200.0
    silent = ["gnss/gnss is silent", "camera_motion/helmet is silent"]
    assert intake.silent(at(200) + 1000 * MS, at(200)) == []
    assert intake.silent(at(200) + 2000 * MS, UTC_NS - 5000 * MS) == ["imu/left_foot is silent", *silent]
    assert intake.gauges()["rate_hz.imu/left_foot"] == 0.0


S = 1_000_000_000
RECEIVER = Device(protocol="nmea")
NO_TIME = nmea("GNGGA,,,,,,0,00,99.99,,,,,,")


def epoch(utc_ns: int) -> bytes:
    """A receiver's GGA and RMC at a full second of UTC."""
    moment = datetime.datetime.fromtimestamp(utc_ns // S, datetime.UTC)
    place = "5921.0,N,01804.0,E"
    gga = f"GNGGA,{moment:%H%M%S}.00,{place},1,09,1.0,40.0,M,25.0,M,,"
    return nmea(gga) + nmea(f"GNRMC,{moment:%H%M%S}.00,A,{place},0.5,10.0,{moment:%d%m%y},,,A")


def fix_times(envelopes: list[Envelope]) -> list[int]:
    fixes = [envelope.message for envelope in envelopes if isinstance(envelope.message, GnssFix)]
    return [fix.time_ns for fix in fixes if fix.fix_kind != "none"]


def test_stamps_by_arrival_do_not_deafen_a_receiver_that_then_learns_the_time() -> None:
    """The computer is an hour ahead of the receiver."""
    intake = Intake(A1, RECEIVER)
    alive = intake.feed(NO_TIME, UTC_NS + 3600 * S)
    times = [UTC_NS + number * S for number in range(4)]
    out = [envelope for time_ns in times for envelope in intake.feed(epoch(time_ns), time_ns + 3601 * S)]
    assert len(alive) == 1
    assert fix_times(out) == times
    assert intake.counters().get("stamps_back", 0) == 0


def test_one_stamp_in_the_future_costs_four_fixes_not_an_hour_of_them() -> None:
    intake = Intake(A1, RECEIVER)
    told = [UTC_NS, UTC_NS + 3600 * S, *(UTC_NS + second * S for second in range(2, 9))]
    out = [
        envelope
        for second, time_ns in enumerate(told)
        for envelope in intake.feed(epoch(time_ns), at(200 * second))
    ]
    assert fix_times([*out, *intake.cut(at(2000))]) == [*told[:2], *told[6:]]
    assert (intake.counters()["stamps_back"], intake.counters()["stamps_set_back"]) == (4, 1)


def test_late_samples_within_a_second_are_disorder_however_many() -> None:
    intake = Intake(A1, DEVICE)
    feed(intake, MavlinkSender(), [*range(100), *range(50, 90), 100])
    assert (intake.counters()["stamps_back"], intake.counters().get("stamps_set_back", 0)) == (40, 0)


def test_a_batch_never_holds_samples_from_before_and_after_a_set_back() -> None:
    """The computer's clock goes back by a minute while a boot runs."""
    intake, sender = Intake(A1, DEVICE), MavlinkSender()
    out = feed(intake, sender, list(range(204)))
    for number in range(204, 2000):
        out += intake.feed(sender.imu(number), at(number) - 60 * S)
    found = [envelope.message for envelope in out if isinstance(envelope.message, ImuBatch)]
    assert all(earlier < later for batch in found for earlier, later in pairwise(batch.times))
    assert int(found[-1].times[-1]) == at(1997) - 60 * S
    assert [message.sequence for message in found] == list(range(len(found)))
    counters = intake.counters()
    assert (counters["clock_set_backs"], counters["stamps_set_back"], counters["stamps_back"]) == (1, 1, 4)


def test_pressure_in_every_inertial_message_is_thinned_to_13_hz_and_counted() -> None:
    device = Device(imus=DEVICE.imus, pressure=(Sensor(system=1, place="body"),))
    intake, sender = Intake(A1, device), MavlinkSender()
    out = [envelope for n in range(401) for envelope in intake.feed(sender.imu(n, updated=0x23F), at(n))]
    times = [envelope.message.time_ns for envelope in out if isinstance(envelope.message, Pressure)]
    assert times == [at(number) for number in range(0, 401, 15)]
    assert intake.counters()["pressure_thinned"] == 401 - len(times)
    assert intake.counters().get("stamps_back", 0) == 0
