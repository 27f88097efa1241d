"""A Chromium that does not answer any more costs one test, not the run."""

import pytest
from playwright.sync_api import Error

from tests.support.browsers import Browsers, kill_browsers
from tests.support.waiting import else_after


def test_what_waits_for_it_fails_and_the_next_test_has_another(chromiums: Browsers) -> None:
    hanging = chromiums(False)
    page = hanging.new_context().new_page()
    with pytest.raises(Error), else_after(1.0, kill_browsers):
        page.evaluate("new Promise(() => {})")
    other = chromiums(False)
    assert other is not hanging
    page = other.new_context().new_page()
    assert page.evaluate("6 * 7") == 42
    page.context.close()
