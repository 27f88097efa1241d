"""A whole walk on the ground in front of the operator: numbered footfalls, ghost, strip; and one on a tether."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.session.jobs.requests import WalkRequest
from footfall.session.products.kinds import WALK
from tests.support.laid_sample import lay_sample
from tests.support.page_steps import SESSION, held
from tests.support.server import Running, running_server
from tests.support.waiting import until

Keep = Callable[[str], None]


@pytest.fixture
def layout() -> None:
    """As it is delivered: the one for walks."""


@pytest.fixture
def served(tmp_path: Path, sample: str) -> Iterator[Running]:
    """The sample, open, with no rover: none is simulated that hangs on a tether."""
    session = lay_sample(sample, tmp_path)
    with running_server(tmp_path, scene=True, prepare=lambda s: s.open(session)) as running:
        yield running


def half_way(page: Page, served: Running) -> dict[str, Any]:
    """The walk that the session has, once the page's ghost stands in the middle of it."""
    made = held(served, f"{SESSION}/walks/current")
    assert made["plan"], made["reason"]
    page.locator("#area-walk").click()
    expect(page.locator("#walk-answer ol li")).to_have_count(len(made["plan"]["legs"]))
    page.locator("#scrub").fill("500")
    until(lambda: abs(held(served)["view"]["scrub"] - 0.5) < 1e-9, "the ghost in the middle")
    return made


@pytest.mark.scene
def test_a_planned_walk_lies_on_the_ground(page: Page, served: Running, look: Keep) -> None:
    live = served.sessions.current
    assert live is not None
    live.stances.ask(WALK, WalkRequest(WalkGoal(1.15, 0.0), WalkSettings(seed=1))).finish()
    expect(page.locator("#scene-note")).to_be_hidden()
    page.frame_locator("#scene").locator("canvas").first.wait_for()
    half_way(page, served)
    look("half-way")


@pytest.mark.scene
@pytest.mark.parametrize("sample", ["rappel"])
def test_a_walk_on_a_tether(page: Page, served: Running, look: Keep) -> None:
    expect(page.locator("#scene-note")).to_be_hidden()
    page.frame_locator("#scene").locator("canvas").first.wait_for()
    made = half_way(page, served)
    assert made["plan"]["tethered"]
    look("half-way")
