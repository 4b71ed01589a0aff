"""An exercise's command post serves its page where it was asked to, on the exercise's own plan."""

import tomllib
from pathlib import Path

from proving_ground.exercises.demo import page_port
from proving_ground.exercises.exercise_files import Ports, write_computer, write_plan
from proving_ground.exercises.shown_play import walked_exercise


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
    assert hubs["cp"]["history"] == {}


def test_a_page_is_served_where_asked_or_where_somebody_looks() -> None:
    assert page_port(None, headless=False) == 8080
    assert page_port(None, headless=True) is None
    assert page_port(0, headless=True) == 0
