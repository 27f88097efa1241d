"""The worker process: takes one job at a time from its pipe, makes the product, sends it back.

Messages to the worker: ("job", id, kind, {name: (digest, value)}, (digest, value) | None) and ("cancel", id).
Messages from it: ("begun",), ("progress", fraction, text), ("preview", product), ("log", record), ("done", product),
("failed", error). A closed pipe ends it.
"""

import contextlib
import gc
import logging
import os
import signal
import threading
import time
from collections.abc import Iterator, Mapping
from importlib import import_module
from logging.handlers import QueueHandler
from multiprocessing import parent_process
from multiprocessing.connection import Connection
from typing import Any

from footfall.core.collector import leave_out_what_is_loaded, none_while_loading
from footfall.core.errors import Cancelled, FootFallError
from footfall.core.value import Value
from footfall.io.artifacts import named
from footfall.session.jobs.product_recipes import make

PROGRESS_PERIOD = 0.05
"""Progress is sent, and the wish to cancel looked for, at most this often [s]."""

Sent = tuple[str, Value]


def work(pipe: Connection, recipes: str) -> None:
    """Serve one pipe until it closes.

    recipes: module with ``RECIPES`` and, optionally, ``preload``, called first, and ``WARM_UPS``, called one after
    another while no job waits.
    """
    # Ctrl-C reaches the whole process group; the server decides when a worker ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_server, daemon=True).start()
    with none_while_loading():
        module = import_module(recipes)
        with contextlib.suppress(Exception):  # the job that needs what did not load will say so
            getattr(module, "preload", lambda: None)()
    warm_ups = list(getattr(module, "WARM_UPS", ()))
    with pipe, contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            while warm_ups and not pipe.poll():
                with contextlib.suppress(Exception):
                    warm_ups.pop(0)()
                if not warm_ups:
                    gc.collect()
                    leave_out_what_is_loaded()
            message = pipe.recv()
            if message[0] == "job":
                _send(pipe, ("begun",))
                with _logged_by_server(pipe):
                    answer = _run(pipe, module.RECIPES, *message[1:])
                _send(pipe, answer)


_sending = threading.Lock()


def _send(pipe: Connection, message: tuple[Any, ...]) -> None:
    # whatever thread of a library logs something
    with _sending:
        pipe.send(message)


class _Logged(QueueHandler):
    """Hands what is logged during a job to the server, which knows the job's session and keeps the log."""

    def enqueue(self, record: logging.LogRecord) -> None:
        with contextlib.suppress(OSError, ValueError, TypeError):  # who has died has no one to tell
            _send(self.queue, ("log", record))  # type: ignore[arg-type]


@contextlib.contextmanager
def _logged_by_server(pipe: Connection) -> Iterator[None]:
    root, handler = logging.getLogger(), _Logged(pipe)  # type: ignore[arg-type]
    root.addHandler(handler)
    root.setLevel(logging.INFO)
    try:
        yield
    finally:
        root.removeHandler(handler)


def end_with_server() -> None:
    """End this process where its server has gone: a killed one closes the pipe, but who is at work does not look."""
    server = parent_process()
    if server is not None:
        server.join()
        os._exit(1)


def _run(
    pipe: Connection, recipes: Mapping[str, Any], job: str, kind: str, parents: dict[str, Sent], settings: Sent | None
) -> tuple[str, Any]:
    try:
        given = {name: named(value, digest) for name, (digest, value) in parents.items()}
        asked = None if settings is None else named(settings[1], settings[0])
        return "done", make(recipes, kind, given, asked, _Reporter(pipe, job))
    except FootFallError as err:
        return "failed", err
    except (EOFError, BrokenPipeError, ConnectionResetError):
        raise
    except Exception as err:
        # An error of a library, or of ours: the text must cross the pipe, the type may not unpickle there.
        return "failed", FootFallError(f"{kind} failed: {type(err).__name__}: {err}")


class _Reporter:
    """The progress of one job, as seen by its recipe."""

    def __init__(self, pipe: Connection, job: str) -> None:
        self.pipe, self.job, self.next = pipe, job, 0.0

    def __call__(self, fraction: float, text: str) -> None:
        now = time.monotonic()
        if now < self.next:
            return
        self.next = now + PROGRESS_PERIOD
        while self.pipe.poll():
            # A cancel that crossed the end of an earlier job on the way names that job.
            if self.pipe.recv() == ("cancel", self.job):
                raise Cancelled("cancelled")
        _send(self.pipe, ("progress", float(fraction), str(text)))

    def preview(self, product: Value) -> None:
        """See :func:`footfall.core.progress.preview_of`."""
        _send(self.pipe, ("preview", product))
