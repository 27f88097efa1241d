"""Python's collector of garbage, in processes that live long."""

import atexit
import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def none_while_loading() -> Iterator[None]:
    """No collections in here, where libraries are loaded.

    What they make stays, and a quarter of the time went into looking through it again and again.
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def leave_out_what_is_loaded() -> None:
    """Collections from now on pass over all that there is.

    The libraries alone are 200,000 objects: each full collection goes through them for 0.14 s, in which telemetry,
    commands and a stop wait. What is garbage now stays for good: call it before the work begins.
    """
    gc.freeze()
    # at the end they go like all else: libraries complain of what they made and never saw go
    atexit.register(gc.unfreeze)
