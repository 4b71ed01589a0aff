"""The documents against the code: commands and options that they name exist, counters too, examples load."""

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer

from bootprint.cli import build_app
from bootprint.config import ComputerFile, Realm, convert
from fusion.config import FusionConfig
from pdr_engine.config import PdrConfig
from sa_hub.settings import HubSettings
from sensor_gateway.settings import GatewaySettings

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([ROOT / "README.md", ROOT / "ARCHITECTURE.md", *(ROOT / "docs").glob("*.md")])
SECTIONS = {"gateway": GatewaySettings, "pdr": PdrConfig, "fusion": FusionConfig, "hub": HubSettings}
COMMANDS: Any = typer.main.get_command(build_app())


@cache
def commands_for(first: str) -> Any:
    """What a process has that is started with this word: it need not load everything."""
    return typer.main.get_command(build_app([first]))


def code_of(document: Path) -> Iterator[str]:
    """Lines of shell blocks without their comments, and what stands between backticks."""
    text = document.read_text(encoding="utf-8")
    for block in re.findall(r"```(?:sh|console)\n(.*?)```", text, re.DOTALL):
        yield from (line.split(" #")[0] for line in block.replace("\\\n", " ").splitlines())
    yield from re.findall(r"`([^`\n]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL))


def commands_in(code: str) -> Iterator[list[str]]:
    """Words after each ``bootprint`` of a line; ``a|b`` are two commands."""
    for told in re.findall(r"(?:^|&& |; |/bin/|exec [a-z-]+ )bootprint ((?:[a-z]|--).*?)(?=&& |; |$)", code):
        words = told.split()
        for first in words[0].split("|"):
            second = words[1].split("|") if len(words) > 1 and re.fullmatch(r"[a-z|]+", words[1]) else [None]
            yield from ([first, *([each] if each else []), *words[1 + bool(second[0]) :]] for each in second)


USED = sorted(
    {
        (document.name, " ".join(words))
        for document in DOCUMENTS
        for code in code_of(document)
        for words in commands_in(code)
        if "|<" not in code  # a label of a key, no command
    }
)


@pytest.mark.parametrize(("document", "used"), USED)
def test_every_command_and_option_exists(document: str, used: str) -> None:
    words = used.split()
    command = commands_for(words[0])
    while hasattr(command, "commands") and words and not words[0].startswith("-"):
        assert words[0] in command.commands, f"{document}: bootprint {used}"
        command = command.commands[words.pop(0)]
    options = {name for parameter in command.params for name in parameter.opts}
    named = [word.split("=")[0] for word in words if re.match(r"--[a-z]", word)]
    assert [name for name in named if name not in options] == [], f"{document}: bootprint {used}"


@pytest.mark.parametrize("name", sorted(COMMANDS.commands))
def test_a_command_has_all_its_subcommands_when_it_alone_is_asked_for(name: str) -> None:
    whole, alone = (app.commands[name] for app in (COMMANDS, commands_for(name)))
    assert sorted(getattr(alone, "commands", ())) == sorted(getattr(whole, "commands", ()))


def test_most_commands_are_in_the_manual() -> None:
    told = {tuple(used.split()[:1]) for document, used in USED if document in ("manual.md", "deployment.md")}
    assert {name for name in COMMANDS.commands if (name,) not in told} == set()


def test_the_manual_s_examples_are_a_realm_and_a_computer() -> None:
    manual = (ROOT / "docs/manual.md").read_text(encoding="utf-8")
    realm, computer, *_ = (
        tomllib.loads(block) for block in re.findall(r"```toml\n(.*?)```", manual, re.DOTALL)
    )
    assert convert(realm, Realm, "manual").member("a1").callsign == "Adler"
    assert convert(computer, ComputerFile, "manual").soldier == "a1"
    for name, type_ in SECTIONS.items():
        convert(computer.get(name, {}), type_, f"manual: [{name}]")


def test_counters_and_gauges_that_the_manual_explains_are_counted_somewhere() -> None:
    """By the end of their names: `radio_forged` is ``f"radio_{name}"`` of a net that counts ``forged``."""
    table = (ROOT / "docs/manual.md").read_text(encoding="utf-8").split("## When something is wrong")[1]
    named = set(re.findall(r"counters? `([a-z_]+)`", table))
    rooms = [ROOT / "shared/src", *(ROOT / "services").glob("*/src")]
    source = "\n".join(path.read_text(encoding="utf-8") for room in rooms for path in room.rglob("*.py"))
    ends = {name: [name.split("_", cut)[-1] for cut in range(name.count("_") + 1)] for name in named}
    unknown = [name for name in named if not any(f'"{end}"' in source for end in ends[name])]
    assert named
    assert unknown == []


def test_the_glossary_is_in_the_order_of_the_alphabet() -> None:
    words = re.findall(
        r"^\| ([^|]+) \|", (ROOT / "docs/glossary.md").read_text(encoding="utf-8"), re.MULTILINE
    )[1:]
    assert len(words) > 100
    keys = [word.split(",")[0].lower().replace("-", " ") for word in words]
    assert keys == sorted(keys)
