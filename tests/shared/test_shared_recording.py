"""Recordings: what is written is read, by us and by plain MCAP tools, in order and reproducibly."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import msgpack
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.errors import RecordingError
from bootprint.messages import Position, Pressure
from bootprint.recording import Recorder, Recording, read_envelopes
from bootprint.topics import TOPICS, Identity
from support.messages import envelopes

A3 = Identity("bp", "alpha", "a3")
S = 1_000_000_000
TWO_MESSAGES_BYTES = 50
each_in_own_file = settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def pressure(time_ns: int, sequence: int = 0, source: str = "body") -> Envelope:
    message = Pressure(time_ns=time_ns, sequence=sequence, pressure_pa=101_325.0)
    return Envelope(A3.address("pressure", source), message)


def position(time_ns: int) -> Envelope:
    message = Position(
        time_ns=time_ns,
        sequence=5,
        mode="boots",
        latitude_deg=47.05,
        longitude_deg=8.31,
        height_m=480.5,
        east_m=1.0,
        north_m=2.0,
        up_m=3.0,
        covariance_m2=(1.0, 0.1, 0.2, 2.0, 0.3, 3.0),
        floor=-1,
    )
    return Envelope(A3.address("position", "fusion"), message)


def write(path: Path, sent: list[Envelope], chunk_bytes: int = 1 << 18) -> Path:
    with Recorder(path, chunk_bytes=chunk_bytes, overwrite=True) as recorder:
        for envelope in sent:
            recorder.write(envelope)
    return path


@each_in_own_file
@given(sent=st.lists(envelopes, max_size=8), chunk_bytes=st.sampled_from([1, 200, 1 << 18]))
def test_what_is_recorded_is_read_in_order_of_time(
    tmp_path: Path, sent: list[Envelope], chunk_bytes: int
) -> None:
    path = write(tmp_path / "a.mcap", sent, chunk_bytes)
    read = list(read_envelopes(path))
    # MCAP knows no time before 1970: such messages come first, with their own time untouched.
    assert [envelope for _, envelope in read] == sorted(sent, key=lambda e: max(0, e.message.time_ns))
    assert [log_time_ns for log_time_ns, _ in read] == [max(0, e.message.time_ns) for _, e in read]


@each_in_own_file
@given(times=st.lists(st.integers(0, 20), max_size=40), chunk_bytes=st.integers(1, 200))
@example(times=[5, 9, 3, 5], chunk_bytes=TWO_MESSAGES_BYTES)  # the later chunk begins earlier, and ties
def test_messages_of_one_time_keep_the_order_of_writing(
    tmp_path: Path, times: list[int], chunk_bytes: int
) -> None:
    sent = [pressure(time_ns, sequence) for sequence, time_ns in enumerate(times)]
    read = [e.message for _, e in read_envelopes(write(tmp_path / "a.mcap", sent, chunk_bytes))]
    assert [(m.time_ns, m.sequence) for m in read] == sorted((t, i) for i, t in enumerate(times))


def test_the_same_input_gives_the_same_bytes(tmp_path: Path) -> None:
    sent = [pressure(S + i, i) for i in range(500)] + [position(2 * S)]
    first = write(tmp_path / "a.mcap", sent, 4_000).read_bytes()
    assert write(tmp_path / "b.mcap", sent, 4_000).read_bytes() == first


def test_every_type_has_a_schema_that_plain_tools_understand(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.mcap") as recorder:
        for topic in TOPICS:
            recorder.write_payload(A3.address(topic.subject, "x").key, msgpack.packb({"time_ns": 7}))
    with (tmp_path / "a.mcap").open("rb") as file:
        read = {c.topic: (s, c, m) for s, c, m in make_reader(file).iter_messages()}
    assert len(read) == len(TOPICS)
    for topic in TOPICS:
        schema, channel, message = read[A3.address(topic.subject, "x").key]
        assert schema is not None
        assert (channel.message_encoding, schema.encoding) == ("msgpack", "jsonschema")
        assert schema.name == f"bootprint.{topic.message.__name__}"
        definition = json.loads(schema.data)
        assert definition["type"] == "object"
        assert set(definition["properties"]) == set(topic.message.__struct_fields__)
        assert (message.log_time, msgpack.unpackb(message.data)) == (7, {"time_ns": 7})


def test_positions_show_on_foxgloves_map(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", [position(1_700_000_000 * S + 25)])
    key = A3.address("position", "fusion").key
    with path.open("rb") as file:
        [(schema, channel, message)] = make_reader(file).iter_messages(topics=f"{key}/location_fix")
    assert schema is not None
    assert (schema.name, schema.encoding, channel.message_encoding) == (
        "foxglove.LocationFix",
        "jsonschema",
        "json",
    )
    fix = json.loads(message.data)
    assert fix == {
        "timestamp": {"sec": 1_700_000_000, "nsec": 25},
        "frame_id": "a3",
        "latitude": 47.05,
        "longitude": 8.31,
        "altitude": 480.5,
        "position_covariance": [1.0, 0.1, 0.2, 0.1, 2.0, 0.3, 0.2, 0.3, 3.0],
        "position_covariance_type": 3,
        "metadata": [{"key": "mode", "value": "boots"}, {"key": "floor", "value": "-1"}],
    }
    definition = json.loads(schema.data)
    assert definition["type"] == "object"
    assert set(definition["properties"]) == set(definition["required"]) == set(fix)
    assert Recording(path).report.derived == 1


def test_times_of_reception_stand_as_publish_time(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.mcap") as recorder:
        recorder.write(pressure(5 * S), received_ns=6 * S)
        recorder.write(pressure(7 * S))
    with (tmp_path / "a.mcap").open("rb") as file:
        times = [(m.log_time, m.publish_time) for _, _, m in make_reader(file).iter_messages()]
    assert times == [(5 * S, 6 * S), (7 * S, 7 * S)]


def test_a_selector_chooses_keys(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", [pressure(1), pressure(2, source="left_foot"), position(3)])
    assert [t for t, _ in read_envelopes(path, "bp/@v1/*/*/pressure/*")] == [1, 2]
    assert [t for t, _ in read_envelopes(path, A3.selector("pressure", "left_foot"))] == [2]
    assert list(read_envelopes(path, "other/@v1/**")) == []


def test_what_is_unknown_or_invalid_is_recorded_skipped_and_counted(tmp_path: Path) -> None:
    later, teapot = "bp/@v2/alpha/a3/pressure/body", "bp/@v1/alpha/a3/teapot/x"
    good = A3.address("pressure", "body").key
    with Recorder(tmp_path / "a.mcap") as recorder:
        recorder.write_payload(later, msgpack.packb({"time_ns": 1, "pressure_hpa": 1013}))
        recorder.write_payload(teapot, b"no map", received_ns=2)
        recorder.write_payload(good, msgpack.packb({"time_ns": 3}))
        recorder.write_payload(good, b"\xc1", received_ns=4)
        recorder.write(pressure(5))
    recording = Recording(tmp_path / "a.mcap")
    assert [time_ns for time_ns, _ in recording.envelopes()] == [5]
    report = recording.report
    assert (report.messages, report.unknown, report.invalid) == (3, 2, {good: 2})
    assert (report.faults, report.truncated_at, report.lost) == ((), None, 0)
    with (tmp_path / "a.mcap").open("rb") as file:
        read = {(c.topic, m.log_time): m.data for _, c, m in make_reader(file).iter_messages()}
    assert read[later, 1] == msgpack.packb({"time_ns": 1, "pressure_hpa": 1013})
    assert read[teapot, 2] == b"no map"
    assert read[good, 4] == b"\xc1"


def test_a_message_of_a_later_version_keeps_its_unknown_fields(tmp_path: Path) -> None:
    payload = msgpack.packb({"time_ns": 3, "pressure_pa": 9e4, "humidity_pct": 40.0})
    with Recorder(tmp_path / "a.mcap") as recorder:
        recorder.write_payload(A3.address("pressure", "body").key, payload)
    with Recorder(tmp_path / "b.mcap") as copy:
        Recording(tmp_path / "a.mcap").copy_to(copy)
    with (tmp_path / "b.mcap").open("rb") as file:
        assert [m.data for _, _, m in make_reader(file).iter_messages()] == [payload]


def test_the_account_tells_counts_and_times_by_key(tmp_path: Path) -> None:
    report = Recording(write(tmp_path / "a.mcap", [pressure(9), position(4), pressure(7)], 1)).report
    topics = {key: (t.messages, t.first_ns, t.last_ns) for key, t in report.topics.items()}
    assert topics == {pressure(0).address.key: (2, 7, 9), position(0).address.key: (1, 4, 4)}
    assert (report.messages, report.first_ns, report.last_ns) == (3, 4, 9)
    assert report.sentence() == f"{tmp_path / 'a.mcap'}: 3 messages are intact"


def test_an_existing_recording_is_not_overwritten_by_mistake(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", [pressure(1)])
    before = path.read_bytes()
    with pytest.raises(RecordingError, match="exists already"):
        Recorder(path)
    assert path.read_bytes() == before
    with pytest.raises(RecordingError, match="cannot be written: No such file"):
        Recorder(tmp_path / "none" / "a.mcap")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_an_error_of_one_line() -> None:
    recorder = Recorder(Path("/dev/full"), overwrite=True)
    recorder.write(pressure(1))
    with pytest.raises(RecordingError, match="/dev/full: cannot be written: No space left"):
        recorder.flush()
    with pytest.raises(RecordingError, match="cannot be written"):
        recorder.close()
    recorder.close()


def test_a_recording_by_another_tool_is_read(tmp_path: Path) -> None:
    """Without chunks, with two channels of one key."""
    envelope = pressure(8, 1)
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False, compression=CompressionType.NONE)
        writer.start()
        for time_ns in (8, 3):
            channel = writer.register_channel(envelope.address.key, "msgpack", 0)
            writer.add_message(channel, time_ns, wire.encode(envelope.message), time_ns)
        writer.finish()
    recording = Recording(path)
    assert [time_ns for time_ns, _ in recording.envelopes()] == [3, 8]
    assert recording.report.topics[envelope.address.key].messages == 2


@pytest.mark.parametrize("compression", list(CompressionType))
def test_all_compressions_are_read(tmp_path: Path, compression: CompressionType) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=compression)
        writer.start()
        channel = writer.register_channel(pressure(0).address.key, "msgpack", 0)
        for sequence in range(50):
            message = pressure(sequence, sequence).message
            writer.add_message(channel, message.time_ns, wire.encode(message), 0, sequence)
        writer.finish()
    assert [time_ns for time_ns, _ in read_envelopes(path)] == list(range(50))


KILLED = """
import sys
from pathlib import Path
from bootprint.bus import Envelope
from bootprint.messages import Pressure
from bootprint.recording import Recorder
from bootprint.topics import Identity

address = Identity("bp", "alpha", "a3").address("pressure", "body")
recorder = Recorder(Path(sys.argv[1]))
for sequence in range(100):
    if sequence == 60:
        recorder.flush()
    recorder.write(Envelope(address, Pressure(time_ns=sequence, sequence=sequence, pressure_pa=1e5)))
sys.stdout.write("written\\n")
sys.stdout.flush()
sys.stdin.read()
"""


def test_a_killed_recorder_leaves_what_it_flushed(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    command = [sys.executable, "-c", KILLED, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as recorder:
        assert recorder.stdout is not None
        assert recorder.stdout.readline() == b"written\n"
        os.kill(recorder.pid, signal.SIGKILL)
    recording = Recording(path)
    assert [time_ns for time_ns, _ in recording.envelopes()] == list(range(60))
    assert recording.report.truncated_at == path.stat().st_size


def test_two_messages_are_a_chunk_of_the_size_said_above(tmp_path: Path) -> None:
    path = write(
        tmp_path / "a.mcap", [pressure(5), pressure(9, 1), pressure(3, 2), pressure(5, 3)], TWO_MESSAGES_BYTES
    )
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert [(c.message_start_time, c.message_end_time) for c in summary.chunk_indexes] == [(5, 9), (3, 5)]
