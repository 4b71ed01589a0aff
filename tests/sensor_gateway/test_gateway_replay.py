"""Recordings as messages: runs, tlogs and bus recordings."""

import struct
from pathlib import Path

import numpy as np
import pytest

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.errors import RecordingError
from bootprint.messages import Alert, CameraMotion, GnssFix, ImuBatch, Pressure, Range
from bootprint.recording import Recorder
from bootprint.topics import Identity
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import CameraSeries, GnssSeries, ImuSeries, PressureSeries, Run
from sensor_gateway.settings import ReplaySource, Sensor
from sensor_gateway.sources.replay import open_recording, run_messages
from sensor_gateway.stamps import due_ns
from support.recorded import recorded_data
from support.sensor_device import UTC_NS, MavlinkSender

A1 = Identity("bp", "alpha", "a1")
MS, S = 1_000_000, 1_000_000_000
NAN = float("nan")


def series(rate_hz: float, count: int, first: float = 0.0) -> ImuSeries:
    """A unit whose x acceleration counts its samples."""
    accel = np.column_stack([np.arange(count) + first, np.zeros(count), np.full(count, 9.75)])
    return ImuSeries(np.arange(count) / rate_hz, accel, np.full((count, 3), 0.5))


def a_run() -> Run:
    nan = np.full(3, NAN)
    gnss = GnssSeries(
        np.array([0.0, 0.1, 0.2]),
        *(np.array([59.0, NAN, 95.0]), np.array([18.0, NAN, 18.0]), np.array([40.0, NAN, 40.0])),
        *(np.array([2.5, NAN, NAN]), nan, np.array([9.0, 3.0, NAN]), nan, np.array([-90.0, NAN, NAN])),
    )
    return Run(
        name="made",
        kind="dual",
        path=Path("made"),
        imus={"left_foot": series(200.0, 50), "right_foot": series(200.0, 50, first=1000.0)},
        pressure=PressureSeries(np.array([0.0, 0.1, 0.1, 0.2]), np.array([1e5, NAN, 99_000.0, -1.0])),
        gnss=gnss,
        camera=CameraSeries(
            np.array([0.0, 0.1]), np.array([0.1, 0.2]), np.ones((2, 3)), np.array([[0.0] * 3, [NAN] * 3])
        ),
    )


def of(envelopes: list[Envelope], subject: str) -> list[Envelope]:
    return [envelope for envelope in envelopes if envelope.address.subject == subject]


def test_a_run_s_messages_come_in_the_order_in_which_they_can_be_known() -> None:
    envelopes = list(run_messages(a_run(), A1, UTC_NS))
    dues = [due_ns(envelope.message) for envelope in envelopes]
    assert dues == sorted(dues)
    assert [envelope.address.source for envelope in of(envelopes, "imu")[:2]] == ["left_foot", "right_foot"]
    first = of(envelopes, "imu")[0].message
    assert isinstance(first, ImuBatch)
    assert first.times.tolist() == [UTC_NS + number * 5 * MS for number in range(10)]
    assert due_ns(first) == UTC_NS + 45 * MS
    again = [wire.encode(envelope.message) for envelope in run_messages(a_run(), A1, UTC_NS)]
    assert again == [wire.encode(envelope.message) for envelope in envelopes]


def test_unknown_values_and_rows_out_of_range_are_left_out() -> None:
    envelopes = list(run_messages(a_run(), A1, UTC_NS))
    assert [envelope.message for envelope in of(envelopes, "pressure")] == [
        Pressure(time_ns=UTC_NS, pressure_pa=1e5),
        Pressure(time_ns=UTC_NS + 100 * MS, sequence=1, pressure_pa=99_000.0),
    ]
    fix, none = (envelope.message for envelope in of(envelopes, "gnss"))
    assert fix == GnssFix(
        time_ns=UTC_NS,
        fix_kind="3d",
        latitude_deg=59.0,
        longitude_deg=18.0,
        height_m=40.0,
        horizontal_accuracy_m=2.5,
        satellites=9,
        course_rad=1.5 * np.pi,
    )
    assert none == GnssFix(time_ns=UTC_NS + 100 * MS, sequence=1, fix_kind="none", satellites=3)
    assert [envelope.message for envelope in of(envelopes, "camera_motion")] == [
        CameraMotion(
            time_ns=UTC_NS + 100 * MS,
            start_time_ns=UTC_NS,
            translation_m=(1.0, 1.0, 1.0),
            rotation_rad=(0.0, 0.0, 0.0),
        )
    ]


def test_slow_and_broken_off_series_make_shorter_batches() -> None:
    """60 Hz: four samples span 50 ms, a fifth would span 67; and none spans a gap."""
    slow = Run(name="slow", kind="foot", path=Path("slow"), imus={"left_foot": series(60.0, 10)})
    sizes = [len(e.message.times) for e in run_messages(slow, A1, 0) if isinstance(e.message, ImuBatch)]
    assert sizes == [4, 4, 2]
    times = np.concatenate([np.arange(7), np.arange(7, 14) + 1000]) * 0.005
    gap = series(200.0, 14)
    gap = ImuSeries(times, gap.accel_m_s2, gap.gyro_rad_s)
    broken = Run(name="gap", kind="foot", path=Path("gap"), imus={"left_foot": gap})
    sizes = [len(e.message.times) for e in run_messages(broken, A1, 0) if isinstance(e.message, ImuBatch)]
    assert sizes == [7, 7]


@pytest.mark.recorded
def test_a_recorded_walk_keeps_every_sample() -> None:
    (run,) = load_runs([recorded_data() / "foot-gcp" / "SensorConnectData_31_LLIO.mat"])
    batches = [envelope.message for envelope in run_messages(run, A1, UTC_NS)]
    accel = np.concatenate([batch.accel for batch in batches if isinstance(batch, ImuBatch)])
    (imu,) = run.imus.values()
    np.testing.assert_array_equal(accel, imu.accel_m_s2)
    assert [batch.sequence for batch in batches] == list(range(len(batches)))


def tlog_record(frame: bytes, received_ns: int) -> bytes:
    return struct.pack(">Q", received_ns // 1000) + frame


def tlog(count: int = 40) -> list[bytes]:
    """Records of a 200 Hz boot, as pymavlink writes them."""
    sender = MavlinkSender()
    return [tlog_record(sender.imu(number), UTC_NS + number * 5 * MS) for number in range(count)]


REPLAY = ReplaySource(path="a.tlog", imus=(Sensor(system=1, place="left_foot"),))


def replayed(path: Path, settings: ReplaySource = REPLAY) -> tuple[list[int], list[int], dict[str, int]]:
    """The samples' numbers and stamps after replaying from second 1000, and the counts."""
    recording = open_recording(path, settings, A1)
    batches = [e.message for e in recording.messages(1000 * S) if isinstance(e.message, ImuBatch)]
    numbers = [int(x) for batch in batches for x in batch.accel[:, 0]]
    return numbers, [int(time) for batch in batches for time in batch.times], recording.counts


def test_a_tlog_is_decoded_and_shifted_to_the_start(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(tlog()))
    numbers, times, counts = replayed(path)
    assert numbers == list(range(40))
    assert times == [1000 * S + number * 5 * MS for number in range(40)]
    assert counts["bytes_skipped"] == 0


def test_a_damaged_tlog_loses_only_what_is_damaged(tmp_path: Path) -> None:
    """A stretch overwritten, a frame of another dialect, and an end in the middle of a frame."""
    records = tlog()
    foreign = tlog_record(bytes((0xFD, 2, 0, 0, 0, 1, 1, 0xFF, 0xFF, 0x7F)) + b"abxx", UTC_NS)
    records[10] = b"\xfd" * len(records[10])
    records[20] = records[20][:30]
    records.insert(30, foreign)
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(records)[:-5])
    numbers, times, counts = replayed(path)
    assert numbers == [number for number in range(39) if number not in (10, 20)]
    assert times == [1000 * S + number * 5 * MS for number in numbers]
    assert counts["stretches_damaged"] == 3


@pytest.mark.parametrize("content", [b"", b"no tlog at all" * 50, bytes(5000)])
def test_a_file_without_one_frame_is_no_tlog(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"a\.tlog: holds no MAVLink frame"):
        open_recording(path, REPLAY, A1)


def test_a_tlog_without_a_mapping_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(tlog()))
    with pytest.raises(RecordingError, match=r"add \[\[gateway.sources.imus\]\]"):
        open_recording(path, ReplaySource(path="a.tlog"), A1)


def record_bus(path: Path) -> None:
    """Two soldiers' sensors, and an alert, which no sensor said."""
    b2 = Identity("other", "bravo", "b2")
    with Recorder(path) as recorder:
        for number in range(5):
            time_ns = UTC_NS + number * 100 * MS
            for identity, pascal in ((b2, 1e5 + number), (A1, 9e4)):
                message = Pressure(time_ns=time_ns, sequence=7 + number, pressure_pa=pascal)
                recorder.write(Envelope(identity.address("pressure", "body"), message))
        recorder.write(
            Envelope(b2.address("range", "uwb"), Range(time_ns=time_ns, peer="a1", distance_m=4.5))
        )
        recorder.write(Envelope(b2.address("alert", "b2"), Alert(time_ns=time_ns, soldier="b2", kind="help")))


def test_a_bus_recording_gives_one_soldier_s_sensors_under_our_own_name(tmp_path: Path) -> None:
    path = tmp_path / "bus.mcap"
    record_bus(path)
    recording = open_recording(path, ReplaySource(path="bus.mcap", soldier="b2"), A1)
    envelopes = list(recording.messages(1000 * S))
    assert {envelope.address.key for envelope in envelopes} == {
        "bp/@v1/alpha/a1/pressure/body",
        "bp/@v1/alpha/a1/range/uwb",
    }
    assert [envelope.message for envelope in of(envelopes, "pressure")] == [
        Pressure(time_ns=1000 * S + number * 100 * MS, sequence=7 + number, pressure_pa=1e5 + number)
        for number in range(5)
    ]


def test_a_bus_recording_without_the_soldier_says_whom_it_holds(tmp_path: Path) -> None:
    path = tmp_path / "bus.mcap"
    record_bus(path)
    with pytest.raises(RecordingError, match="no sensor messages of soldier 'c3'; it holds those of a1, b2"):
        open_recording(path, ReplaySource(path="bus.mcap", soldier="c3"), A1)


def write_walk(folder: Path, count: int = 20) -> None:
    """A run folder of one foot."""
    folder.mkdir()
    rows = [f"{number * 0.005},{number},0,9.75,0.5,0.5,0.5" for number in range(count)]
    (folder / "left_foot.csv").write_text("\n".join(["time_s,ax,ay,az,gx,gy,gz", *rows]) + "\n")


def test_a_run_is_chosen_by_its_name(tmp_path: Path) -> None:
    for name in ("first", "second"):
        write_walk(tmp_path / name)
    with pytest.raises(RecordingError, match=r"choose one with run = \(runs: first, second\)"):
        open_recording(tmp_path, ReplaySource(path="."), A1)
    with pytest.raises(RecordingError, match=r"no run 'third' \(runs: first, second\)"):
        open_recording(tmp_path, ReplaySource(path=".", run="third"), A1)
    numbers, _, _ = replayed(tmp_path, ReplaySource(path=".", run="second"))
    assert numbers == list(range(20))


def test_a_missing_recording_is_said(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="gone: no such recording"):
        open_recording(tmp_path / "gone", REPLAY, A1)
