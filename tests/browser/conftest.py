"""A real Chromium on the real page of a real server, with the simulated rover on the link."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

import footfall_ui.scene_server
from benchmarks.console.page import DRAWING, launched
from footfall.session.gate import machine
from tests.browser.pictures import OUTPUTS
from tests.support.browsers import Browsers, kill_browsers
from tests.support.drawing import Drawing
from tests.support.laid_sample import lay_sample
from tests.support.page_steps import STEPS, lay_out
from tests.support.server import Running, running_server
from tests.support.spoken import current
from tests.support.waiting import BOUND, else_after, until

FLAT = ["--disable-gpu"]

expect.set_options(timeout=60_000)  # ms; nothing here waits for something not to happen


@pytest.fixture(scope="session")
def chromiums() -> Iterator[Browsers]:
    """The browsers of all tests. One process can hold one Playwright."""
    with sync_playwright() as playwright:

        def start(drawing: bool) -> Browser:
            return launched(playwright, ["--disable-background-networking", *(DRAWING if drawing else FLAT)])

        browsers = Browsers(start)
        yield browsers
        browsers.close()


@pytest.fixture(scope="module", autouse=True)
def no_thread_outlives_its_file(chromiums: Browsers, no_thread_outlives_its_file: None) -> None:
    """As elsewhere; but the browsers, which all files share, begin before the threads of the first file are counted."""


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is armed stays so for as long as a slow machine may take."""
    monkeypatch.setattr(machine, "ARMED_FOR", 3600.0)


@pytest.fixture(autouse=True)
def ends() -> Iterator[None]:
    """No test waits for ever: a Chromium that does not answer any more is killed, and the test fails by it."""
    with else_after(4 * BOUND, kill_browsers):
        yield


@pytest.fixture
def scene(request: pytest.FixtureRequest) -> bool:
    """Whether the test looks at the scene, or works in it (marker ``scene``): drawn in software, it slows all else."""
    return request.node.get_closest_marker("scene") is not None


@pytest.fixture
def chromium(chromiums: Browsers, scene: bool) -> Browser:
    """The one that draws the scene, where the test is marked so."""
    return chromiums(scene)


@pytest.fixture
def drawing(monkeypatch: pytest.MonkeyPatch) -> Drawing:
    """What draws the scene of the test's server; to be asked for before that server."""
    drawing = Drawing()
    monkeypatch.setattr(footfall_ui.scene_server, "open_viser", drawing.open)
    return drawing


@pytest.fixture
def physics() -> bool:
    """Whether the page's rover has masses and springs."""
    return False


@pytest.fixture
def sample() -> str:
    """The sample session that the page opens; its commands hold the pose."""
    return "rock-step"


@pytest.fixture
def served(tmp_path: Path, scene: bool, physics: bool, sample: str) -> Iterator[Running]:
    """The sample, open, with its rover connected."""
    session = lay_sample(sample, tmp_path)
    with running_server(tmp_path, scene=scene, prepare=lambda s: s.open(session), physics=physics) as running:
        running.rover.start()
        until(lambda: current(running).rover.frame, "the first telemetry")
        yield running


@pytest.fixture
def layout() -> str | None:
    """The layout that the page begins in: most tests are about single steps. None: as it is delivered."""
    return STEPS


@contextmanager
def opened(chromium: Browser, served: Running, query: str, layout: str | None = STEPS) -> Iterator[Page]:
    """The operator's page of the open sample; a script error or a failed request that nobody expected fails."""
    context = chromium.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    if layout:
        lay_out(context, layout)
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("response", lambda answer: faults.append(f"{answer.status} {answer.url}") if answer.status >= 500 else None)
    page.goto(f"{served.url}/?{query}")
    page.get_by_text(current(served).state.name, exact=True).wait_for()
    yield page
    with else_after(BOUND / 4, kill_browsers):  # while its page is loaded anew, Chromium may close it never
        context.close()
    assert not faults


@pytest.fixture
def page(chromium: Browser, served: Running, scene: bool, layout: str | None) -> Iterator[Page]:
    """The page of a session with a rover; its scene is drawn where the test is marked so."""
    with opened(chromium, served, "fixedDpr=0.5" if scene else "scene=off", layout) as page:
        yield page


@pytest.fixture
def quiet(tmp_path: Path, sample: str) -> Iterator[Running]:
    """The sample, open; neither rover nor scene."""
    session = lay_sample(sample, tmp_path)
    with running_server(tmp_path, prepare=lambda s: s.open(session)) as running:
        yield running


@pytest.fixture
def console(chromium: Browser, quiet: Running, layout: str | None) -> Iterator[Page]:
    """The page of a session without a rover, its scene switched off."""
    with opened(chromium, quiet, "scene=off", layout) as page:
        expect(page.locator("#timeline-text")).to_contain_text("Latest")
        yield page


@pytest.fixture
def look_at(request: pytest.FixtureRequest) -> Callable[[Page, str], None]:
    """Keep a picture of a page as an output of the test run."""
    OUTPUTS.mkdir(parents=True, exist_ok=True)

    def keep(page: Page, name: str) -> None:
        page.screenshot(path=OUTPUTS / f"{request.node.name}-{name}.png")

    return keep


@pytest.fixture
def look(request: pytest.FixtureRequest, look_at: Callable[[Page, str], None]) -> Callable[[str], None]:
    """Keep a picture of the test's page, with its scene or without."""
    shown = "console" if "console" in request.fixturenames else "page"
    page: Page = request.getfixturevalue(shown)
    return lambda name: look_at(page, name)
