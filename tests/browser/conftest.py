"""A real Chromium on the real page of a real server, with the simulated rover on the link."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from tests.support.server import Running, running_server, until

OUTPUTS = Path(__file__).resolve().parents[2] / "test-outputs" / "screenshots"
FLAGS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
]


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    path = next(
        (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
    )
    if path is None:
        pytest.fail("the browser tests need Chromium; `make test` installs it")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Running]:
    """The rock-step sample, open, with its rover connected."""
    with running_server(tmp_path, scene=True, prepare=lambda s: s.open_sample("rock-step")) as running:
        running.rover.start()
        current = running.sessions.current
        until(lambda: current is not None and current.frame, "the first telemetry", 60)
        yield running


@pytest.fixture
def page(chromium: Browser, served: Running) -> Iterator[Page]:
    """The operator's page; a script error or a failed request that nobody expected fails the test."""
    context = chromium.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("response", lambda answer: faults.append(f"{answer.status} {answer.url}") if answer.status >= 500 else None)
    page.goto(f"{served.url}/?fixedDpr=0.5")
    page.get_by_text("Stepping over a rock", exact=True).wait_for()
    yield page
    context.close()
    assert not faults


@pytest.fixture
def look(page: Page, request: pytest.FixtureRequest):
    """Keep a picture of the page as an output of the test run."""
    OUTPUTS.mkdir(parents=True, exist_ok=True)

    def keep(name: str) -> None:
        page.screenshot(path=OUTPUTS / f"{request.node.name}-{name}.png")

    return keep
