"""The console as operators meet it: real servers, real requests, a real page where one is needed."""

from collections.abc import Iterator

from benchmarks.console import answers, ghost, load, page
from benchmarks.timing import Figure


def figures(quick: bool) -> Iterator[Figure]:
    yield from ghost.figures(quick)
    yield from answers.figures(quick)
    yield from page.figures(quick)
    yield from load.figures(quick)
