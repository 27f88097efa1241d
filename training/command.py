"""What the commands that learn and compare have in common: who makes the routes, and errors in words."""

import argparse
import sys
from collections.abc import Callable

from footfall.core.errors import FootFallError


def add_who_makes(parser: argparse.ArgumentParser) -> None:
    """Let the operator say on how many processes, or on which cluster."""
    parser.add_argument("--processes", type=int, default=1, help="of this machine (default: 1)")
    parser.add_argument("--scheduler", help="of a dask cluster that makes the routes: tcp://HOST:PORT")


def exit_code(main: Callable[[], int]) -> int:
    """That of a command; 1 where FootFall refuses, with what was wrong."""
    try:
        return main()
    except FootFallError as err:
        print(err.message, file=sys.stderr)
        return 1
