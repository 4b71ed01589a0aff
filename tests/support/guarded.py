"""A realm with an authority, and computers of it whose routers admit by certificate."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from bootprint.config import Computer, load_computer
from bootprint.keys.authority import Authority, create_authority
from bootprint.keys.bundle import install, new_code, open_bundle, pack
from bootprint.keys.contents import configuration_files, group_key_files
from bootprint.keys.credentials import Credentials
from bootprint.topics import Identity
from sa_hub.keys import create_group_key
from support.routers import free_endpoint

A3, A4, CP, CQ = (
    Identity("bp", unit, soldier)
    for unit, soldier in (("alpha", "a3"), ("alpha", "a4"), ("hq", "cp"), ("hq2", "cq"))
)
_REALM = """
id = "bp"
origin = { latitude_deg = 59.35, longitude_deg = 18.07, height_m = 50.0 }
roster = [
    { id = "a3", number = 3, unit = "alpha" },
    { id = "a4", number = 4, unit = "alpha" },
    { id = "a5", number = 5, unit = "alpha" },
    { id = "cp", number = 100, unit = "hq", role = "command_post" },
    { id = "cq", number = 101, unit = "hq2", role = "command_post" },
]
"""


def make_authority(folder: Path, *revoked: str) -> Authority:
    """An authority in ``folder``, the realm beside it; everybody has a certificate, some no longer a good one."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "realm.toml").write_text(_REALM)
    create_group_key(folder / "group.key")
    now = datetime.now(UTC)
    made = create_authority(folder / "authority", "bp", 30, now)
    for soldier in ("a3", "a4", "a5", "cp", "cq"):
        made = made.issue(soldier, (), 20, now)
    for soldier in revoked:
        made = made.revoke(soldier, now)
    return made


def make_computer(authority: Authority, soldier: str, lines: str = "") -> Computer:
    """A soldier's computer, its files brought by a bundle; ``lines`` go into its computer.toml."""
    planner = authority.folder.parent
    config = planner / "planned" / soldier / "computer.toml"
    config.parent.mkdir(parents=True)
    config.write_text(f'realm = "realm.toml"\nsoldier = "{soldier}"\n{lines}')
    (config.parent / "realm.toml").write_text(_REALM)
    files = configuration_files(config, soldier, "bp") | group_key_files([planner / "group.key"])
    code = new_code()
    content = open_bundle(pack(authority, soldier, files, code), code, "bundle")
    install(content, planner / soldier, "bundle", update=False)
    return load_computer(planner / soldier / "computer.toml")


def shown_by(authority: Authority, name: str) -> Credentials:
    """Any certificate that the authority ever made, by its name: ``a4.1``."""
    made = authority.folder / "computers"
    return Credentials(authority.folder / "ca.crt", made / f"{name}.crt", made / f"{name}.key")


def strangers(folder: Path) -> Credentials:
    """A certificate by the name of ``cp.1`` of somebody else's authority, who trusts the realm's all the same."""
    made = create_authority(folder / "strangers", "bp", 30, datetime.now(UTC))
    made.issue("cp", (), 20, datetime.now(UTC))
    shown = shown_by(made, "cp.1")
    return Credentials(folder / "authority" / "ca.crt", shown.certificate, shown.key)


def secure_endpoint() -> str:
    """Where nobody listens now, for certificates."""
    return free_endpoint().replace("tcp/", "tls/")


@contextmanager
def guarded_process(computer: Computer) -> Iterator[subprocess.Popen[bytes]]:
    """`bootprint router` of a computer; ends with the context."""
    program = "from bootprint.cli import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", program, "router", "--config", str(computer.path), "--stop-on-eof"],
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    try:
        yield process
    finally:
        process.communicate(timeout=20)
