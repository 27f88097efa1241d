"""Two stages of work over many things: the first one of the later goes on beside the second one of the earlier."""

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")


def pipelined(function: Callable[[T], R], things: Sequence[T]) -> Generator[tuple[T, Future[R]]]:
    """Each thing, and what ``function`` makes of it, in a thread of its own and in their order.

    The function must change nothing that is used beside it, nor run a compiled loop over several threads: one of those
    may go on at a time. What it raises, the future's ``result()`` raises. Close the generator (contextlib.closing)
    where it may not be used up: what was begun is waited for then, and no more is.
    """
    thread = ThreadPoolExecutor(1, "pipelined")
    try:
        yield from zip(things, [thread.submit(function, one) for one in things], strict=True)
        thread.shutdown()
    finally:
        thread.shutdown(cancel_futures=True)
