"""Files that unpack to far more than they are: one is read after the other, so that only one needs its memory."""

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

from anyio import CapacityLimiter, to_thread

_T = TypeVar("_T")

_reading = CapacityLimiter(1)


async def in_turn(work: Callable[..., _T], *args: Any) -> _T:
    """What ``work`` returns, done in a thread when those before it have ended."""
    return await to_thread.run_sync(partial(work, *args), limiter=_reading)
