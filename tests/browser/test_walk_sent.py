"""A walk of one metre over the sample's rocks, mapped from images: planned, armed and sent, its acts counted."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.support.page_steps import SESSION, held
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]
MOST_ACTS = 9
CARD = "async () => (await import('/js/page.js')).modules['layout/states.js'].stateOf('walk')"
"""What the card of the walk says while it is closed."""


class Hand:
    """Counts what an operator does: each press of a button, and each field that is filled."""

    def __init__(self, page: Page) -> None:
        self.page, self.acts = page, 0

    def press(self, selector: str) -> None:
        button = self.page.locator(selector)
        expect(button).to_be_enabled()
        button.click()
        self.acts += 1

    def fill(self, selector: str, text: str) -> None:
        self.page.locator(selector).fill(text)
        self.acts += 1


@pytest.fixture
def layout() -> None:
    """As it is delivered: the one for walks."""


def at(served: Running) -> np.ndarray:
    """Where the chassis is."""
    live = served.sessions.current
    assert live is not None
    assert live.rover.frame is not None
    return np.array(live.rover.frame.state.T_site_base)[:3, 3]


@pytest.mark.long
def test_one_metre_is_walked_in_few_acts(page: Page, served: Running, look: Keep) -> None:
    assert held(served)["terrain"]["name"].startswith("images")
    begin = at(served)
    hand = Hand(page)
    hand.press("#area-goal")
    hand.fill("#walk-ahead", "1")
    hand.press("#plan-walk")
    until(lambda: held(served)["walking"], "the walk")
    walking = held(served)["walking"]
    legs = held(served, f"{SESSION}/walks/current")["plan"]["legs"]
    first = f"foot move 1 of {len(legs)}: leg {legs[0]}"
    expect(page.locator("#walk-done")).to_have_text(f"nothing of it was carried out yet; next: {first}")
    expect(page.locator("#walk-next")).to_have_text(f"Next: foot move 1 – leg {legs[0]}")
    expect(page.locator("#walk-answer ol li[aria-current]")).to_have_count(1)
    expect(page.locator("#job-said")).to_have_text("Walk found")
    look("planned")

    # one foot move: look, accept, send
    hand.press("#walk-next")
    expect(page.locator("#commands tr.group")).to_have_count(1)
    expect(page.locator("#commands tr.group")).to_contain_text(first)
    hand.press("#arm")
    hand.press("#send")
    until(lambda: held(served)["walking"]["done"] == 1, "the first foot move")
    expect(page.locator("#walk-done")).to_contain_text(f"{first} done; next: foot move 2")
    expect(page.locator("#walk-answer ol li.done")).to_have_count(1)
    until(lambda: held(served)["gate"]["state"] == "idle", "the end of the first foot move")
    expect(page.locator("#walk-doubt")).to_be_hidden()
    expect(page.locator("#walk-against")).to_be_hidden()
    assert page.evaluate(CARD) == f"1 of {len(legs)} foot moves done"
    assert at(served)[0] - begin[0] > 0.0

    # and all that is left, which is looked at after each
    hand.press("#walk-rest")
    expect(page.locator("#commands tr.group")).to_have_count(walking["of"] - 1)
    hand.press("#arm")
    hand.press("#send")
    look("walking")
    until(lambda: held(served)["gate"]["state"] == "idle", "the rest of the walk")
    last = held(served)
    assert (last["run"]["outcome"], last["run"]["reason"]) == ("done", "")
    assert last["walking"]["next"] is None
    expect(page.locator("#walk-done")).to_have_text(f"all {len(legs)} foot moves done: the walk is over")
    expect(page.locator("#walk-next")).to_be_disabled()
    expect(page.locator("#walk-doubt")).to_be_hidden()
    assert page.evaluate(CARD) == f"all {len(legs)} foot moves done"
    look("arrived")
    assert np.linalg.norm((at(served) - begin)[:2]) >= 0.85
    assert hand.acts <= MOST_ACTS
