"""A run folder played piece by piece: the bytes of a run held in memory, at a memory that does not grow."""

import tracemalloc
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.errors import RecordingError
from bootprint.topics import Identity
from sensor_gateway.recordings.folder_stream import FolderStream
from sensor_gateway.recordings.run import ImuSeries
from sensor_gateway.recordings.run_folder import read_folder
from sensor_gateway.settings import ReplaySource
from sensor_gateway.sources.imu_batches import imu_batches
from sensor_gateway.sources.replay import open_recording
from sensor_gateway.sources.run_messages import run_messages, sensor_messages

WHO = Identity("demo", "alpha", "a1")
START_NS = 1_767_225_600 * 10**9
IMU = "time_s,ax,ay,az,gx,gy,gz"


def write_imu(path: Path, seconds: float, mag: bool = False, seed: int = 1) -> None:
    """200 Hz with holes, a stamp that goes back, unknown cells and a quoted one."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, seconds, 0.005)
    times = times[(times % 7.0) > 0.3]
    rows = [
        [f"{time:.6f}", *(f"{value:.5f}" for value in rng.normal(size=9 if mag else 6))] for time in times
    ]
    rows[700][0] = "1.0"
    rows[900][3] = ""
    rows[1100][2] = '"0.25"'
    path.write_text("\n".join([IMU + (",mx,my,mz" if mag else ""), *(",".join(row) for row in rows)]) + "\n")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_imu(tmp_path / "left_foot.csv", 20.0, mag=True)
    write_imu(tmp_path / "right_foot.csv", 15.0, seed=2)
    seconds = np.arange(0.0, 40.0, 0.05)
    pressure = "\n".join(f"{time:.3f},{101325 - time:.3f}" for time in seconds)
    (tmp_path / "pressure.csv").write_text(f"time_s,pressure_pa\n{pressure}\n5.0,9.0\n")
    gnss = "\n".join(f"{time},58.{time:03d},{400 if time == 600 else 15},,2.5" for time in range(700))
    (tmp_path / "gnss.csv").write_text(f"time_s,lat_deg,lon_deg,alt_m,h_acc_m\n{gnss}\n")
    (tmp_path / "ranges.csv").write_text("time_s,peer,distance_m\n3,a2,4.5\n1,a3,2.25\n")
    return tmp_path


def spoken(messages: object) -> list[tuple[str, bytes]]:
    assert hasattr(messages, "__iter__")
    return [(item.address.key, wire.encode(item.message)) for item in messages if isinstance(item, Envelope)]


def test_a_folder_in_pieces_says_what_the_whole_run_says(folder: Path) -> None:
    whole = spoken(run_messages(read_folder(folder)[0], WHO, START_NS))
    stream = FolderStream(folder)
    assert len(whole) > 1800
    assert spoken(sensor_messages(stream.pieces(), WHO, START_NS)) == whole
    assert spoken(sensor_messages(stream.pieces(), WHO, START_NS)) == whole  # as often as wanted
    source = ReplaySource(path=str(folder))
    assert spoken(open_recording(folder, source, WHO).messages(START_NS)) == whole


def test_a_field_with_a_hole_is_none_from_the_beginning_as_in_a_whole_run(folder: Path) -> None:
    path = folder / "left_foot.csv"
    lines = path.read_text().splitlines()
    lines[2500] = lines[2500].rsplit(",", 1)[0] + ","
    path.write_text("\n".join(lines) + "\n")
    whole = spoken(run_messages(read_folder(folder)[0], WHO, START_NS))
    assert spoken(sensor_messages(FolderStream(folder).pieces(), WHO, START_NS)) == whole


@pytest.mark.parametrize("damage", ["8.0,1,2,3,4,5", "8.0,1,2,x,4,5,6"])
def test_damage_far_behind_is_said_at_once_with_its_line(folder: Path, damage: str) -> None:
    path = folder / "right_foot.csv"
    lines = path.read_text().splitlines()
    lines[2222] = damage
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordingError, match=r"right_foot\.csv: line 2223"):
        FolderStream(folder)


def test_memory_does_not_grow_with_the_length_of_a_run(tmp_path: Path) -> None:
    peaks = []
    for name, seconds in (("short", 20.0), ("long", 120.0)):
        folder = tmp_path / name
        folder.mkdir()
        write_imu(folder / "body.csv", seconds)
        tracemalloc.start()
        for _ in open_recording(folder, ReplaySource(path=str(folder)), WHO).messages(START_NS):
            pass
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]


@given(
    cuts=st.lists(st.integers(0, 60), max_size=6),
    steps=st.lists(st.sampled_from([-1, 1, 1, 1, 4, 40]), min_size=60, max_size=60),
    size=st.integers(1, 12),
)
@settings(max_examples=100, deadline=None)
def test_where_a_series_is_cut_makes_no_difference(cuts: list[int], steps: list[int], size: int) -> None:
    time_s = np.cumsum(steps) * 0.005
    values = np.arange(180.0).reshape(60, 3)
    edges = [0, *sorted(cuts), 60]
    pieces = [ImuSeries(time_s[a:b], values[a:b], -values[a:b]) for a, b in pairwise(edges)]
    whole = imu_batches(iter([ImuSeries(time_s, values, -values)]), 0, size, 60_000_000)
    cut = imu_batches(iter(pieces), 0, size, 60_000_000)
    assert [wire.encode(batch) for batch in cut] == [wire.encode(batch) for batch in whole]
