"""Exercises in one process: the same bytes for the same seed, and radio that behaves as it is told."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bootprint.errors import ConfigError
from bootprint.geodesy import LocalFrame
from bootprint.messages import Position
from bootprint.recording import Recording
from proving_ground.exercises.event_time.inprocess_play import line_job, play_in_process
from proving_ground.exercises.event_time.line import play_line
from proving_ground.exercises.exercise import Exercise, Fault, Net
from proving_ground.exercises.processes.emulated_radio import Air, NetProfile
from proving_ground.exercises.processes.exercise_files import hub_settings, soldier_settings
from proving_ground.exercises.reporting.report import write_report
from proving_ground.exercises.scoring.result import Played, Result, result_of
from proving_ground.exercises.scoring.score import fused_track
from proving_ground.exercises.scoring.truth_record import TRUTH_REALM
from proving_ground.exercises.settings import with_settings
from proving_ground.exercises.squad import COMMAND_POST, LEADER, simulated_squad
from proving_ground.inprocess import play_run, positions_of

LENGTH_S = 30.0
S = 1_000_000_000


@pytest.fixture(scope="module")
def squad() -> Exercise:
    """Two of the four, for the tests' sake."""
    exercise = simulated_squad(seed=3)
    return replace(
        exercise,
        soldiers=exercise.soldiers[:2],
        nets=tuple(
            replace(net, members=tuple(m for m in net.members if m not in ("a3", "a4")))
            for net in exercise.nets
        ),
    )


def played(exercise: Exercise, **options: object) -> Result:
    return result_of(play_in_process(exercise, duration_s=LENGTH_S, **options), {"mode": "inprocess"})  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def plain(squad: Exercise) -> Result:
    return played(squad)


def with_net(exercise: Exercise, name: str, **changes: object) -> Exercise:
    nets = tuple(
        replace(net, **changes) if net.profile.name == name else net  # type: ignore[arg-type]
        for net in exercise.nets
    )
    return replace(exercise, nets=nets)


def arrivals_s(result: Result, receiver: str, soldier: str) -> list[float]:
    log = result.played.heard[receiver].reports.get(soldier)
    return [] if log is None else [float(value) for value in log.told(result.played.start_ns).arrived_s]


def test_the_same_seed_gives_the_same_bytes_whatever_the_workers(
    squad: Exercise, plain: Result, tmp_path: Path
) -> None:
    write_report(tmp_path / "alone", plain)
    write_report(tmp_path / "pool", played(squad, workers=2))
    for name in ("result.json", "report.html"):
        assert (tmp_path / "alone" / name).read_bytes() == (tmp_path / "pool" / name).read_bytes()


def test_the_result_holds_designs_figures_and_no_host_time(plain: Result) -> None:
    figures = plain.figures
    assert [row["soldier"] for row in figures["soldiers"]] == ["a1", "a2"]
    assert [row["receiver"] for row in figures["pictures"]] == [COMMAND_POST, "a1", "a2", LEADER]
    assert {row["link"] for row in figures["links"]} == {
        "a1/squad", "a2/squad", "a0/squad", "a0/company", "cp/company"
    }  # fmt: skip
    for row in figures["soldiers"]:
        assert row["position_error_p95_m"] < 1.0
        assert row["dead_reckoning_error_p95_m"] < 1.0
        assert row["inside_95_pct"] > 80.0
    assert "latency_p99_ms" not in figures
    assert "usage" not in figures


def test_the_report_needs_no_other_file(plain: Result, tmp_path: Path) -> None:
    write_report(tmp_path, plain)
    page = (tmp_path / "report.html").read_text()
    assert page.count("<svg") >= 5
    for word in (
        "Map",
        "Error over time",
        "Error against distance",
        "How often how wrong",
        "Radio use",
        "Event log",
    ):
        assert f">{word}</h2>" in page
    assert 'src="' not in page
    assert json.loads((tmp_path / "result.json").read_text()) == plain.figures


def test_a_line_is_what_the_bus_makes_of_it(squad: Exercise) -> None:
    """Routing without a bus gives the very positions that cores on a `MemoryBus` give."""
    soldier, start_ns = squad.soldiers[0], squad.begins_ns
    line = play_line(line_job(squad, soldier, start_ns, start_ns + round(LENGTH_S * S), False))
    pdr, fusion = soldier_settings(squad, soldier)
    bus = play_run(soldier.run, squad.identity(soldier.id), squad.origin, pdr, fusion, start_ns)
    expected = {position.time_ns: position for position in positions_of(bus)}
    positions = [position for _, position in line.positions]
    assert len(positions) > 5 * (LENGTH_S - 2.0)
    assert all(expected[position.time_ns] == position for position in positions)
    waited_s = [(out_ns - position.time_ns) / S for out_ns, position in line.positions]
    assert 0.0 < min(waited_s) <= max(waited_s) < 1.5


def test_an_outage_silences_the_net_for_its_time_only(squad: Exercise) -> None:
    cut = played(with_net(squad, "squad", outages_s=((8.0, 20.0),)))
    arrivals = arrivals_s(cut, LEADER, "a1")
    assert any(time_s < 8.0 for time_s in arrivals)
    assert not any(8.3 < time_s < 20.0 for time_s in arrivals)
    assert any(time_s > 20.0 for time_s in arrivals)
    events = {(event.time_s, event.what) for event in cut.events}
    assert {(8.0, "the net is down"), (20.0, "the net is up again")} <= events


def test_a_radio_that_is_gone_is_not_heard_while_the_others_are(squad: Exercise) -> None:
    gone = replace(squad, faults=(Fault(8.0, "radio_gone", "a1", {"for_s": 60.0}),))
    result = played(gone)
    assert max(arrivals_s(result, LEADER, "a1")) < 8.3
    assert max(arrivals_s(result, LEADER, "a2")) > 20.0


def test_loss_takes_its_share_of_deliveries_and_makes_pictures_worse(squad: Exercise, plain: Result) -> None:
    result = played(with_settings(squad, {"net.loss": 0.5}))
    counts = result.played.nets["squad"]
    assert 0.3 < counts.lost / (counts.lost + counts.delivered) < 0.7
    assert plain.played.nets["squad"].lost == 0
    first, second = (each.figures["pictures"][0]["picture_error_p95_m"] for each in (plain, result))
    assert second > first
    assert sum(row["lost"] for row in result.figures["links"]) > 0


def test_a_fusion_that_is_killed_is_silent_and_comes_back(squad: Exercise) -> None:
    killed = replace(squad, faults=(Fault(10.0, "process_killed", "a1", {"process": "fusion"}),))
    job = line_job(killed, killed.soldiers[0], 0, round(LENGTH_S * S), False)
    out_s = np.array([out_ns / S for out_ns, _ in play_line(job).positions])
    assert not ((out_s > 10.0) & (out_s < 12.0)).any()
    assert ((out_s > 12.0) & (out_s < 13.0)).any()
    assert out_s.max() > LENGTH_S - 0.5


def test_a_position_told_twice_counts_as_it_was_told_first(squad: Exercise) -> None:
    """A fusion that comes back makes up positions of the past, from the events that the bus keeps for it."""
    killed = replace(squad, faults=(Fault(10.0, "process_killed", "a1", {"process": "fusion"}),))
    heard = played(killed).played.heard["a1"].positions
    times = [position.time_ns for position in heard]
    assert len(times) > len(set(times))
    track = fused_track(heard, squad.begins_ns)
    assert track is not None
    assert (np.diff(track.time_s) > 0.0).all()


def test_a_hub_that_is_killed_is_heard_again_under_fresh_counters(squad: Exercise) -> None:
    result = played(replace(squad, faults=(Fault(10.0, "process_killed", "a1", {"process": "sa-hub"}),)))
    arrivals = arrivals_s(result, LEADER, "a1")
    assert not any(10.3 < time_s < 12.0 for time_s in arrivals)
    assert any(time_s > 12.0 for time_s in arrivals)
    assert result.played.heard[LEADER].links["squad"].frames_rejected == 0, "counters came twice"


def test_a_gateway_that_is_killed_costs_its_soldier_two_seconds_of_samples(squad: Exercise) -> None:
    """Each foot owns up to one step that it did not see, and the walk goes on."""
    fault = Fault(10.0, "process_killed", "a1", {"process": "sensor-gateway"})
    heard = played(replace(squad, faults=(fault,))).played.heard["a1"]
    for steps in heard.steps.values():
        assert [step.realigned for step in steps].count(True) == 1
    late = [position for position in heard.positions if position.time_ns > squad.begins_ns + 15 * S]
    assert {position.mode for position in late} <= {"boots", "gnss"}
    assert len(late) > 20


def test_a_recording_holds_everything_and_the_truth_apart(squad: Exercise, tmp_path: Path) -> None:
    file = tmp_path / "exercise.mcap"
    play = play_in_process(squad, duration_s=5.0, record=file)
    envelopes = [envelope for _, envelope in Recording(file).envelopes()]
    heard = {(e.address.realm, e.address.soldier, e.address.subject) for e in envelopes}
    for subject in ("imu", "gnss", "foot_step", "foot_pose", "position", "track", "link"):
        assert ("exercise", "a1", subject) in heard
    assert ("exercise", COMMAND_POST, "track") in heard
    assert {realm for realm, *_ in heard} == {"exercise", TRUTH_REALM}
    truths = [
        e.message
        for e in envelopes
        if e.address.realm == TRUTH_REALM and e.address.soldier == "a2" and isinstance(e.message, Position)
    ]
    truth = squad.soldiers[1].truth
    assert len(truths) == truth.time_s.size
    assert (truths[7].east_m, truths[7].north_m) == pytest.approx(tuple(truth.position_m[7, :2]))
    assert truths[7].time_ns == play.start_ns + round(truth.time_s[7] * S)
    frame = LocalFrame(squad.origin)
    back = frame.to_enu(truths[7].latitude_deg, truths[7].longitude_deg, truths[7].height_m)
    assert back[:2] == pytest.approx(tuple(truth.position_m[7, :2]), abs=1e-6)


def test_wrong_parameters_are_named(squad: Exercise) -> None:
    for settings, expected in (
        ({"net.los": 0.1}, "net.los: unknown; known: rate_bits_per_s"),
        ({"net.loss": 2}, "want a number from 0 to 0.9"),
        ({"net.profile": "vhf-12000"}, "no radio profile 'vhf-12000'; did you mean 'vhf-1200'"),
        ({"hub.treshold_m": 3}, "treshold_m"),
        ({"fusion.rate_hz": 0.1}, "rate_hz"),
        ({"loss": 0.1}, "want one of net"),
    ):
        with pytest.raises(ConfigError, match=expected):
            with_settings(squad, settings)


def test_every_net_can_be_made_one_of_a_named_radio(squad: Exercise) -> None:
    changed = with_settings(squad, {"net.loss": 0.2, "net.profile": "lora-short-fast"})
    for net in changed.nets:
        assert (net.profile.rate_bits_per_s, net.profile.latency_s, net.profile.loss) == (10_937.0, 0.05, 0.2)
        for member in net.members:
            link = next(link for link in hub_settings(changed, member).links if link.name == net.profile.name)
            assert (link.profile, link.channel_bits_per_s) == ("lora-short-fast", 10_937)
            assert link.rate_bits_per_s <= 1092  # the duty cycle's, whatever the share of the net


# -- the air itself, by hand --------------------------------------------------------------------------------------


def test_a_datagram_takes_its_time_on_the_air_and_the_next_one_waits() -> None:
    """1000 bit/s, headers of 5 bytes: 20 bytes take 0.2 s, then a latency of 0.1 s; the second queues behind."""
    air = Air(NetProfile("n", 1000.0, latency_s=0.1, header_bytes=5), ["a", "b", "c"], zero_s=0.0)
    air.transmit("a", bytes(20), 10.0)
    air.transmit("b", bytes(20), 10.05)
    assert air.next_due_s == pytest.approx(10.3)
    assert [d.member for d in air.arrived(10.31)] == ["b", "c"]
    assert [(d.member, round(d.due_s, 6)) for d in air.arrived(11.0)] == [("a", 10.5), ("c", 10.5)]
    assert (air.counts.datagrams, air.counts.bytes, air.counts.delivered) == (2, 50, 4)


def test_silences_begin_with_the_exercise() -> None:
    air = Air(NetProfile("n", 1e6, latency_s=0.0), ["a", "b"], [("", 0.0, 5.0), ("a", 6.0, 7.0)])
    air.transmit("a", b"before the zero is known", 3.0)
    assert len(air.arrived(4.0)) == 1
    air.zero_s = 100.0
    for now_s, heard in ((99.9, 1), (100.0, 0), (104.9, 0), (105.1, 1), (106.5, 0), (107.0, 1)):
        air.transmit("a", b"x", now_s)
        assert len(air.arrived(now_s + 0.05)) == heard, now_s


def test_what_an_outage_swallows_does_not_change_what_is_lost_later() -> None:
    def lost(silences: list[tuple[str, float, float]]) -> list[int]:
        air = Air(NetProfile("n", 1e9, latency_s=0.0, loss=0.5, seed=4), ["a", "b"], silences, zero_s=0.0)
        heard = []
        for number in range(100):
            air.transmit("a", b"x", float(number))
            heard.append(len(air.arrived(number + 0.5)))
        return heard

    assert lost([("", 0.0, 50.0)])[50:] == lost([])[50:]


def test_shares_of_a_net_leave_it_room() -> None:
    net = Net(NetProfile("n", 9600.0), ("a1", "a2", LEADER))
    exercise = replace(simulated_squad(), nets=(net,))
    budgets = [exercise.budget(net, member) for member in net.members]
    assert budgets == [1536, 1536, 4608]  # 0.8 · 9600 by weights 1, 1, 3
    assert sum(budgets) <= 9600


def test_played_is_told_its_duration(squad: Exercise, plain: Result) -> None:
    assert isinstance(plain.played, Played)
    assert plain.figures["duration_s"] == LENGTH_S
