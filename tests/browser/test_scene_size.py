"""The scene knows how large the page shows it, in the page's own pixels: labels are arranged for those."""

import pytest
from playwright.sync_api import Page, Request

from tests.support.waiting import until

SIZE = "one => ({width: one.clientWidth, height: one.clientHeight})"


@pytest.mark.scene
def test_the_page_says_how_large_it_shows_the_scene_and_says_so_again_when_that_changes(page: Page) -> None:
    said: list[Request] = []
    page.on("request", lambda one: said.append(one) if one.url.endswith("/scene/size") else None)
    frame = page.locator("#scene")
    for width in (1000, 1400):
        before = frame.evaluate(SIZE)
        page.set_viewport_size({"width": width, "height": 700})
        assert frame.evaluate(SIZE) != before
        until(
            lambda: frame.evaluate(SIZE) in [one.post_data_json for one in said[-1:]],
            "the frame's size",
            seen=lambda: (frame.evaluate(SIZE), [one.post_data_json for one in said]),
        )
    answer = said[-1].response()
    assert answer is not None
    assert answer.status == 204
