"""What a process loads when it starts: nothing that it does not need, for it may have to start again in a hurry."""

import json
import subprocess
import sys

import pytest

LOADED = "import json, sys; print(json.dumps(sorted(sys.modules)))"


def loaded_by(code: str) -> set[str]:
    """The modules of a fresh interpreter after this."""
    told = subprocess.run(
        [sys.executable, "-c", f"{code}\n{LOADED}"], capture_output=True, text=True, check=True
    )
    return set(json.loads(told.stdout.splitlines()[-1]))


@pytest.mark.parametrize("service", ["sensor_gateway", "pdr_engine", "fusion", "sa_hub"])
def test_a_service_loads_neither_screens_nor_science(service: str) -> None:
    loaded = loaded_by(f"import {service}.main")
    heavy = {"rich", "pygments", "scipy", "numba", "cv2", "matplotlib", "textual", "starlette", "sqlalchemy"}
    assert loaded & heavy == set()
    assert "structlog" in loaded


def test_rich_and_structlog_s_own_console_are_there_for_who_wants_them() -> None:
    loaded = loaded_by("import bootprint.service; import rich.console; rich.console.Console()")
    assert "rich.console" in loaded


def test_whoever_has_rich_already_keeps_it() -> None:
    code = "import rich.traceback as before, bootprint, sys; assert sys.modules['rich.traceback'] is before"
    assert "rich" in loaded_by(code)


def test_a_router_does_not_wait_for_the_proving_ground() -> None:
    code = "from bootprint.cli import build_app; build_app(['router', '--listen', 'tcp/127.0.0.1:7447'])"
    assert not [name for name in loaded_by(code) if name.startswith(("proving_ground", "sa_hub"))]


def test_without_a_word_that_it_knows_every_command_is_there() -> None:
    code = "from bootprint.cli import build_app; build_app(['recrod'])"
    assert {"proving_ground", "sa_hub"} <= {name.split(".")[0] for name in loaded_by(code)}
