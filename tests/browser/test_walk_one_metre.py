"""One metre over the sample's rocks, from images on, by the one button that says what comes next, every act counted."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from benchmarks.soak.processes import RoverProcess
from footfall.io.artifacts import encode
from footfall.io.terrain_files import write_terrain
from footfall.session import commanding
from footfall.session.gate import checks
from footfall.session.log.event import loaded_world
from footfall.telemetry.link import PATH
from footfall.terrain.dem import Dem
from tests.support.page_steps import held, keep_pressed
from tests.support.server import Running, running_server
from tests.support.waiting import BOUND_MS, until

Keep = Callable[[str], None]
README = Path(__file__).resolve().parents[2] / "README.md"
MOST_ACTS = 15
METRES = 1.15
"""Asked for: a walk ends within 0.15 m of its goal."""
HURRY = 5.0
"""How much faster than the world the rover's time runs."""


@pytest.fixture
def layout() -> None:
    """As it is delivered: the one for walks."""


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Running]:
    """The rock-step sample, open, with a rover on the link whose time runs faster."""
    folder = tmp_path / "rover"
    folder.mkdir()
    with running_server(tmp_path / "sessions", prepare=lambda s: s.open_sample("rock-step")) as running:
        live = running.sessions.current
        assert live is not None
        world, state = loaded_world(live.events()), live.state.state
        assert world is not None
        assert state is not None
        write_terrain(cast(Dem, live.get(world)), folder / "world.npz")
        (folder / "state.npz").write_bytes(encode(live.get(state)))
        rover = RoverProcess(folder, HURRY)
        rover.start(f"ws{running.url.removeprefix('http')}{PATH}")
        try:
            until(lambda: live.rover.frame, "the first telemetry")
            yield running
        finally:
            rover.end()


@pytest.fixture(autouse=True)
def never_stale(monkeypatch: pytest.MonkeyPatch) -> None:
    """Telemetry is fresh for as long as a slow machine may take."""
    for module in (checks, commanding):
        monkeypatch.setattr(module, "STALE_AFTER", 1e9)


class Operator:
    """Does what is done at the page, and counts it: a click, a button held down and a field typed are one act each.

    done: what was pressed and filled in, by its name on the page, without what stands behind a colon.
    """

    def __init__(self, page: Page) -> None:
        self.page = page
        self.done: list[str] = []

    def goes_on(self, text: str) -> None:
        """Press what comes next, once it is what that text says."""
        button = self.page.locator("#next-act")
        expect(button).to_have_text(re.compile(text), timeout=BOUND_MS)
        expect(button).to_be_enabled()
        self._acts(button.inner_text(), button.click)

    def sends(self) -> None:
        """Hold what comes next down until it has acted."""
        expect(self.page.locator("#next-hold")).to_have_text("Send to rover", timeout=BOUND_MS)
        self._acts("Send to rover", lambda: keep_pressed(self.page, "#next-hold"))

    def types(self, selector: str, text: str) -> None:
        field = self.page.locator(selector)
        name = self.page.locator("label").filter(has=field).inner_text()
        self._acts(re.sub(r"\s*m$", "", name).strip(), lambda: field.fill(text))

    def _acts(self, name: str, act: Callable[[], None]) -> None:
        act()
        self.done.append(name.split(":")[0])


def chassis(served: Running) -> np.ndarray:
    """Where it is by the latest telemetry [m]."""
    live = served.sessions.current
    assert live is not None
    assert live.rover.frame is not None
    return np.array(live.rover.frame.state.T_site_base)[:3, 3]


@pytest.mark.long
def test_one_metre_from_images_on(page: Page, served: Running, look: Keep) -> None:
    operator, began = Operator(page), chassis(served)
    before = held(served)
    operator.goes_on("^Take images$")
    operator.goes_on("^Build terrain$")
    operator.goes_on("^Walk to…$")
    operator.types("#walk-ahead", str(METRES))
    operator.goes_on("^Plan walk$")
    expect(page.locator("#verdict")).to_have_text(re.compile("^Walk found: [0-9]+ foot moves"), timeout=BOUND_MS)
    look("planned")
    operator.goes_on("^Make commands: [0-9]+ foot moves to the goal$")
    operator.goes_on("^Arm$")
    look("armed")
    operator.sends()
    expect(page.locator("#next-act")).to_have_text(re.compile("^Under way: "), timeout=BOUND_MS)
    expect(page.locator("#next-act")).to_be_disabled()
    expect(page.locator("#stop")).to_be_enabled()
    until(lambda: (held(served)["run"] or {}).get("state") == "ended", "the end of the run")
    now = held(served)
    assert (now["run"]["outcome"], now["run"]["reason"]) == ("done", "")
    assert now["snapshot"] != before["snapshot"]
    assert now["dem"] != before["dem"]
    assert np.linalg.norm((chassis(served) - began)[:2]) >= 1.0
    expect(page.locator("#next-act")).to_have_text("Look again: take images", timeout=BOUND_MS)
    expect(page.locator("#verdict")).to_have_text("Run 1 carried out as commanded", timeout=BOUND_MS)
    expect(page.locator("#outcome-table tbody tr")).not_to_have_count(0)
    expect(page.locator("#least-clearances tbody tr")).not_to_have_count(0)
    for said in ("#verdict", "#next-about", "#next-act", "#stop"):
        expect(page.locator(said)).to_be_in_viewport(ratio=1)
    look("arrived")
    assert len(operator.done) <= MOST_ACTS
    named = re.findall(r"\*\*(.+?)\*\*", README.read_text().split("A metre takes eight acts:")[1].split("\n\n")[0])
    assert operator.done == named
