"""Storms of faults, and what is said of them: by hand, without a process."""

import json
import shutil
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import msgspec
import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.geodesy import LocalFrame
from bootprint.messages import Health, Track
from bootprint.topics import Identity
from proving_ground.exercises.event_time.inprocess_play import line_job
from proving_ground.exercises.event_time.line import Line, play_line
from proving_ground.exercises.exercise import Exercise, Fault, Soldier
from proving_ground.exercises.faults import reliability_page
from proving_ground.exercises.faults.memory_growth import memory_growth
from proving_ground.exercises.faults.process_faults import Outage
from proving_ground.exercises.faults.recovery import fault_rows, storm_summary
from proving_ground.exercises.faults.storm import KINDS, NEXT_AFTER_S, over_at_s, with_storm
from proving_ground.exercises.processes.emulated_radio import Air, NetProfile, Parting
from proving_ground.exercises.processes.observer import in_umpires_time
from proving_ground.exercises.scoring.heard import Heard
from proving_ground.exercises.squad import COMMAND_POST, squad_of
from proving_ground.positions import position_at
from sensor_gateway.recordings.run import Truth
from support.golden import ORIGIN, START, TESTS, small_walk

RUN = small_walk()
SOLDIER = Soldier("a1", 1, "Adler", RUN, RUN.truth["body"], START, simulated=True)
SQUAD = replace(squad_of((SOLDIER,), "storm"), origin=ORIGIN)
CP = Identity("storm", "hq", COMMAND_POST)
LASTS_S = 60.0
STALE_S = 5.0


def long_squad(lasts_s: float) -> Exercise:
    """The squad in an exercise that lasts."""

    class Lasting(Exercise):
        duration_s = property(lambda self: lasts_s)  # type: ignore[assignment]

    values = {name: getattr(SQUAD, name) for name in Exercise.__dataclass_fields__}
    return Lasting(**values)


def test_a_storm_brings_every_kind_once_before_any_twice_and_one_at_a_time() -> None:
    faults = with_storm(long_squad(1500.0), seed=7).faults
    assert len(faults) > len(KINDS)
    assert len(
        {
            (f.kind, f.details.get("process") if f.kind == "process_killed" else "")
            for f in faults[: len(KINDS)]
        }
    ) == len(KINDS)
    for one, following in pairwise(faults):
        assert following.at_s == pytest.approx(over_at_s(one) + NEXT_AFTER_S)
    assert over_at_s(faults[-1]) <= 1500.0 - NEXT_AFTER_S
    assert with_storm(long_squad(1500.0), seed=7).faults == faults
    assert with_storm(long_squad(1500.0), seed=8).faults != faults


def heard_reports(spans: list[tuple[float, float]], off_m: float = 0.0, sigma_m: float = 1.0) -> Heard:
    """A post that is told of a soldier who stands still once a second, but in these spans."""
    heard, frame = Heard(), LocalFrame(ORIGIN)
    for second in range(int(LASTS_S)):
        if any(begin <= second < end for begin, end in spans):
            continue
        latitude, longitude, height = frame.to_geodetic(off_m if second >= 30 else 0.0, 0.0, 0.0)
        track = Track(
            time_ns=second * NS_PER_S,
            soldier="a1",
            number=1,
            state="fresh",
            latitude_deg=latitude,
            longitude_deg=longitude,
            height_m=height,
            accuracy_m=sigma_m,
            received_ns=second * NS_PER_S,
        )
        heard.take(Envelope(CP.address("track", "a1"), track), second * NS_PER_S, frame)
    return heard


def rows_of(post: Heard, fault: Fault, outages: tuple[Outage, ...] = (), own: Heard | None = None) -> dict:
    still = replace(SOLDIER, truth=Truth(np.array([0.0, LASTS_S]), np.zeros((2, 3))))
    exercise = replace(SQUAD, soldiers=(still,), faults=(fault,))
    heard = {COMMAND_POST: post, "a1": own or Heard()}
    (row,) = fault_rows(exercise, heard, outages, 0, LASTS_S, STALE_S)
    return row


def test_a_picture_is_right_again_when_everybody_is_fresh_again() -> None:
    """Silent from 20 s to 33 s, stale 5 s after the report of 19 s; the fault ends at 30 s."""
    row = rows_of(heard_reports([(20, 33)]), Fault(20.0, "radio_gone", "a1", {"for_s": 10.0}))
    assert row["right_after_s"] == pytest.approx(3.0)
    assert row["wrong_s"] == pytest.approx(33.0 - 24.0)


@pytest.mark.parametrize("wrong_s", [0, -3600, 3600])
@pytest.mark.parametrize("republished_s", [0, 90])
def test_reports_of_a_hub_whose_clock_is_wrong_are_as_old_as_it_shows_them(
    wrong_s: int, republished_s: int
) -> None:
    """Of second 7, received at 9, looked at now or when it was told again as lost."""
    (track,) = heard_reports([]).newest.values()
    told = msgspec.structs.replace(
        track, time_ns=(7 + wrong_s) * NS_PER_S, received_ns=(9 + wrong_s) * NS_PER_S
    )
    ours = in_umpires_time(told, (9 + republished_s) * NS_PER_S, {-3600.0, 3600.0})
    assert (ours.time_ns, ours.received_ns) == (7 * NS_PER_S, 9 * NS_PER_S)


def test_an_exercise_tells_whose_clock_it_sets_wrong() -> None:
    faults = [
        Fault(at_s, "clock_jump", "a1", {"jump_s": jump_s}) for at_s, jump_s in ((5, 3600.0), (9, -60.0))
    ]
    assert replace(SQUAD, faults=tuple(faults)).clock_jumps_s == {"a1": {3600.0, -60.0}}
    assert SQUAD.clock_jumps_s == {}


def test_a_picture_that_is_fresh_and_wrong_is_not_right_and_honest_if_it_owns_up_to_it() -> None:
    """From 30 s on the soldier is shown 50 m off, with a metre's doubt, or with one of 40 m (95 %: 98 m)."""
    row = rows_of(heard_reports([], off_m=50.0), Fault(28.0, "radio_gone", "a1", {"for_s": 2.0}))
    assert (row["right_after_s"], row["honest_after_s"]) == (None, None)
    doubtful = rows_of(heard_reports([], 50.0, sigma_m=40.0), Fault(28.0, "radio_gone", "a1", {"for_s": 2.0}))
    assert (doubtful["right_after_s"], doubtful["honest_after_s"]) == (None, 0.0)
    assert (
        rows_of(heard_reports([], off_m=9.0), Fault(28.0, "radio_gone", "a1", {"for_s": 2.0}))[
            "right_after_s"
        ]
        == 0.0
    )


def test_who_was_gone_how_long_and_which_positions_were_never_told() -> None:
    fault = Fault(20.0, "process_killed", "a1", {"process": "fusion"})
    own, frame = Heard(), LocalFrame(ORIGIN)
    for count in range(300):
        if not 105 <= count < 110:  # from 21 s to 22 s
            place = frame.to_geodetic(0.0, 0.0, 0.0)
            own.positions.append(position_at(count * NS_PER_S // 5, (0.0, 0.0, 0.0), place, (1.0, 1.0, 1.0)))
    outages = (Outage(fault, "a1", "fusion", 100.0, back_s=103.5), Outage(None, "a1", "sa-hub", 200.0))
    row = rows_of(heard_reports([]), fault, outages, own)
    assert row["down_s"] == pytest.approx(3.5)
    assert row["positions_missing"] == 5
    summary = storm_summary([row], outages)
    assert summary["down_s_worst"] == float("inf")  # the hub never came back
    assert (summary["faults"], summary["not_right_within_10_s"], summary["positions_missing"]) == (1, 0, 5)


def test_memory_growth_is_a_line_through_each_life_once_it_has_settled() -> None:
    """100 MB that grow by 1 MB in 600 s, an hour after the start: 6 %/h; a second life is too short."""
    heard = Heard()
    for second in range(0, 5401, 10):
        size_mb = 50.0 if second < 3600 else 100.0 + (second - 3600) / 600.0
        health = Health(
            time_ns=second * NS_PER_S,
            sequence=second + 1,
            service="fusion",
            state="ok",
            gauges={"memory_mb": size_mb},
        )
        heard.take(Envelope(CP.address("health", "fusion"), health), 0, LocalFrame(ORIGIN))
    again = Health(
        time_ns=5401 * NS_PER_S, sequence=1, service="fusion", state="ok", gauges={"memory_mb": 40.0}
    )
    heard.take(Envelope(CP.address("health", "fusion"), again), 0, LocalFrame(ORIGIN))
    found = memory_growth({COMMAND_POST: heard})
    assert found["memory_growth_worst_pct_per_h"] == pytest.approx(6.0, rel=1e-6)
    assert found["memory_growth_lives"] == 1


def test_a_net_in_two_parts_carries_nothing_between_them() -> None:
    apart = [Parting(frozenset({"a", "b"}), 5.0, 6.0)]
    air = Air(NetProfile("n", 1e9, latency_s=0.0), ["a", "b", "c", "d"], zero_s=0.0, partings=apart)
    for now_s, sender, hear in ((4.9, "a", "bcd"), (5.0, "a", "b"), (5.5, "c", "d"), (6.0, "c", "abd")):
        air.transmit(sender, b"x", now_s)
        assert "".join(sorted(one.member for one in air.arrived(now_s + 0.01))) == hear, now_s


def played(*faults: Fault) -> Line:
    exercise = replace(SQUAD, faults=faults)
    start_ns = exercise.begins_ns
    return play_line(line_job(exercise, SOLDIER, start_ns, start_ns + 24 * NS_PER_S, False))


def test_a_line_whose_engine_is_killed_in_the_corner_tells_the_same_steps_and_ends_at_the_same_place() -> (
    None
):
    whole = played()
    killed = played(Fault(14.0, "process_killed", "a1", {"process": "pdr-engine"}))
    for place, steps in whole.steps.items():
        again = {step.sequence: step for step in killed.steps[place]}
        assert [again[step.sequence] for step in steps] == steps
    last, other = whole.positions[-1][1], killed.positions[-1][1]
    assert other.time_ns == last.time_ns
    assert np.hypot(other.east_m - last.east_m, other.north_m - last.north_m) < 0.1
    assert other.course_rad == pytest.approx(last.course_rad, abs=0.02)


def test_a_power_cut_takes_the_samples_too_and_the_line_goes_on() -> None:
    cut = played(Fault(8.0, "power_cut", "a1", {"for_s": 4.0}))
    times_s = np.array([(position.time_ns - SQUAD.begins_ns) / NS_PER_S for _, position in cut.positions])
    assert np.count_nonzero(times_s > 14.0) > 40
    assert cut.positions[-1][1].mode != "unplaced"


def test_the_page_of_reliability_is_what_its_maker_makes_and_names_tests_that_are_there(
    tmp_path: Path,
) -> None:
    docs = TESTS.parent / "docs"
    shutil.copy(docs / "reliability.json", tmp_path)
    reliability_page.main(tmp_path, [])
    assert (tmp_path / "reliability.md").read_text() == (docs / "reliability.md").read_text()


def test_a_storm_s_result_is_put_beside_the_faults_it_belongs_to(tmp_path: Path) -> None:
    row = {"target": "a1", "wrong_s": 0.0, "positions_missing": 0, "honest_after_s": 0.5}
    faults = [
        {"fault": "process_killed", "details": "process fusion", "down_s": 1.5, "right_after_s": 2.0, **row},
        {"fault": "process_killed", "details": "process fusion", "down_s": 2.5, "right_after_s": None, **row},
    ]
    result = tmp_path / "result.json"
    result.write_text(
        json.dumps({"exercise": "x", "duration_s": 60.0, "faults": faults, "faults_summary": {}})
    )
    reliability_page.main(tmp_path, [result])
    (line,) = [
        one for one in (tmp_path / "reliability.md").read_text().splitlines() if "9 of fusion |" in one
    ]
    assert line.endswith("| 2 | 2 (2.5) | 0 (0) | 2 (2), 1 never | 0.5 (0.5) | 0 (0) |")
