"""`bootprint exercise …`: the group of commands; modules add theirs with a function ``add_to(app)``."""

import typer

from proving_ground.exercises.commands import honesty as honesty_command
from proving_ground.exercises.commands import run as run_command
from proving_ground.exercises.commands import scenarios as scenario_command


def register(app: typer.Typer) -> None:
    """Add the group."""
    group = typer.Typer(
        no_args_is_help=True,
        help="Simulated exercises: what there is, what it looks like; play, compare, repeat.",
    )
    scenario_command.add_to(group)
    run_command.add_to(group)
    honesty_command.add_to(group)
    app.add_typer(group, name="exercise")
