"""An exercise's command post serves its page where it was asked to, on the exercise's own plan."""

import tomllib
from contextlib import closing
from pathlib import Path

from proving_ground.exercises.demo import page_port
from proving_ground.exercises.event_time.shown_play import walked_exercise
from proving_ground.exercises.processes.exercise_files import (
    Ports,
    forget_history,
    write_computer,
    write_plan,
)
from sa_hub.history.archive import Archive


def test_only_the_command_post_is_given_a_page_with_plan_and_history(tmp_path: Path) -> None:
    exercise, _ = walked_exercise("building-clearing", 1)
    members = {net.profile.name: dict.fromkeys(net.members, 7000) for net in exercise.nets}
    ports = Ports(members, dict.fromkeys(members, 7001), page=8123)
    write_plan(tmp_path, exercise)
    hubs = {}
    for computer in exercise.computers:
        write_computer(tmp_path, exercise, computer, "tcp/127.0.0.1:7447", ports)
        hubs[computer] = tomllib.loads((tmp_path / computer / "computer.toml").read_text())["hub"]
    assert {computer for computer, hub in hubs.items() if "page" in hub} == {"cp"}
    assert hubs["cp"]["page"]["port"] == 8123
    assert (tmp_path / "cp" / hubs["cp"]["page"]["plan"]).is_file()
    assert hubs["cp"]["history"] == {"url": "sqlite:///state/history.db"}


def test_the_last_play_s_history_is_forgotten_and_its_radio_counters_are_not(tmp_path: Path) -> None:
    state = tmp_path / "cp" / "state"
    (state / "radio").mkdir(parents=True)
    counters = state / "radio" / "company.counters"
    counters.touch()
    with closing(Archive(f"sqlite:///{state / 'history.db'}")) as archive:
        assert (state / "history.db-wal").exists()
        assert archive.span_ns() is None
        forget_history(tmp_path)
    assert [path for path in state.rglob("*") if path.is_file()] == [counters]


def test_a_page_is_served_where_asked_or_where_somebody_looks() -> None:
    assert page_port(None, headless=False) == 8080
    assert page_port(None, headless=True) is None
    assert page_port(0, headless=True) == 0
