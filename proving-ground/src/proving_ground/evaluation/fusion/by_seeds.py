"""The command line of what is measured by seeds and told as a table."""

import argparse
import sys
from collections.abc import Callable, Sequence

from bootprint import logs
from pdr_engine.foot import warm_up


def print_table(
    description: str, default: Sequence[int], table_of: Callable[[Sequence[int]], Sequence[str]]
) -> None:
    """Measure the seeds asked for and print the table."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(default))
    logs.configure("error")
    warm_up()
    sys.stdout.write("\n".join(table_of(parser.parse_args().seeds)) + "\n")
