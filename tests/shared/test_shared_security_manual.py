"""docs/security.md against the code: its commands, options, counters and settings exist."""

import re
import tomllib
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from bootprint.commands import keys as commands
from bootprint.config import ComputerFile, convert
from bootprint.keys.guard import KINDS
from sa_hub import commands as hub_commands

MANUAL = (Path(__file__).parents[2] / "docs" / "security.md").read_text(encoding="utf-8")
USED = sorted(set(re.findall(r"bootprint (keys \w+|page token)((?: [^`#\n]*)?)", MANUAL)))


@pytest.fixture(scope="module")
def app() -> typer.Typer:
    made = typer.Typer()
    commands.register(made)
    hub_commands.register(made)
    return made


@pytest.mark.parametrize(("command", "arguments"), USED)
def test_every_command_and_option_exists(app: typer.Typer, command: str, arguments: str) -> None:
    told = CliRunner().invoke(app, [*command.split(), "--help"], env={"COLUMNS": "200"})
    assert told.exit_code == 0, told.output
    for option in re.findall(r"--[a-z-]+", arguments):
        assert option in told.output


def test_all_commands_of_keys_are_told(app: typer.Typer) -> None:
    group = next(each.typer_instance for each in app.registered_groups if each.name == "keys")
    assert group is not None
    names = {str(each.name or getattr(each.callback, "__name__", "")) for each in group.registered_commands}
    assert names == {command.split()[1] for command, _ in USED if command.startswith("keys")}


def test_the_counters_of_the_guard_are_those_of_its_health() -> None:
    assert {f"refused_{kind}" for kind in KINDS} == set(re.findall(r"`(refused_[a-z_]+)`", MANUAL))


def test_the_settings_are_a_computers() -> None:
    (block,) = re.findall(r"```toml\n(.*?)```", MANUAL, re.DOTALL)
    values = {"realm": "realm.toml", "soldier": "a3", **tomllib.loads(block)}
    assert convert(values, ComputerFile, "manual").bus.connect == ("tls/post-b.example:7447",)
