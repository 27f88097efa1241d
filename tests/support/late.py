"""A plugin of pytest: threads, calls in the server's pool and messages of web sockets come late, at random.

``python -m pytest -p tests.support.late --late 1 tests/api`` finds tests that count on what only mostly comes first.
What fails with one seed need not fail again: the order of threads is the machine's.
"""

import asyncio
import functools
import random
import threading
import time
from collections.abc import Awaitable, Callable
from typing import Any

import anyio.to_thread
import pytest
from starlette.websockets import WebSocket

SHARE = 0.2
"""Of what may come late, this part does."""
LATEST = 0.25
"""By so much at most [s]."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--late", type=int, default=1, metavar="SEED", help="seed of what comes late")


def pytest_report_header(config: pytest.Config) -> str:
    return f"footfall: {SHARE:.0%} of threads, calls and messages come up to {LATEST} s late, seed {_seed(config)}"


def pytest_configure(config: pytest.Config) -> None:
    drawn = random.Random(_seed(config))

    def delay() -> float:
        return drawn.random() * LATEST if drawn.random() < SHARE else 0.0

    def late(call: Callable[..., Awaitable[Any]]) -> Callable[..., Awaitable[Any]]:
        @functools.wraps(call)
        async def called(*args: Any, **named: Any) -> Any:
            await asyncio.sleep(delay())
            answer = await call(*args, **named)
            await asyncio.sleep(delay())
            return answer

        return called

    run = threading.Thread.run

    def begun_late(self: threading.Thread) -> None:
        time.sleep(delay())
        run(self)

    threading.Thread.run = begun_late
    for owner, name in ((anyio.to_thread, "run_sync"), (asyncio, "to_thread"), (WebSocket, "receive")):
        setattr(owner, name, late(getattr(owner, name)))


def _seed(config: pytest.Config) -> int:
    return int(config.getoption("--late") or 0)
