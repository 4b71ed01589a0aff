"""The performance report: figures of real parts, and a page that says how they stand beside those of before."""

import json
import subprocess
import time
from pathlib import Path
from typing import cast

import pytest
from typer.testing import CliRunner

from bootprint.bus import Bus, Envelope
from bootprint.cli import build_app
from bootprint.errors import ConfigError
from proving_ground.performance.bus_throughput import Counter, bus_throughput, until_heard
from proving_ground.performance.figures import FILE, committed, ratio
from proving_ground.performance.page import write_page
from proving_ground.performance.walking_squads import SQUAD, walking_squads

MACHINE = {"processors": 2, "processor": "a fast one", "python": "3.11.7", "load": 0.25}
MEASURED = MACHINE | {"soldiers": [1, 8], "seconds": 15.0}


def figures(start_s: float, **more: float) -> dict[str, object]:
    return {**MEASURED, "tables": {"Start": {"fusion": {"start_s": start_s, **more}}}}


def test_a_page_tells_each_figure_and_how_many_times_the_last_one_it_is(tmp_path: Path) -> None:
    write_page(tmp_path, figures(1.5, resident_mb=50.0), figures(0.6))
    row = next(line for line in (tmp_path / "performance.md").read_text().splitlines() if "fusion" in line)
    assert row == "| fusion | 1.50 (2.50) | 50 |"  # memory is new: nothing to compare with


def test_what_was_not_there_before_has_no_ratio(tmp_path: Path) -> None:
    write_page(tmp_path, figures(1.5), {})
    page = (tmp_path / "performance.md").read_text()
    assert "| fusion | 1.50 |" in page
    assert "Nothing had been committed before." in page
    assert [ratio(2.0, 0.0), ratio(None, 1.0), ratio(3.0, 1.5)] == [None, None, 2.0]


def test_a_page_tells_what_was_run_and_whether_others_were_at_work(tmp_path: Path) -> None:
    write_page(tmp_path, figures(1.5), figures(1.5) | {"load": 7.1})
    page = (tmp_path / "performance.md").read_text()
    assert "`bootprint benchmark all --soldiers 1 --soldiers 8 --seconds 15 --docs docs`" in page
    measured, earlier = page.split("The committed figures")
    assert "load 0.2 before it began." in measured
    assert "load 7.1 before it began.\nOthers were at work" in earlier


def test_a_folder_that_is_not_there_is_told_before_anything_is_measured(tmp_path: Path) -> None:
    nowhere = tmp_path / "nowhere"
    told = CliRunner().invoke(build_app(), ["benchmark", "all", "--docs", str(nowhere)])
    assert isinstance(told.exception, ConfigError)
    assert str(told.exception).startswith(f"{nowhere}: ")


def test_committed_figures_are_those_of_the_last_commit_not_of_the_file(tmp_path: Path) -> None:
    def git(*words: str) -> None:
        who = ("-c", "user.name=n", "-c", "user.email=n@example.org")
        subprocess.run(["git", *who, *words], cwd=tmp_path, check=True, capture_output=True)

    (tmp_path / FILE).write_text(json.dumps(figures(1.0)))
    assert committed(tmp_path) == figures(1.0)  # no repository: the file's
    git("init")
    git("add", FILE)
    git("commit", "-m", "figures")
    (tmp_path / FILE).write_text(json.dumps(figures(9.0)))
    assert committed(tmp_path) == figures(1.0)
    assert committed(tmp_path / "nowhere") == {}


@pytest.mark.parametrize(("soldiers", "leaders"), [(1, 1), (8, 1), (9, 2), (40, 5)])
def test_squads_of_eight_have_a_leader_and_a_net_each(soldiers: int, leaders: int) -> None:
    exercise = walking_squads(soldiers, 10.0)
    assert len(exercise.soldiers) == soldiers
    assert len(exercise.hubs) == leaders + 1
    assert exercise.command_post == "cp"
    assert all(len(net.members) <= SQUAD + 1 for net in exercise.nets)
    assert exercise.duration_s >= 10.0
    numbers = [one.number for one in exercise.participants]
    assert len(set(numbers)) == len(numbers)


class LateListener:
    """A bus whose router learns of the subscription when so many messages have been published."""

    def __init__(self, listener: Counter, deaf_to: int) -> None:
        self.published = 0
        self._listener = listener
        self._deaf_to = deaf_to

    def publish(self, envelope: Envelope) -> None:
        self.published += 1
        if self.published > self._deaf_to:
            self._listener.take(envelope)


def test_nothing_is_counted_before_the_subscriber_is_known() -> None:
    counter = Counter(expected=1)
    bus = LateListener(counter, deaf_to=3)
    until_heard(cast("Bus", bus), counter)
    assert (bus.published, counter.came, counter.all_came.is_set()) == (4, 0, False)


@pytest.mark.processes
def test_every_message_that_a_bus_is_given_comes_and_is_paid_for() -> None:
    began_s, cpu_s = time.monotonic(), time.process_time()
    (cells,) = bus_throughput(500).values()
    took_s, cpu_s = time.monotonic() - began_s, time.process_time() - cpu_s
    rate, us_each = cells["messages_per_s"], cells["us_each"]
    assert rate is not None
    assert us_each is not None
    assert 500 / rate < took_s
    assert 0.0 < 500 * us_each < 1e6 * cpu_s
