"""What images are made of, as far as it shows without an engine that makes them."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROOMS = ("shared", "services/sensor-gateway", "services/pdr-engine", "services/fusion", "services/sa-hub")


def told(house: Path, room: str) -> list[str]:
    """What deploy/requirements prints for a room."""
    command = [sys.executable, str(house / "deploy/requirements"), room]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()


def asked_of_others(*rooms: str) -> set[str]:
    files = [tomllib.loads((ROOT / room / "pyproject.toml").read_text()) for room in rooms]
    wanted = {each for file in files for each in file["project"]["dependencies"]}
    return {each for each in wanted if not each.startswith("bootprint")}


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_asks_for_what_it_and_the_shared_room_ask_of_others(room: str) -> None:
    lines = told(ROOT, room)
    assert lines == sorted(asked_of_others("shared", room))
    assert lines


def test_the_exercise_asks_for_what_every_room_asks_of_others() -> None:
    assert set(told(ROOT, "proving-ground")) == asked_of_others(*ROOMS, "proving-ground")


def test_other_projects_in_a_checkout_are_none_of_its_rooms(tmp_path: Path) -> None:
    for path in ("deploy/requirements", *(f"{room}/pyproject.toml" for room in ROOMS)):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, tmp_path / path)
    for folder in (".venv/lib/thing", "services/sa-hub/web/node_modules/thing"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "pyproject.toml").write_text(
            '[project]\nname = "msgspec"\ndependencies = ["thing"]'
        )
    assert any(line.startswith("msgspec") for line in told(ROOT, "services/sa-hub"))
    assert told(tmp_path, "services/sa-hub") == told(ROOT, "services/sa-hub")


def test_only_one_line_names_the_python_that_images_have() -> None:
    lines = [
        line for line in (ROOT / "Dockerfile").read_text().splitlines() if re.search(r"python:?3\.\d", line)
    ]
    assert [line.split("=")[0] for line in lines] == ["ARG PYTHON_IMAGE"]


def test_a_page_that_was_built_outside_gets_into_the_image() -> None:
    page = Path("services/sa-hub/src/sa_hub/page/static/index.html")
    left_out = [line for line in (ROOT / ".dockerignore").read_text().splitlines() if line]
    assert [line for line in left_out if any(each.match(line) for each in (page, *page.parents))] == []
