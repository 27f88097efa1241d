"""The page in a real Chromium: how heavy it is, how soon it is of use, how fast the ghost follows the hand."""

import os
import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page, Playwright, Response, sync_playwright

from benchmarks.console.apart import Apart, served_apart
from benchmarks.timing import Figure
from footfall.cli.doctor import CHROMIUMS

AT_PAR = Path(__file__).with_name("at_par.sh")
DRAWING = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
"""Options of a Chromium that draws 3-D in software."""
USEFUL = """() => new Promise((done) => {
  const look = () => {
    const shown = document.getElementById("status-session")?.textContent ?? "–";
    if (shown === "–") setTimeout(look, 5); else done(performance.now() / 1000);
  };
  look();
})"""
SCRUB = """(seconds) => new Promise((done) => {
  const slider = document.getElementById("scrub");
  const end = performance.now() + seconds * 1000;
  const move = () => {
    if (performance.now() > end) return done();
    slider.value = String((Number(slider.value) + 7) % 1000);
    slider.dispatchEvent(new Event("input"));
    setTimeout(move, 10);
  };
  move();
})"""


def chromium_path() -> str:
    """Where the distribution's Chromium is. Raises RuntimeError."""
    path = next((found for name in CHROMIUMS if (found := shutil.which(name))), None)
    if path is None:
        raise RuntimeError("this needs Chromium; `make test` installs it")
    return path


def launched(playwright: Playwright, options: Sequence[str]) -> Browser:
    """It, at the priority of other programs; ``options``: of its command line. Raises RuntimeError."""
    environment: dict[str, str | float | bool] = {**os.environ, "CHROMIUM": chromium_path()}
    return playwright.chromium.launch(executable_path=AT_PAR, args=["--no-sandbox", *options], env=environment)


@contextmanager
def chromium() -> Iterator[Browser]:
    """It, drawing in software."""
    with sync_playwright() as playwright:
        browser = launched(playwright, DRAWING)
        yield browser
        browser.close()


def figures(quick: bool) -> Iterator[Figure]:
    times = 3 if quick else 10
    with served_apart() as served, chromium() as browser:
        opened = [first_use(browser, served) for _ in range(times)]
        yield Figure("console.page_weight_served", tuple(float(weight) for weight, _ in opened), "bytes", 2.0**20)
        yield Figure("console.first_useful_paint", tuple(seconds for _, seconds in opened), "s", 1.5)
        yield Figure("console.scrub_updates", tuple(scrubs(browser, served, times)), "1/s", 25.0, at_most=False)


def first_use(browser: Browser, served: Apart) -> tuple[int, float]:
    """(bytes of all that the page loads but the scene, as sent; seconds until its status bar tells the session)."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    loaded: list[Response] = []
    page.on("response", lambda answer: loaded.append(answer) if is_ours(answer.url) else None)
    page.goto(f"{served.url}/?scene=off")
    seconds = page.evaluate(USEFUL)
    weight = sum(answer.request.sizes()["responseBodySize"] for answer in loaded if answer.ok)
    page.close()
    return weight, seconds


def is_ours(url: str) -> bool:
    """Whether an address is of the page itself: neither the scene nor what the interface answers."""
    return "/scene/" not in url and "/api/" not in url


def scrubs(browser: Browser, served: Apart, times: int) -> Iterator[float]:
    """Updates of the ghost that the page sends a second while its slider is dragged, the scene drawn beside it."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.goto(f"{served.url}/?fixedDpr=0.5")
    page.locator("#scrub:enabled").wait_for()
    for _ in range(times):
        yield updates(page, 3.0)
    page.close()


def updates(page: Page, seconds: float) -> float:
    answered: list[str] = []

    def heard(answer: Response) -> None:
        if answer.url.endswith("/view") and answer.request.method == "PUT" and answer.ok:
            answered.append(answer.url)

    page.on("response", heard)
    begin = time.perf_counter()
    page.evaluate(SCRUB, seconds)
    rate = len(answered) / (time.perf_counter() - begin)
    page.remove_listener("response", heard)
    return rate
