"""Shared by all tests: fixed hypothesis profile, the default robot, optional shared data."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from playwright.sync_api import Browser

SEED = 20081
FLAGS = ["--no-sandbox", "--disable-background-networking"]
DRAWING = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
FLAT = ["--disable-gpu"]

settings.register_profile(
    "footfall",
    derandomize=True,
    deadline=None,
    max_examples=50,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("footfall")


def pytest_report_header() -> str:
    return f"footfall: numpy seed {SEED}, hypothesis derandomized"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What needs Chromium runs apart: it draws in software, and Playwright's loop suffers no other in its process.

    Files that take minutes come first: begun last, they would keep one core busy while the others idle.
    """
    for item in items:
        if "chromium" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.browser)
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


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


@pytest.fixture(scope="session")
def chromiums() -> "Iterator[Callable[[bool], Browser]]":
    """The distribution's Chromium, with 3-D drawn in software and without, each started once when first asked for.

    One process can hold one Playwright.
    """
    from playwright.sync_api import sync_playwright

    path = next(
        (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
    )
    if path is None:
        pytest.fail("the browser tests need Chromium; `make test` installs it")
    with sync_playwright() as playwright:
        started: dict[bool, Browser] = {}

        def chromium(drawing: bool) -> "Browser":
            if drawing not in started:
                flags = [*FLAGS, *(DRAWING if drawing else FLAT)]
                started[drawing] = playwright.chromium.launch(executable_path=path, args=flags)
            return started[drawing]

        yield chromium
        for browser in started.values():
            browser.close()


@pytest.fixture
def scene(request: pytest.FixtureRequest) -> bool:
    """Whether the test looks at the scene, or works in it (marker ``scene``): drawn in software, it slows all else."""
    return request.node.get_closest_marker("scene") is not None


@pytest.fixture
def chromium(chromiums: "Callable[[bool], Browser]", scene: bool) -> "Browser":
    """The one that draws the scene, where the test is marked so."""
    return chromiums(scene)
