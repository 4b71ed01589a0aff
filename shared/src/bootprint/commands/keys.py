"""`bootprint keys`: a realm's authority, computers' certificates, and how they reach the computers.

The group key of the radio is the hub's own and adds its commands to the same group.
"""

import json as plain_json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bootprint.cli import group
from bootprint.commands.options import Json, write_json, write_text

if TYPE_CHECKING:
    from bootprint.keys.register import Register

KEYS_HELP = "Keys: the realm's authority, computers' certificates, the radio's group key."

Folder = Annotated[Path, typer.Argument(help="The authority's folder, on the planner's computer alone.")]
Computers = Annotated[list[str], typer.Argument(help="Soldier ids of the roster, e.g. a3.")]
Code = Annotated[Path | None, typer.Option("--code", help="File with the bundle's code.")]
ComputerToml = Annotated[Path, typer.Argument(help="This computer's configuration.")]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    keys = group(app, "keys", KEYS_HELP)
    for command in (authority, issue, revoke, pack, unpack, show, check, router):
        keys.command()(command)


def authority(
    folder: Folder,
    realm: Annotated[Path, typer.Option(help="The realm that it is for: realm.toml.")],
    days: Annotated[int, typer.Option(help="How long it holds.", min=1, max=36_500)] = 3650,
) -> None:
    """Make a realm's authority. Keep the folder off the net, and a copy of it locked away: it admits everybody."""
    from bootprint.config import load_realm
    from bootprint.keys.authority import create_authority
    from bootprint.keys.certificates import fingerprint

    made = create_authority(folder, load_realm(realm).id, days, datetime.now(UTC))
    typer.echo(f"authority of realm {made.register.realm} in {folder}")
    typer.echo(f"its fingerprint: {fingerprint(made.certificate)}")


def issue(
    folder: Folder,
    computers: Computers,
    host: Annotated[
        list[str] | None, typer.Option(help="Address or name by which others reach its router; repeatable.")
    ] = None,
    days: Annotated[int, typer.Option(help="How long the certificates hold.", min=1, max=36_500)] = 365,
) -> None:
    """Make certificates for computers; a computer that has one gets its next, and the old one is revoked."""
    from bootprint.keys.authority import open_authority
    from bootprint.topics import check_part

    opened = open_authority(folder)
    for computer in computers:
        _checked(check_part, "computer", computer)
        opened = opened.issue(computer, tuple(host or ()), days, datetime.now(UTC))
        entry = opened.register.of(computer)
        assert entry is not None
        typer.echo(f"{entry.name}: until {_day(entry.until_s)}")


def revoke(folder: Folder, computers: Computers) -> None:
    """Shut computers out: of every router, as soon as it has the new register; of the radio, by a new group key."""
    from bootprint.keys.authority import open_authority

    opened = open_authority(folder)
    for computer in computers:
        opened = opened.revoke(computer, datetime.now(UTC))
    typer.echo(f"revoked: {', '.join(computers)}; register {opened.register.number}")
    typer.echo("next: `bootprint keys roll GROUP.key --at TIME --lost`, then `keys pack` for everybody else")


def pack(
    folder: Folder,
    computer: Annotated[str, typer.Argument(help="Soldier id of the computer that it is for.")],
    out: Annotated[Path, typer.Option(help="The bundle to write.")],
    code: Annotated[Path, typer.Option(help="File of its code: made, or used if it is there.")],
    config: Annotated[
        Path | None, typer.Option(help="The computer's computer.toml, with realm.toml beside it.")
    ] = None,
    group_key: Annotated[
        list[Path] | None, typer.Option(help="A radio group key; the next one beside it comes along.")
    ] = None,
) -> None:
    """Pack a computer's keys, and its configuration, into one signed and encrypted file.

    The bundle may travel any way; the code opens it and has to travel another one.
    """
    from bootprint.keys.authority import open_authority
    from bootprint.keys.bundle import new_code, read_code
    from bootprint.keys.bundle import pack as packed
    from bootprint.keys.contents import configuration_files, group_key_files
    from bootprint.keys.secret_files import create_secret

    opened = open_authority(folder)
    files = {} if config is None else configuration_files(config, computer, opened.register.realm)
    files |= group_key_files(group_key or [])
    if not code.exists():
        create_secret(code, f"{new_code()}\n".encode())
    create_secret(out, packed(opened, computer, files, read_code(code)))
    typer.echo(
        f"{out}: {len(files) + len(opened.files_of(computer))} files for {computer}; its code is in {code}"
    )


def unpack(
    bundle: Annotated[Path, typer.Argument(help="The bundle.")],
    to: Annotated[Path, typer.Option(help="Folder of this computer's configuration.")],
    code: Code = None,
    update: Annotated[
        bool, typer.Option("--update", help="Put newer files in the place of those that are there.")
    ] = False,
) -> None:
    """Install a bundle on this computer. Without --code it asks for the code."""
    from bootprint.keys.bundle import authority_of, install, open_bundle, read_code
    from bootprint.keys.certificates import fingerprint

    said = typer.prompt("code", hide_input=True) if code is None else read_code(code)
    where = str(bundle)
    content = open_bundle(_read_bundle(bundle), said, where)
    written = install(content, to, where, update=update)
    typer.echo(f"{len(written)} files of {content.soldier} (realm {content.realm}) in {to}")
    typer.echo(f"authority's fingerprint, to compare: {fingerprint(authority_of(content, where))}")


def show(
    folder: Annotated[Path, typer.Argument(help="An authority's folder, or a computer's folder of keys.")],
    json: Json = None,
) -> None:
    """List the certificates of a realm: whose, until when, and which are revoked. No key is read."""
    from bootprint.keys.certificates import certificate_of, fingerprint
    from bootprint.keys.register import load_register
    from bootprint.keys.secret_files import read_secret

    path = folder / "ca.crt"
    ca = certificate_of(read_secret(path, "authority", "name a folder with one"), str(path))
    register = load_register(folder, ca)
    rows = _rows(register, datetime.now(UTC).timestamp())
    if json is not None:
        write_json(rows, json)
        return
    typer.echo(f"realm {register.realm}, register {register.number}, authority {fingerprint(ca)}")
    for row in rows:
        typer.echo(
            f"  {row['name']:<12} {row['state']:<8} until {row['until']}  {' '.join(row['hosts'])}".rstrip()
        )


def check(config: ComputerToml = Path("computer.toml"), json: Json = None) -> None:
    """Look over this computer's certificates: do they belong together, do they hold, are they admitted?

    Exit code 1 if something will not work; what ends within 30 days is a warning.
    """
    from bootprint.commands.doctor import tell
    from bootprint.config import load_computer
    from bootprint.keys.findings import key_findings

    tell(list(key_findings(load_computer(config), datetime.now(UTC))), json)


def router(
    config: ComputerToml = Path("computer.toml"),
    out: Annotated[Path | None, typer.Option(help="File to write; standard output by default.")] = None,
) -> None:
    """Write zenoh's configuration for this computer's router, for zenohd or the image eclipse/zenoh.

    `bootprint router` and `bootprint up` need no such file. Write it again after every `keys unpack`.
    """
    from bootprint.config import load_computer
    from bootprint.keys.routing import guarded_settings

    settings = guarded_settings(load_computer(config))
    write_text(plain_json.dumps(settings, indent=2) + "\n", out)


def _read_bundle(path: Path) -> bytes:
    from bootprint.errors import ConfigError

    try:
        return path.read_bytes()
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error


def _checked(check: Callable[[str, str], str], what: str, value: str) -> None:
    from bootprint.errors import ConfigError

    try:
        check(what, value)
    except ValueError as error:
        raise ConfigError(str(error)) from error


def _rows(register: "Register", now_s: float) -> list[dict[str, Any]]:
    revoked = set(register.revoked)
    return [
        {
            "name": each.name,
            "soldier": each.soldier,
            "state": "revoked" if each in revoked else "ended" if each.until_s < now_s else "valid",
            "until": _day(each.until_s),
            "days": int((each.until_s - now_s) // 86_400),
            "hosts": list(each.hosts),
            "serial": each.serial,
        }
        for each in (*register.valid, *register.revoked)
    ]


def _day(time_s: int) -> str:
    return datetime.fromtimestamp(time_s, UTC).date().isoformat()
