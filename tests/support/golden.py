"""Golden outputs: what every service makes of the small recording, as tables that a person can review.

``make golden`` writes tests/golden/ anew (and, with ``--walk``, the small recording itself). The tables hold what
the cores put out when the recording passes through all of them in one process.
"""

import csv
import hashlib
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from bootprint import wire
from bootprint.bus import Envelope, MemoryBus
from bootprint.config import Member, Origin, Realm, convert
from bootprint.messages import FootStep, Position, Track
from bootprint.topics import Identity
from fusion.config import FusionConfig
from pdr_engine.config import PdrConfig
from proving_ground.inprocess import play_run
from proving_ground.sensors.run_writer import write_run_folder
from proving_ground.simulation.walker import Gait, GnssQuality, ImuQuality, simulate_walk
from sa_hub.assembly import build_hub
from sa_hub.hub import HubCore
from sa_hub.radio.counters import MemoryCounters
from sa_hub.settings import HubSettings
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import Run

TESTS = Path(__file__).parents[1]
WALK = TESTS / "data" / "short-walk"
GOLDEN = TESTS / "golden"
START_NS = 1_767_225_600 * 1_000_000_000
ORIGIN = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=40.0)
REALM = Realm(
    id="golden",
    origin=ORIGIN,
    roster=(Member(id="a1", number=1, unit="alpha"), Member(id="cp", number=100, unit="hq")),
)
SOLDIER = Identity("golden", "alpha", "a1")
START = {"east_m": 0.0, "north_m": 0.0, "azimuth_deg": 90.0, "sigma_m": 0.5, "azimuth_sigma_deg": 2.0}
PDR = convert({}, PdrConfig, "golden")
FUSION = convert({"floor_height_m": 3.0, "start": START}, FusionConfig, "golden")
Rows = list[list[str]]


def make_walk() -> None:
    """The small recording: 24 s at 100 Hz, an L of 14 m with satellites until the corner."""
    run = simulate_walk(
        WALK.name,
        [(0.0, 0.0, 0.0), (9.0, 0.0, 0.0), (9.0, 5.0, 0.0)],
        ORIGIN,
        seed=7,
        gait=Gait(stand_before_s=5.0),
        imu=ImuQuality(rate_hz=100.0),
        gnss=GnssQuality(sigma_m=1.0, until_s=12.0),
    )
    write_run_folder(run, WALK)


def small_walk() -> Run:
    """The small recording, read back as anybody's run folder is."""
    return load_runs([WALK])[0]


def play_small_walk() -> MemoryBus:
    """The small recording through pdr-engine and fusion, in process."""
    return play_run(small_walk(), SOLDIER, ORIGIN, PDR, FUSION, START_NS)


def play_radio(positions: Sequence[Envelope]) -> tuple[list[bytes], list[Track]]:
    """A soldier's positions through its hub, over a loss-free link, into a command post's hub."""
    sender, receiver = _hub("a1", "soldier"), _hub("cp", "command_post")
    frames: list[bytes] = []
    tracks: list[Track] = []
    for envelope in positions:
        now_ns = envelope.message.time_ns
        sender.handle(envelope)
        sender.tick(now_ns)
        heard = [frame.data for frame in sender.take_frames()]
        frames += heard
        outputs = [output for data in heard for output in receiver.receive("net", data, now_ns)]
        outputs += receiver.tick(now_ns)
        tracks += [output.message for output in outputs if isinstance(output.message, Track)]
    return frames, tracks


def _hub(soldier: str, role: str) -> HubCore:
    settings = convert(
        {"role": role, "threshold_m": 2.0, "links": [{"name": "net", "rate_bits_per_s": 1200}]},
        HubSettings,
        "golden",
    )
    return build_hub(REALM, REALM.member(soldier), settings, bytes(32), lambda net: MemoryCounters())


def gateway_rows(bus: MemoryBus) -> Rows:
    """Every sensor message: when, where, and the digest of its bytes."""
    return [
        [key, str(wire.decode(subject, payload).time_ns - START_NS), hashlib.sha256(payload).hexdigest()[:16]]
        for key, payload in bus.journal
        if (subject := key.split("/")[4]) in ("imu", "gnss")
    ]


def step_rows(bus: MemoryBus) -> Rows:
    """Every foot step with its covariance."""
    return [
        [
            envelope.address.source,
            _seconds(step.start_time_ns),
            _seconds(step.time_ns),
            *map(_number, (*step.displacement_m, step.heading_change_rad, *step.covariance)),
            step.motion,
        ]
        for envelope in bus.replayed("foot_step")
        if isinstance(step := envelope.message, FootStep)
    ]


def position_rows(bus: MemoryBus) -> Rows:
    """Every fused position with its covariance."""
    return [
        [
            _seconds(p.time_ns),
            p.mode,
            *map(_number, (p.east_m, p.north_m, p.up_m, *p.covariance_m2, p.speed_m_s)),
            str(p.floor),
            "+".join(p.sources),
        ]
        for envelope in bus.replayed("position")
        if isinstance(p := envelope.message, Position)
    ]


def radio_rows(bus: MemoryBus) -> Rows:
    """Every frame's length, then every track the command post published."""
    frames, tracks = play_radio(list(bus.replayed("position")))
    return [["frame", str(len(data))] for data in frames] + [
        [
            "track",
            _seconds(t.time_ns),
            t.soldier,
            t.state,
            *(f"{degrees:.6f}" for degrees in (t.latitude_deg, t.longitude_deg)),
            *map(_number, (t.east_velocity_m_s, t.north_velocity_m_s, t.accuracy_m)),
        ]
        for t in tracks
    ]


TABLES = {
    "sensor-gateway.csv": gateway_rows,
    "pdr-engine.csv": step_rows,
    "fusion.csv": position_rows,
    "sa-hub.csv": radio_rows,
}


def _seconds(time_ns: int) -> str:
    return f"{(time_ns - START_NS) / 1e9:.3f}"


def _number(value: float) -> str:
    return f"{value:.6g}"


def read_table(name: str) -> Iterator[list[str]]:
    """A golden table's rows."""
    with (GOLDEN / name).open(newline="", encoding="utf-8") as file:
        yield from csv.reader(file)


def main() -> None:
    """Write the golden tables; with ``--walk`` the small recording first."""
    if "--walk" in sys.argv:
        make_walk()
    bus = play_small_walk()
    GOLDEN.mkdir(exist_ok=True)
    for name, rows in TABLES.items():
        with (GOLDEN / name).open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(rows(bus))


if __name__ == "__main__":
    main()
