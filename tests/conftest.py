"""Shared by all tests: fixed hypothesis profile, the default robot, optional shared data."""

import os
import threading
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

from footfall.processor import LATE, choose_arithmetic  # isort: skip (it comes before numpy)

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from footfall.core.collector import leave_out_what_is_loaded, none_while_loading
from tests.support.heavy import is_heavy
from tests.support.run_record import RunRecord, may_be_asked_twice
from tests.support.waiting import until

SEED = 20081
KEPT = ("asyncio-portal", "AnyIO worker thread", "asyncio_", "Dask-Offload", "Dummy-")
"""Threads that schemathesis, Playwright and dask keep for their process, which only wait; and those of libraries in
other languages, which Python never hears the end of."""

settings.register_profile(
    "footfall",
    derandomize=True,
    deadline=None,
    max_examples=50,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("footfall")


def pytest_configure(config: pytest.Config) -> None:
    if not choose_arithmetic():
        raise pytest.UsageError(LATE)
    config.pluginmanager.register(RunRecord(), "run-record")


def pytest_report_header() -> str:
    return f"footfall: numpy seed {SEED}, hypothesis derandomized"


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """For ``-n auto``: one more than cores, as tests wait for processes, the disk and a rover's moves."""
    return (os.cpu_count() or 1) + 1


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, Any, Any]:
    """All tests and what they import stay to the end: no collection of garbage goes through them, here or later."""
    with none_while_loading():
        collected = yield
    leave_out_what_is_loaded()
    return collected


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files that take minutes come first: begun last, they would keep one core busy while the others idle."""
    for item in items:
        if is_heavy(item.path):
            item.add_marker(pytest.mark.heavy)
        if may_be_asked_twice(item):
            item.add_marker(pytest.mark.flaky(reruns=1))
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


@pytest.fixture(scope="module", autouse=True)
def no_thread_outlives_its_file() -> Iterator[None]:
    """What a file starts, it ends: a server left behind takes time from all that follows, and its keepalive draws from
    ``random``, which Hypothesis refuses in the middle of another file's example."""
    before = set(threading.enumerate())
    yield

    def left() -> list[str]:
        return [one.name for one in threading.enumerate() if one not in before and not one.name.startswith(KEPT)]

    until(lambda: not left(), "the end of the threads of a file", seen=left)


@pytest.fixture
def rng() -> np.random.Generator:
    """Fresh generator with the fixed seed."""
    return np.random.default_rng(SEED)


@pytest.fixture(scope="session")
def athlete():
    """The default robot, loaded once."""
    from footfall.io.robot_files import load_robot

    return load_robot("athlete")


@pytest.fixture(scope="session")
def postgres():
    """A PostgreSQL server for the tests of this process; skips where none is installed."""
    from tests.support.postgres import Postgres, installed

    programs = installed()
    if programs is None:
        pytest.skip("no PostgreSQL server on this machine")
    server = Postgres(programs)
    yield server
    server.end()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder with real terrain and photographs, kept beside the project; skips where it is absent."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("real terrain and photographs (../shared/data) are not on this machine")
    return folder
