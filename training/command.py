"""What the commands that learn and compare have in common: who makes the routes, and errors in words."""

import argparse
import math
import sys
from collections.abc import Callable, Sequence

from footfall.core.errors import FootFallError


def add_who_makes(parser: argparse.ArgumentParser) -> None:
    """Let the operator say on how many processes, or on which cluster."""
    parser.add_argument("--processes", type=at_least_one, default=1, help="of this machine (default: 1)")
    parser.add_argument("--scheduler", help="of a dask cluster that makes the routes: tcp://HOST:PORT")


def at_least_one(text: str) -> int:
    """The type of an option that counts something."""
    if (count := int(text)) < 1:
        raise argparse.ArgumentTypeError(f"{count} is less than 1")
    return count


def as_many_as(seeds: Sequence[int]) -> Callable[[str], int]:
    """The type of an option that says how many routes there are to be, each over the ground of a seed of its own.

    A slice of the seeds would take fewer than are asked for without a word, and nearly all for a number below zero.
    """

    def count(text: str) -> int:
        if (asked := at_least_one(text)) > len(seeds):
            raise argparse.ArgumentTypeError(f"there is ground for {len(seeds)} routes at most, not for {asked}")
        return asked

    return count


def length(text: str) -> float:
    """The type of an option that says how long a route is [m]."""
    if not 0.0 < (metres := float(text)) < math.inf:
        raise argparse.ArgumentTypeError(f"a route is longer than 0 m, and no endless one: {text}")
    return metres


def exit_code(main: Callable[[], int]) -> int:
    """That of a command; 1 where FootFall refuses, with what was wrong."""
    try:
        return main()
    except FootFallError as err:
        print(err.message, file=sys.stderr)
        return 1
