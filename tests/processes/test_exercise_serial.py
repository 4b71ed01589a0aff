"""A soldier's sensors as MAVLink bytes on a pseudo-terminal, read by the real gateway: the serial path."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from bootprint.stopping import Stop
from proving_ground.exercises.exercise import Fault
from proving_ground.exercises.processes.stage import Play, Stage
from proving_ground.exercises.scoring.heard import Heard
from proving_ground.exercises.scoring.result import Played, Result, result_of
from proving_ground.exercises.squad import COMMAND_POST, simulated_squad, squad_of
from support.waiting import wait_until

pytestmark = [pytest.mark.processes, pytest.mark.xdist_group("processes"), pytest.mark.timeout(180)]
LENGTH_S = 14.0
KILLED_S = 8.0


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Result]:
    """One soldier walks for a while; the hub of the command post is killed on the way."""
    folder: Path = tmp_path_factory.mktemp("serial")
    fault = Fault(KILLED_S, "process_killed", COMMAND_POST, {"process": "sa-hub"})
    exercise = replace(squad_of(simulated_squad(seed=2).soldiers[:1], "serial"), faults=(fault,))
    with Stage(exercise, Play(folder, serial=True)) as stage:
        stage.wait_ready(Stop())
        stage.start_walks(Stop())

        def is_over() -> bool:
            stage.play_faults()
            stage.processes.check()
            return stage.elapsed_s > LENGTH_S

        wait_until(is_over, timeout_s=60.0, what="the walk's end")
        wait_until(
            lambda: "sa-hub" in stage.observers.alive(COMMAND_POST), timeout_s=30.0, what="the hub is back"
        )
        stage.end()
        nets = {name: net.counts for name, net in stage.nets.items()}
        yield result_of(
            Played(exercise, stage.start_ns, LENGTH_S, stage.observers.heard(), nets), {"mode": "test"}
        )


@pytest.fixture
def soldier(result: Result) -> Heard:
    return result.played.heard["a1"]


def test_the_gateway_reads_both_feet_and_the_receiver_without_a_fault(soldier: Heard) -> None:
    health = soldier.health["sensor-gateway"]
    counters = {name.removeprefix("serial0."): count for name, count in health.counters.items()}
    assert counters["opened"] == 1
    assert counters["frames"] > 2 * 200 * (LENGTH_S - 1.0)
    for fault in ("lost", "imu_incomplete", "messages_invalid", "not_finite", "stamps_back", "clock_steps"):
        assert counters.get(fault, 0) == 0, fault
    assert set(soldier.steps) == {"left_foot", "right_foot"}


def test_positions_from_the_line_are_as_good_as_replayed_ones(result: Result) -> None:
    row = result.figures["soldiers"][0]
    assert row["distance_m"] > 8.0
    assert row["position_error_p95_m"] < 1.0
    assert row["inside_95_pct"] > 80.0


def test_a_killed_hub_is_replaced_and_says_so(result: Result) -> None:
    assert result.played.heard[COMMAND_POST].health["sa-hub"].state in ("ok", "stopped")
    log = result.played.heard[COMMAND_POST].reports["a1"]
    arrived_s = log.told(result.played.start_ns).arrived_s
    assert any(time_s < KILLED_S for time_s in arrived_s)
    assert not any(KILLED_S + 0.3 < time_s < KILLED_S + 2.0 for time_s in arrived_s)
