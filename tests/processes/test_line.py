"""The whole line as real processes over real routers: one soldier's walk to the command post over the radio hop."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from bootprint.messages import Position
from bootprint.stopping import Stop
from bootprint.topics import Identity
from proving_ground.exercises.exercise import REALM, Soldier
from proving_ground.exercises.processes.emulated_radio import NetCounts
from proving_ground.exercises.processes.stage import Play, Stage
from proving_ground.exercises.scoring.heard import Heard
from proving_ground.exercises.squad import COMMAND_POST, LEADER, UNIT, squad_of
from proving_ground.inprocess import play_run, positions_of
from support.golden import FUSION, ORIGIN, PDR, START, small_walk
from support.waiting import wait_until

pytestmark = [pytest.mark.processes, pytest.mark.xdist_group("processes")]
SPEED = 4.0


@dataclass
class Played:
    """What was heard on each computer while the small walk was played."""

    folder: Path
    heard: dict[str, Heard]
    start_ns: int
    processes: int
    nets: dict[str, NetCounts]


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    run = small_walk()
    soldier = Soldier("a1", 1, "Adler", run, run.truth["body"], START, simulated=True)
    exercise = replace(squad_of((soldier,), "line"), origin=ORIGIN)
    folder = tmp_path_factory.mktemp("line")
    with Stage(exercise, Play(folder, SPEED)) as stage:
        stage.wait_ready(Stop())
        stage.start_walks(Stop())
        wait_until(
            lambda: stage.processes.check() or stage.elapsed_s > run.duration_s + 4.0,
            timeout_s=60.0,
            what="the walk's end",
        )
        stage.observers.close()
        yield Played(
            folder,
            stage.observers.heard(),
            stage.start_ns,
            len(stage.processes.pids),
            {name: net.counts for name, net in stage.nets.items()},
        )


def in_process(start_ns: int) -> dict[int, Position]:
    """Positions by time, but for the last half second: in process the stream's end flushes what waits for more."""
    end_ns = start_ns + round((small_walk().duration_s - 0.5) * 1e9)
    bus = play_run(small_walk(), Identity(REALM, UNIT, "a1"), ORIGIN, PDR, FUSION, start_ns)
    return {position.time_ns: position for position in positions_of(bus) if position.time_ns < end_ns}


def test_positions_over_processes_are_those_in_process_to_a_nanometre(played: Played) -> None:
    expected = in_process(played.start_ns)
    heard = {position.time_ns: position for position in played.heard["a1"].positions}
    assert len(expected) > 90
    assert set(heard) >= set(expected), "positions missing"
    for time_ns, position in expected.items():
        for field in ("east_m", "north_m", "up_m", "covariance_m2", "velocity_m_s"):
            np.testing.assert_allclose(
                getattr(heard[time_ns], field), getattr(position, field), atol=1e-9, rtol=0
            )
        assert heard[time_ns].mode == position.mode


def test_nothing_was_late_lost_or_refused(played: Played) -> None:
    for computer, heard in played.heard.items():
        for service, health in heard.health.items():
            faults = {
                name: count
                for name, count in health.counters.items()
                if count and ("late" in name or "error" in name or "dropped" in name or "rejected" in name)
            }
            assert faults == {}, f"{computer}/{service}"


def test_the_command_post_hears_of_the_soldier_over_the_air_only(played: Played) -> None:
    heard = played.heard[COMMAND_POST]
    assert heard.positions == [], "a position crossed between computers without the radio"
    reports = len(heard.reports["a1"])
    assert reports > 0
    newest = heard.newest["a1"]
    assert newest.via == "company"
    last = played.heard["a1"].positions[-1]
    assert abs(newest.latitude_deg - last.latitude_deg) * 111_000 < 4.0
    # Each hop's receiver has a report per datagram at most; a relay may tell what it heard once again, moved on.
    assert played.nets["squad"].datagrams >= len(played.heard[LEADER].reports["a1"]) > 0
    assert played.nets["company"].datagrams >= reports


def test_every_computer_reports_its_links_within_budget(played: Played) -> None:
    for computer, nets in (("a1", {"squad"}), (LEADER, {"squad", "company"}), (COMMAND_POST, {"company"})):
        links = played.heard[computer].links
        assert set(links) == nets
        for link in links.values():
            assert link.bits_per_s <= link.budget_bits_per_s
            assert link.frames_lost == 0


def test_hubs_pay_for_every_byte_that_the_air_carries(played: Played) -> None:
    for net, counts in played.nets.items():
        paid = [heard.links[net] for heard in played.heard.values() if net in heard.links]
        sent = sum(link.frames_sent for link in paid)
        assert counts.datagrams > 0
        # A hub reports once a second: what it sent after its last report, the net has counted already.
        assert 0 <= counts.datagrams - sent <= 2
        if counts.datagrams == sent:
            assert sum(link.bytes_sent for link in paid) == counts.bytes


def test_every_service_ran_as_its_own_process(played: Played) -> None:
    assert played.processes == 6
    assert set(played.heard["a1"].health) == {"sensor-gateway", "pdr-engine", "fusion", "sa-hub"}


def test_logs_hold_no_traceback(played: Played) -> None:
    logs = list(played.folder.rglob("*.log"))
    assert len(logs) == 6
    assert [log for log in logs if "Traceback" in log.read_text()] == []
