"""`bootprint page token|openapi`: who may use a command post's page from elsewhere, and what its interface is."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from bootprint.cli import group
from bootprint.commands.options import write_text

if TYPE_CHECKING:
    from sa_hub.page.settings import Token

PAGE_HELP = "The command post's page: tokens for those who open it from elsewhere, and its interface."


def register(app: typer.Typer) -> None:
    """Add the commands."""
    page = group(app, "page", PAGE_HELP)
    page.command("token")(token)
    page.command("openapi")(openapi)


def token(
    name: Annotated[str, typer.Argument(help="Who it is for, as the audit log shall name them.")],
    role: Annotated[
        Literal["view", "operate", "admin"],
        typer.Option(
            help="view looks on, operate also alerts, observes and fixes, admin also reads the audit."
        ),
    ] = "view",
) -> None:
    """Make a token: give it to its owner, and put the lines below it into computer.toml.

    Example: bootprint page token "watch officer" --role operate
    """
    from sa_hub.page.access import new_token

    secret, known = new_token(name, role)
    typer.echo(f"{secret}\n\n{_lines(known)}")


def _lines(known: "Token") -> str:
    import json

    return (
        "[[hub.page.tokens]]\n"
        f"name = {json.dumps(known.name)}\n"
        f'role = "{known.role}"\n'
        f'sha256 = "{known.sha256}"'
    )


def openapi(
    output: Annotated[Path | None, typer.Option(help="File to write; standard output without.")] = None,
) -> None:
    """Describe the page's interface in OpenAPI 3.1 (a running page has it at /api/v1/openapi.json)."""
    import json

    from sa_hub.page.openapi import openapi as describe

    write_text(json.dumps(describe(), indent=2) + "\n", output)
