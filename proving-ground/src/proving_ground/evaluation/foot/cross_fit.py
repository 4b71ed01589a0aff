"""The learned detector on feet that it was not trained on: weights of one half of each set, scored on the other.

    python -m proving_ground.evaluation.foot.cross_fit DATA        (about two minutes)

The kernel's weights are constants of compiled code, so each half is scored by a process of its own, on a copy of
`pdr_engine` with that half's weights.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

import pdr_engine
from proving_ground.evaluation.foot.ablation import ABLATIONS, foot_rmse
from proving_ground.evaluation.foot.stance_examples import SETS, training_feet

Half = Literal["even", "odd"]
_OTHER: dict[Half, Half] = {"even": "odd", "odd": "even"}
_FIRST: dict[Half, int] = {"even": 0, "odd": 1}


def cross_fit(data: Path) -> dict[str, list[float]]:
    """By set, the 2-D RMSE, m, of every foot with weights trained on the half without it."""
    halves = [_trained_on(half, data) for half in _OTHER]
    return {name: [error for half in halves for error in half[name]] for name in halves[0]}


def _trained_on(half: Half, data: Path) -> dict[str, list[float]]:
    with tempfile.TemporaryDirectory() as folder:
        package = Path(folder) / "pdr_engine"
        shutil.copytree(
            Path(pdr_engine.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__")
        )
        weights = _python("train_stance", str(data), "--half", half)
        (package / "foot" / "weights.py").write_text(weights, encoding="utf-8")
        scored = _python("cross_fit", str(data), "--score", _OTHER[half], path=folder)
    errors: dict[str, list[float]] = json.loads(scored)
    return errors


def _python(module: str, *arguments: str, path: str | None = None) -> str:
    """What a module of this folder prints, with ``path`` before all others."""
    environment = os.environ | ({"PYTHONPATH": path} if path else {})
    command = [sys.executable, "-m", f"proving_ground.evaluation.foot.{module}", *arguments]
    return subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True).stdout


def _scored(half: Half, data: Path) -> dict[str, list[float]]:
    """By set, the errors of a half's feet with the weights at hand."""
    settings = ABLATIONS[0].settings()
    found = {}
    for name in SETS:
        errors = [
            foot_rmse(run, place, settings) for run, place in training_feet(data, name)[_FIRST[half] :: 2]
        ]
        if known := [error for error in errors if error is not None]:
            found[name] = known
    return found


def summary(errors: Sequence[float]) -> str:
    """Mean, median, worst and n in words."""
    return (
        f"mean {np.mean(errors):.3f}, median {np.median(errors):.3f}, worst {np.max(errors):.3f} m "
        f"(n {len(errors)})"
    )


def main(arguments: Sequence[str]) -> None:
    """The command: cross-fit a data folder, or score one half with the weights at hand."""
    data = Path(arguments[0])
    if arguments[1:2] == ["--score"]:
        sys.stdout.write(json.dumps(_scored("even" if arguments[2] == "even" else "odd", data)))
        return
    for name, errors in cross_fit(data).items():
        sys.stdout.write(f"{name}, weights of the other half: {summary(errors)}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
