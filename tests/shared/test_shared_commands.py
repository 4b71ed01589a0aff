"""`bootprint record`, `replay`, `info`, `bus`, `fix`, `alert` and so on against a real router."""

import json
import math
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from bootprint.bus import Envelope
from bootprint.commands import bus, fix, recordings, tell
from bootprint.errors import BootprintError, BusError, ConfigError, RecordingError
from bootprint.messages import Alert, Fix, Message, Observation, Position, Pressure, Status
from bootprint.recording import Recorder, Recording
from bootprint.topics import Identity
from bootprint.zenoh_bus import open_bus
from support.routers import free_endpoint, running_router
from support.waiting import wait_until

A3 = Identity("bp", "alpha", "a3")
S = 1_000_000_000

WHOSE = ("--realm", "r", "--unit", "u", "--soldier", "s")

app = typer.Typer()
for module in (recordings, bus, fix, tell):
    module.register(app)


@pytest.fixture(scope="module")
def router() -> Iterator[str]:
    with running_router() as endpoint:
        yield endpoint


def run(*arguments: object) -> str:
    """Standard output of a command; whatever it raises."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


def pressure(sequence: int) -> Envelope:
    message = Pressure(time_ns=sequence * S // 10, sequence=sequence, pressure_pa=1e5)
    return Envelope(A3.address("pressure", "body"), message)


def position(sequence: int) -> Envelope:
    message = Position(
        time_ns=sequence * S // 10,
        sequence=sequence,
        mode="boots",
        latitude_deg=47.0,
        longitude_deg=8.0,
        height_m=0.0,
        east_m=0.0,
        north_m=0.0,
        up_m=0.0,
        covariance_m2=(1.0, 0.0, 0.0, 1.0, 0.0, 1.0),
    )
    return Envelope(A3.address("position", "fusion"), message)


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    """Two seconds: pressure at 10 Hz and positions at 5 Hz."""
    path = tmp_path / "walk.mcap"
    with Recorder(path) as recorder:
        for sequence in range(21):
            recorder.write(pressure(sequence))
            if sequence % 2 == 0:
                recorder.write(position(sequence))
    return path


@contextmanager
def talking(router: str, envelope: Callable[[int], Envelope]) -> Iterator[None]:
    """Someone publishes messages 0, 1, 2, ... all the time."""
    sender, silence = open_bus(router), threading.Event()

    def talk() -> None:
        sequence = 0
        while not silence.wait(0.005):
            sender.publish(envelope(sequence))
            sequence += 1

    thread = threading.Thread(target=talk)
    thread.start()
    try:
        yield
    finally:
        silence.set()
        thread.join()
        sender.close()


@contextmanager
def listening(router: str) -> Iterator[list[Message]]:
    """Everything that is said, as long as one listens."""
    receiver = open_bus(router)
    heard: list[Message] = []
    receiver.subscribe("*/@v1/**", lambda envelope: heard.append(envelope.message))
    try:
        yield heard
    finally:
        receiver.close()


def test_a_recording_holds_what_was_said(router: str, tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    with talking(router, position):
        told = run("record", out, "--router", router, "--duration", 1)
    recording = Recording(out)
    sequences = [envelope.message.sequence for _, envelope in recording.envelopes()]
    assert len(sequences) > 20
    assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
    assert recording.report.derived == len(sequences)
    assert recording.report.truncated_at is None
    assert told.startswith(f"{out}: {len(sequences)} messages")


RECORD = "import typer; from bootprint.commands import recordings as r; a = typer.Typer(); r.register(a); a()"


@contextmanager
def recording_process(out: Path, router: str) -> Iterator[subprocess.Popen[bytes]]:
    """`bootprint record` as a process of its own; gone in the end, whatever happens."""
    command = [sys.executable, "-c", RECORD, "record", str(out), "--router", router]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.processes
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_recording_with_all_that_was_heard(
    router: str, tmp_path: Path, number: signal.Signals
) -> None:
    out = tmp_path / "out.mcap"
    with listening(router) as heard, recording_process(out, router) as recorder:
        # The recorder listens once its first flush, of at least one message, has made the file grow.
        with talking(router, position):
            wait_until(lambda: out.exists() and out.stat().st_size, what="the first chunk")
        with closing(open_bus(router)) as sender:
            for sequence in range(50):
                sender.publish(pressure(sequence))
            wait_until(lambda: pressure(49).message in heard, what="the last message")
        recorder.send_signal(number)
        assert recorder.wait(timeout=30) == 0
    recorded = [e.message for _, e in Recording(out).envelopes("bp/@v1/alpha/a3/pressure/*")]
    assert recorded == [pressure(sequence).message for sequence in range(50)]
    assert Recording(out).report.truncated_at is None


def test_a_recording_is_replayed_as_it_was(router: str, walk: Path) -> None:
    with listening(router) as heard:
        told = run("replay", walk, "--speed", "max", "--router", router)
        wait_until(lambda: len(heard) == 32, what="32 messages replayed")
    assert "32 messages published" in told
    assert heard == [envelope.message for _, envelope in Recording(walk).envelopes()]


def test_a_replay_of_the_sensors_leaves_the_rest_to_the_services(router: str, walk: Path) -> None:
    with listening(router) as heard:
        run("replay", walk, "--speed", 10, "--router", router, "--sensors")
        run("replay", walk, "--speed", 100, "--router", router, "--subject", "position")
        wait_until(lambda: len(heard) == 32, what="21 sensor messages and 11 positions")
    assert [type(message) for message in heard] == [Pressure] * 21 + [Position] * 11


def test_a_replay_ends_after_its_duration(router: str, walk: Path) -> None:
    told = run("replay", walk, "--speed", "0.01", "--router", router, "--duration", "0.2")
    assert told == f"{walk}: 2 messages published\n"  # both of time zero


def test_echo_shows_messages_and_ends_after_a_count(router: str) -> None:
    with talking(router, pressure):
        lines = run("bus", "echo", "bp/@v1/alpha/*/pressure/*", "--router", router, "--count", 3).splitlines()
    assert len(lines) == 3
    assert "bp/@v1/alpha/a3/pressure/body" in lines[0]
    assert "pressure_pa=100000" in lines[0]


def test_rates_are_written_as_json(router: str) -> None:
    with talking(router, pressure):
        rows = json.loads(run("bus", "rates", "--router", router, "--duration", "0.5", "--json", "-"))
    assert [(row["key"], row["expected_hz"], row["state"]) for row in rows] == [
        ("bp/@v1/alpha/a3/pressure/body", 10.0, "ok")
    ]
    assert rows[0]["rate_hz"] == pytest.approx(10.0)


def test_rates_are_shown_as_a_table(router: str) -> None:
    with talking(router, pressure):
        told = run("bus", "rates", "--router", router, "--duration", "0.5")
    assert "expected Hz" in told
    assert "10.00" in told


def test_a_fix_is_published(router: str) -> None:
    with listening(router) as heard, running(router, "fusion"):
        run("fix", "-33.9", "18.4", "--realm", "bp", "--unit", "alpha", "--soldier", "a3",
            "--azimuth", "-90", "--at", 12, "--router", router)  # fmt: skip
        wait_until(lambda: heard, what="the fix")
    assert heard == [
        Fix(
            time_ns=12 * S,
            latitude_deg=-33.9,
            longitude_deg=18.4,
            azimuth_rad=math.radians(270.0),
            azimuth_sigma_rad=math.radians(10.0),
        )
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["alert", "contact", "two men"],
            Alert(time_ns=12 * S, soldier="a3", kind="contact", text="two men"),
        ),
        (
            ["status", "wounded", "--battery", "40"],
            Status(time_ns=12 * S, soldier="a3", condition="wounded", battery_pct=40.0),
        ),
        (
            ["observation", "-33.9", "18.4", "on the roof", "--code", "sniper"],
            Observation(
                time_ns=12 * S,
                soldier="a3",
                latitude_deg=-33.9,
                longitude_deg=18.4,
                accuracy_m=10.0,
                text="on the roof",
                code="sniper",
            ),
        ),
    ],
)
def test_what_a_person_tells_is_published(router: str, arguments: list[str], message: Message) -> None:
    with listening(router) as heard, running(router, "sa-hub"):
        run(*arguments, "--realm", "bp", "--unit", "alpha", "--soldier", "a3", "--at", 12, "--router", router)
        wait_until(lambda: heard, what="the message")
    assert heard == [message]


@contextmanager
def running(router: str, service: str) -> Iterator[None]:
    """One of A3's services as the router sees it: its liveliness token."""
    bus = open_bus(router)
    bus.declare_alive(A3, service)
    wait_until(lambda: bus.alive(A3.selector("health", service)), what="the token")
    try:
        yield
    finally:
        bus.close()


def test_a_fix_that_nobody_hears_is_an_error(router: str) -> None:
    with pytest.raises(BusError, match="neither fusion nor sa-hub of a3 runs"):
        run("fix", "1", "2", "--realm", "bp", "--unit", "alpha", "--soldier", "a3", "--router", router)


def test_an_alert_that_no_hub_hears_is_an_error(router: str) -> None:
    with pytest.raises(BusError, match="no sa-hub of a3 runs"):
        run("alert", "help", "--realm", "bp", "--unit", "alpha", "--soldier", "a3", "--router", router)


@pytest.mark.parametrize(
    "arguments", [["bus", "echo", "a//b"], ["bus", "rates", "***"], ["record", "OUT", "--selector", "#"]]
)
def test_a_selector_that_is_none_is_one_line(router: str, tmp_path: Path, arguments: list[str]) -> None:
    named = [str(tmp_path / "out.mcap") if argument == "OUT" else argument for argument in arguments]
    with pytest.raises(BusError, match="is no selector of keys"):
        run(*named, "--router", router, "--duration", "0.1")


def test_a_realm_that_is_none_is_refused(router: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--realm 'a/b' must be"):
        run("record", tmp_path / "out.mcap", "--realm", "a/b", "--router", router, "--duration", "0.1")


def test_info_tells_counts_and_times(walk: Path) -> None:
    told = json.loads(run("info", walk, "--json", "-"))
    assert (told["messages"], told["derived"], told["duration_s"], told["faults"]) == (32, 11, 2.0, [])
    assert [(row["type"], row["messages"]) for row in told["topics"]] == [("Position", 11), ("Pressure", 21)]
    assert "32 messages are intact" in run("info", walk).replace("\n", "")


def test_info_salvages_a_damaged_recording(walk: Path, tmp_path: Path) -> None:
    walk.write_bytes(bytes(8) + walk.read_bytes()[8:-50])
    with pytest.raises(RecordingError, match=r"does not begin as an MCAP file does at byte 0.*--salvage OUT"):
        run("info", walk)
    run("info", walk, "--salvage", tmp_path / "mended.mcap")
    assert Recording(tmp_path / "mended.mcap").report.messages == 32
    with pytest.raises(RecordingError, match="exists already"):
        run("info", walk, "--salvage", tmp_path / "mended.mcap")


@pytest.mark.parametrize(
    ("arguments", "error", "complaint"),
    [
        (["replay", "none.mcap"], RecordingError, "none.mcap: no such recording"),
        (
            ["replay", "WALK", "--speed", "fast"],
            ConfigError,
            "--speed 'fast' must be a positive number or 'max'",
        ),
        (["replay", "WALK", "--speed", "0"], ConfigError, "--speed '0'"),
        (["replay", "WALK", "--speed", "inf"], ConfigError, "--speed 'inf'"),
        (["replay", "WALK", "--subject", "imus"], ConfigError, "--subject 'imus' is unknown; known: imu"),
        (["info", "WALK", "--json", "/none/x.json"], ConfigError, "--json /none/x.json: cannot be written"),
        (["fix", "1", "2"], ConfigError, "whose is it? Give --config"),
        (
            ["fix", "1", "2", "--azimuth", "400", "--realm", "r", "--unit", "u", "--soldier", "s"],
            ConfigError,
            "--azimuth 400 must be",
        ),
        (
            ["fix", "91", "2", "--realm", "r", "--unit", "u", "--soldier", "s"],
            ConfigError,
            "latitude_deg is 91.0",
        ),
        (
            ["fix", "1", "2", "--realm", "r", "--unit", "u", "--soldier", "a/b"],
            ConfigError,
            "soldier 'a/b' must",
        ),
        (["fix", "1", "2", "--config", "none.toml"], ConfigError, "none.toml: no such file"),
        (["alert", "hello", *WHOSE], ConfigError, "not an alert: Invalid enum value 'hello'"),
        (["alert", "help", "x" * 201, *WHOSE], ConfigError, "not an alert: "),
        (["status", "ok", "--battery", "101", *WHOSE], ConfigError, "not a status: "),
        (["observation", "1", "2", "--code", "ufo", *WHOSE], ConfigError, "not an observation: Invalid enum"),
        (["observation", "1", "200", *WHOSE], ConfigError, "not an observation: "),
    ],
)
def test_bad_input_is_one_line(
    walk: Path, arguments: list[str], error: type[BootprintError], complaint: str
) -> None:
    with pytest.raises(error) as caught:
        run(*[str(walk) if argument == "WALK" else argument for argument in arguments])
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


def test_without_a_router_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(BusError, match="no router at"):
        run("record", tmp_path / "out.mcap", "--router", free_endpoint(), "--duration", "0.2")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "command", ["record", "replay", "info", "fix", "alert", "status", "observation", "bus echo", "bus rates"]
)
def test_help_teaches_with_an_example(command: str) -> None:
    assert f"Example: bootprint {command}" in run(*command.split(), "--help")
