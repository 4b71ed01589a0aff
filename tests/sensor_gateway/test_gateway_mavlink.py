"""MAVLink frames packed by pymavlink, against values worked out by hand."""

import math
import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bootprint.messages import CameraMotion, GnssFix, Pressure
from sensor_gateway.decoders.mavlink import MavlinkDecoder
from sensor_gateway.readings import ImuReading, MessageReading, TimeReading
from sensor_gateway.settings import Device, Sensor
from support.sensor_device import UTC_NS, MavlinkSender

BOOT = Sensor(system=1, component=1, instance=0, place="left_foot")
DEVICE = Device(
    imus=(BOOT, Sensor(system=1, instance=1, place="right_foot")),
    pressure=(Sensor(system=1, place="body"),),
    gnss=(Sensor(system=1, place="gnss"), Sensor(system=1, instance=1, place="second")),
    camera=(Sensor(system=1, place="helmet"),),
)


def decode(*frames: bytes, device: Device = DEVICE) -> tuple[list[object], MavlinkDecoder]:
    decoder = MavlinkDecoder(device)
    return decoder.feed(b"".join(frames), UTC_NS), decoder


def message_of(*frames: bytes, device: Device = DEVICE) -> object:
    readings, _ = decode(*frames, device=device)
    assert len(readings) == 1
    assert isinstance(readings[0], MessageReading)
    return readings[0].message


def pack(message: dialect.MAVLink_message) -> bytes:
    return MavlinkSender().pack(message)


def test_highres_imu_is_in_si_units_and_keeps_its_stamp() -> None:
    readings, _ = decode(MavlinkSender().imu(3, updated=0x1FF))
    assert readings == [
        ImuReading(
            "left_foot",
            (1, 1, "boot"),
            1_015_000_000,
            (3.0, 0.5, 9.75),
            (0.25, -0.5, 0.125),
            (25.0, -12.5, 50.0),  # gauss to µT
        )
    ]


def test_a_field_stands_for_a_tenth_of_a_second() -> None:
    sender = MavlinkSender()
    frames = [sender.imu(0, updated=0x1FF), sender.imu(20), sender.imu(21)]
    readings, _ = decode(*frames)
    assert [reading.mag_ut is not None for reading in readings if isinstance(reading, ImuReading)] == [
        True,
        True,  # 100 ms later
        False,  # 105 ms later
    ]


@pytest.mark.parametrize("updated", [0, 0x7, 0x38, 0x3E])
def test_a_sample_without_all_of_accel_and_gyro_is_counted_not_used(updated: int) -> None:
    readings, decoder = decode(MavlinkSender().imu(0, updated=updated))
    assert readings == []
    assert decoder.counts["imu_incomplete"] == 1


def test_pressure_of_highres_imu_in_pascal() -> None:
    readings, _ = decode(MavlinkSender().imu(0, updated=0x1200 | 0x3F))
    assert readings[1] == MessageReading(
        "body",
        (1, 1, "boot"),
        Pressure(time_ns=1_000_000_000, pressure_pa=101325.0, temperature_c=20.5),
    )


def test_scaled_imu_is_accepted_with_a_warning_count() -> None:
    frame = pack(dialect.MAVLink_scaled_imu2_message(1234, 1000, 0, -500, 1500, -250, 0, 500, -100, 0, 0))
    readings, decoder = decode(frame)
    assert len(readings) == 1
    reading = readings[0]
    assert isinstance(reading, ImuReading)
    assert (reading.place, reading.device_ns) == ("right_foot", 1_234_000_000)
    assert reading.accel_m_s2 == pytest.approx((9.80665, 0.0, -4.903325))
    assert reading.gyro_rad_s == pytest.approx((1.5, -0.25, 0.0))
    assert reading.mag_ut == pytest.approx((50.0, -10.0, 0.0))
    assert decoder.counts["imu_scaled_coarse"] == 1


def test_scaled_imu_is_left_aside_where_the_fine_one_comes_too() -> None:
    sender = MavlinkSender()
    scaled = sender.pack(dialect.MAVLink_scaled_imu_message(1001, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0))
    readings, _ = decode(sender.imu(0), scaled)
    assert [type(reading) for reading in readings] == [ImuReading]


def test_raw_imu_has_no_units_and_is_refused() -> None:
    readings, decoder = decode(pack(dialect.MAVLink_raw_imu_message(1, 2, 3, 4, 5, 6, 7, 8, 9, 10)))
    assert readings == []
    assert decoder.counts["imu_raw_refused"] == 1


def test_what_is_mapped_to_no_place_is_counted_and_named() -> None:
    readings, decoder = decode(MavlinkSender(system=7, component=3).imu(0))
    assert readings == []
    assert decoder.counts["unmapped_imu"] == 1
    assert decoder.notes() == ["not mapped: imu of system 7 component 3 instance 0"]


def test_scaled_pressure() -> None:
    frame = pack(dialect.MAVLink_scaled_pressure_message(2000, 987.5, 0.0, -1234))
    assert message_of(frame) == Pressure(time_ns=2_000_000_000, pressure_pa=98750.0, temperature_c=-12.34)


def gps_raw(**changes: int) -> bytes:
    fields = {
        "time_usec": 5_000_000,
        "fix_type": 6,
        "lat": 593293000,
        "lon": -180686000,
        "alt": 40_000,
        "eph": 80,
        "epv": 120,
        "vel": 150,
        "cog": 9000,
        "satellites_visible": 14,
        "alt_ellipsoid": 65_500,
        "h_acc": 1_250,
        "v_acc": 2_500,
        "vel_acc": 300,
    }
    return pack(dialect.MAVLink_gps_raw_int_message(**{**fields, **changes}))


def test_gps_raw_in_degrees_and_metres() -> None:
    fix = message_of(gps_raw())
    assert isinstance(fix, GnssFix)
    assert (fix.time_ns, fix.fix_kind, fix.satellites) == (5_000_000_000, "rtk_fixed", 14)
    assert fix.latitude_deg == pytest.approx(59.3293, abs=1e-12)
    assert fix.longitude_deg == pytest.approx(-18.0686, abs=1e-12)
    assert fix.height_m == 65.5
    assert (fix.horizontal_accuracy_m, fix.vertical_accuracy_m) == (1.25, 2.5)
    assert fix.hdop == 0.8
    assert (fix.speed_m_s, fix.speed_accuracy_m_s) == (1.5, 0.3)
    assert fix.course_rad == pytest.approx(math.pi / 2)


def test_gps_raw_unknowns_are_none_and_hdop_is_never_metres() -> None:
    unknown = {"eph": 65535, "vel": 65535, "cog": 65535, "satellites_visible": 255}
    absent = {"alt_ellipsoid": 0, "h_acc": 0, "v_acc": 0, "vel_acc": 0}
    fix = message_of(gps_raw(**unknown, **absent))
    assert isinstance(fix, GnssFix)
    names = ("hdop", "speed_m_s", "course_rad", "satellites", "height_m")
    accuracies = ("horizontal_accuracy_m", "vertical_accuracy_m", "speed_accuracy_m_s")
    assert {getattr(fix, name) for name in (*names, *accuracies)} == {None}
    with_dop = message_of(gps_raw(**absent))
    assert isinstance(with_dop, GnssFix)
    assert (with_dop.hdop, with_dop.horizontal_accuracy_m) == (0.8, None)


def test_height_above_mean_sea_level_needs_the_stated_geoid() -> None:
    device = Device(gnss=DEVICE.gnss, geoid_undulation_m=23.25)
    fix = message_of(gps_raw(alt_ellipsoid=0), device=device)
    assert isinstance(fix, GnssFix)
    assert fix.height_m == 63.25


def test_no_fix_has_no_place() -> None:
    fix = message_of(gps_raw(fix_type=1))
    assert fix == GnssFix(time_ns=5_000_000_000, fix_kind="none", satellites=14)


def test_gps2_raw_is_the_second_receiver() -> None:
    frame = pack(dialect.MAVLink_gps2_raw_message(1, 4, 10_000_000, 20_000_000, 0, 65535, 0, 0, 0, 9, 0, 0))
    readings, _ = decode(frame)
    assert isinstance(readings[0], MessageReading)
    assert readings[0].source == "second"
    assert isinstance(readings[0].message, GnssFix)
    assert (readings[0].message.fix_kind, readings[0].message.latitude_deg) == ("dgnss", 1.0)


def test_gps_input_honours_its_ignore_flags() -> None:
    def frame(flags: int) -> bytes:
        return pack(
            dialect.MAVLink_gps_input_message(
                *(6_000_000, 0, flags, 0, 0, 3, 100_000_000, 200_000_000),
                *(50.0, 0.5, 0.75, 3.0, 4.0, 0.0, 0.25, 1.5, 2.5, 11),
            )
        )

    device = Device(gnss=DEVICE.gnss, geoid_undulation_m=10.0)
    fix = message_of(frame(0), device=device)
    assert fix == GnssFix(
        time_ns=6_000_000_000,
        fix_kind="3d",
        latitude_deg=10.0,
        longitude_deg=20.0,
        height_m=60.0,
        horizontal_accuracy_m=1.5,
        vertical_accuracy_m=2.5,
        satellites=11,
        hdop=0.5,
        speed_m_s=5.0,
        speed_accuracy_m_s=0.25,
        course_rad=math.atan2(4.0, 3.0),
    )
    ignored = message_of(frame(0xFF), device=device)
    assert ignored == GnssFix(
        time_ns=6_000_000_000, fix_kind="3d", latitude_deg=10.0, longitude_deg=20.0, satellites=11
    )


def test_vision_delta_is_turned_to_the_axes_of_its_start() -> None:
    """A quarter turn to the right while the camera ends up 1 m ahead of where it was.

    MAVLink tells the metre in the axes at the end, where it lies to the left (right = -1).
    """
    frame = pack(
        dialect.MAVLink_vision_position_delta_message(
            2_000_000, 100_000, [0.0, 0.0, math.pi / 2], [0.0, -1.0, 0.25], 80.0
        )
    )
    motion = message_of(frame)
    assert isinstance(motion, CameraMotion)
    assert (motion.start_time_ns, motion.time_ns) == (1_900_000_000, 2_000_000_000)
    assert motion.translation_m == pytest.approx((1.0, 0.0, -0.25), abs=1e-6)
    assert motion.rotation_rad == pytest.approx(
        (0.0, 0.0, -math.pi / 2)
    )  # to the right is clockwise seen from above
    assert motion.confidence_pct == 80.0


def odometry(
    time_us: int, north: float, east: float, yaw: float, pitch: float = 0.0, reset: int = 0, quality: int = 50
) -> bytes:
    cy, sy, cp, sp = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    return pack(
        dialect.MAVLink_odometry_message(
            *(time_us, 1, 12, north, east, 0.0),
            [cy * cp, -sy * sp, cy * sp, sy * cp],
            *(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            [math.nan] * 21,
            [math.nan] * 21,
            reset,
            0,
            quality,
        )
    )


def test_odometry_becomes_the_motion_between_poses() -> None:
    """Facing east, 2 m to the east is 2 m ahead; turning on to the south is a turn to the right."""
    east, south = math.pi / 2, math.pi
    motion = message_of(odometry(1_000_000, 5.0, 1.0, east), odometry(1_100_000, 4.5, 3.0, south))
    assert isinstance(motion, CameraMotion)
    assert (motion.start_time_ns, motion.time_ns) == (1_000_000_000, 1_100_000_000)
    assert motion.translation_m == pytest.approx((2.0, -0.5, 0.0), abs=1e-6)
    assert motion.rotation_rad == pytest.approx((0.0, 0.0, -math.pi / 2), abs=1e-6)
    assert motion.confidence_pct == 50.0


def test_odometry_turns_are_told_in_the_axes_of_the_start() -> None:
    """Facing east, the camera tips its nose up by 0.25 rad: a turn about its own right, not about east."""
    east = math.pi / 2
    motion = message_of(odometry(1_000_000, 0.0, 0.0, east), odometry(1_100_000, 0.0, 0.0, east, pitch=0.25))
    assert isinstance(motion, CameraMotion)
    assert motion.rotation_rad == pytest.approx((0.0, -0.25, 0.0), abs=1e-6)


def test_odometry_tells_nothing_over_a_reset_or_a_failure() -> None:
    poses = [
        odometry(1_000_000, 0.0, 0.0, 0.0),
        odometry(1_100_000, 9.0, 0.0, 0.0, reset=1),
        odometry(1_200_000, 9.0, 0.0, 0.0, reset=1, quality=-1),
        odometry(1_300_000, 9.0, 0.0, 0.0, reset=1),
    ]
    readings, decoder = decode(*poses)
    assert readings == []
    assert (decoder.counts["odometry_resets"], decoder.counts["odometry_failed"]) == (1, 1)


def test_system_time_ties_the_boot_clock_to_utc_once_it_is_known() -> None:
    sender = MavlinkSender()
    unknown = sender.pack(dialect.MAVLink_system_time_message(0, 4_000))
    known = sender.pack(dialect.MAVLink_system_time_message(UTC_NS // 1000, 5_000))
    readings, _ = decode(unknown, known)
    assert readings == [
        TimeReading((1, 1, "boot"), 4_000_000_000),
        TimeReading((1, 1, "unix"), UTC_NS, UTC_NS),
        TimeReading((1, 1, "boot"), 5_000_000_000, UTC_NS),
    ]


def test_only_a_timesync_request_tells_a_clock() -> None:
    sender = MavlinkSender()
    request = sender.pack(dialect.MAVLink_timesync_message(0, 7_000_000_123))
    answer = sender.pack(dialect.MAVLink_timesync_message(99, 7_000_000_456))
    readings, _ = decode(request, answer)
    assert readings == [TimeReading((1, 1, "boot"), 7_000_000_123)]


def test_frames_survive_garbage_and_any_cutting_of_the_stream() -> None:
    """Garbage full of false starts must not swallow one frame, however the bytes are handed over."""
    noise = random.Random(5)
    sender = MavlinkSender()
    stream = b""
    for number in range(60):
        stream += bytes(noise.choices([0xFD, 0xFE, 0x00, 0x55, 0xFF], k=noise.randrange(0, 40)))
        stream += sender.imu(number)
    decoder = MavlinkDecoder(DEVICE)
    readings: list[object] = []
    while stream:
        size = noise.randrange(1, 90)
        readings += decoder.feed(stream[:size], UTC_NS)
        stream = stream[size:]
    readings += decoder.cut(UTC_NS)
    assert [reading.accel_m_s2[0] for reading in readings if isinstance(reading, ImuReading)] == list(
        range(60)
    )
    assert decoder.counts["bytes_skipped"] > 0


def test_a_flipped_bit_costs_its_own_frame_only() -> None:
    frames = MavlinkSender().imus(0, 5)
    frames[2] = frames[2][:20] + bytes((frames[2][20] ^ 4,)) + frames[2][21:]
    readings, decoder = decode(*frames)
    assert [reading.accel_m_s2[0] for reading in readings if isinstance(reading, ImuReading)] == [0, 1, 3, 4]
    assert decoder.counts["frames_broken"] >= 1


def test_version_1_frames_and_messages_of_other_dialects() -> None:
    sender = MavlinkSender()
    scaled = dialect.MAVLink_scaled_imu_message(1001, 1, 2, 3, 4, 5, 6, 7, 8, 9)
    foreign = bytes((0xFD, 4, 0, 0, 0, 1, 1, 0xFF, 0xFF, 0x7F)) + b"abcd" + b"xx"
    readings, decoder = decode(sender.pack(scaled, version1=True), foreign, sender.imu(0))
    assert len(readings) == 2
    assert (decoder.counts["frames"], decoder.counts["bytes_skipped"]) == (2, len(foreign))


def test_content_that_is_not_finite_makes_no_message() -> None:
    frame = pack(dialect.MAVLink_scaled_pressure_message(2000, math.nan, 0.0, 0))
    readings, decoder = decode(frame)
    assert readings == []
    assert decoder.counts["messages_invalid"] == 1
