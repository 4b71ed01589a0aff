"""The laws of the house, read off the source: who may import whom, and what may be committed."""

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from bootprint.commands.topics import topics_markdown
from support.waiting import PATIENCE_S

ROOT = Path(__file__).parents[2]
ROOMS = {
    "bootprint": ROOT / "shared/src/bootprint",
    "sensor_gateway": ROOT / "services/sensor-gateway/src/sensor_gateway",
    "pdr_engine": ROOT / "services/pdr-engine/src/pdr_engine",
    "fusion": ROOT / "services/fusion/src/fusion",
    "sa_hub": ROOT / "services/sa-hub/src/sa_hub",
    "proving_ground": ROOT / "proving-ground/src/proving_ground",
}
MAY_IMPORT = {
    "bootprint": set(),
    **{key: {"bootprint"} for key in ("sensor_gateway", "pdr_engine", "fusion", "sa_hub")},
    "proving_ground": set(ROOMS) - {"proving_ground"},
}
DOCUMENTS = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]


def imported(path: Path) -> Iterator[str]:
    """Every module that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_import_only_what_they_may(room: str) -> None:
    forbidden = set(ROOMS) - MAY_IMPORT[room] - {room}
    broken = [
        f"{path.name} imports {module}"
        for path in ROOMS[room].rglob("*.py")
        for module in imported(path)
        if module.split(".")[0] in forbidden
    ]
    assert broken == []


def test_only_the_zenoh_bus_imports_zenoh() -> None:
    users = {
        path.relative_to(ROOT).as_posix()
        for folder in ROOMS.values()
        for path in folder.rglob("*.py")
        if any(module.split(".")[0] == "zenoh" for module in imported(path))
    }
    assert users == {"shared/src/bootprint/zenoh_bus.py"}


@pytest.mark.parametrize("module", ["engine.py", "hub.py", "filter.py", "tracks.py"])
def test_cores_know_no_clock_file_or_bus(module: str) -> None:
    found = [path for folder in ROOMS.values() for path in folder.rglob(module)]
    assert found, f"no core named {module}"
    worldly = {
        "time",
        "socket",
        "threading",
        "pathlib",
        "os",
        "bootprint.zenoh_bus",
        "bootprint.clock.ScaledClock",
    }
    for path in found:
        assert worldly.isdisjoint(imported(path)), path


def test_every_room_is_documented_by_its_first_lines() -> None:
    bare = [
        path.relative_to(ROOT).as_posix()
        for folder in ROOMS.values()
        for path in folder.rglob("*.py")
        if len(ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "") < 20
    ]
    assert bare == []


def test_constraints_name_versions_only() -> None:
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    assert lines
    assert [line for line in lines if not re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.!+]+", line)] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_between_documents_lead_somewhere(document: Path) -> None:
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", document.read_text(encoding="utf-8")):
        assert (document.parent / target).exists(), f"{document.name} links to {target}"


def test_the_topics_page_is_the_table() -> None:
    assert (ROOT / "docs/topics.md").read_text(encoding="utf-8") == topics_markdown()


def test_two_waits_in_a_row_end_with_what_was_waited_for_rather_than_with_a_dump() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert settings["tool"]["pytest"]["ini_options"]["timeout"] > 2.0 * PATIENCE_S
