"""`bootprint benchmark …`: the group of commands, each from the module that measures."""

import typer


def register(app: typer.Typer) -> None:
    """Add the group."""
    from proving_ground.performance.body_benchmark import body
    from proving_ground.performance.federation_benchmark import federation
    from proving_ground.performance.foot_benchmark import foot
    from proving_ground.performance.fusion_benchmark import fusion
    from proving_ground.performance.history_benchmark import history
    from proving_ground.performance.hub_benchmark import hub
    from proving_ground.performance.report_command import all_parts
    from proving_ground.radio_trials.budgets import budgets
    from proving_ground.radio_trials.warnings import warnings

    group = typer.Typer(no_args_is_help=True, help="What the parts cost, and whether budgets hold.")
    for command in (foot, body, fusion, hub, budgets, warnings, history, federation):
        group.command()(command)
    group.command("all")(all_parts)
    app.add_typer(group, name="benchmark")
