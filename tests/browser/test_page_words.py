"""The page's words come from the catalogue before anything else runs; a browser without scripts says what is wrong."""

import pytest
from playwright.sync_api import Browser, Page, expect

from footfall.io.joined_files import joined_module
from footfall.resources import static_folder
from tests.architecture.test_page_markup import NAMES
from tests.support.server import Running

READ = """(names) => names.flatMap((name) => [...document.querySelectorAll(`[${name}]`)].map((one) => {
  const attribute = { "data-title": "title", "data-label": "aria-label", "data-placeholder": "placeholder" }[name];
  return [one.getAttribute(name), attribute ? one.getAttribute(attribute) : one.textContent];
}))"""
"""Every key of the markup, with what is read where it stands."""
WITHIN = """(selector) => [...document.querySelector(selector).closest("label").childNodes]
  .map((one) => one.nodeType === Node.TEXT_NODE ? one.data.trim() : one.id).filter(Boolean)"""
"""What a label holds, in order."""


@pytest.fixture
def unstarted(quiet: Running, chromium: Browser):
    """The page with the words that it runs first, and nothing of what follows them."""
    context = chromium.new_context()
    page = context.new_page()
    words = joined_module(static_folder() / "js/fill.js").text
    page.route("**/js/page.js", lambda route: route.fulfill(body=words, content_type="text/javascript"))
    page.goto(f"{quiet.url}/?scene=off")
    yield page
    context.close()


def test_every_word_stands_before_the_page_starts(unstarted: Page):
    expect(unstarted.locator("#stop")).to_have_text("STOP")
    read = unstarted.evaluate(READ, list(NAMES))
    assert len(read) > 400
    assert [key for key, text in read if not text.strip() or text == key or "{}" in text] == []
    assert unstarted.evaluate(WITHIN, "#clear-radius") == ["Radius", "clear-radius", "m"]
    assert unstarted.evaluate(WITHIN, "#conservative") == ["conservative", "conservative support"]
    expect(unstarted.get_by_label("Go m")).to_have_id("walk-ahead")
    expect(unstarted.get_by_placeholder("as is")).to_have_id("payload")
    expect(unstarted.get_by_role("button", name="Find Ctrl+K")).to_have_attribute("id", "open-palette")
    assert unstarted.locator("#scan-up").evaluate("(box) => [...box.options].map((one) => [one.value, one.text])") == [
        ["", "as its file says"], ["z", "z"], ["y", "y"], ["x", "x"], ["-z", "−z"], ["-y", "−y"], ["-x", "−x"],
    ]  # fmt: skip


def test_without_scripts_the_page_says_what_is_wrong_and_nothing_else(quiet: Running, chromium: Browser):
    context = chromium.new_context(java_script_enabled=False)
    page = context.new_page()
    for address, needs in (("/", "This page needs JavaScript"), ("/login.html", "Logging in needs JavaScript")):
        page.goto(quiet.url + address)
        said = page.locator("noscript p")  # an element only where no script runs
        expect(said).to_be_visible()
        expect(said).to_contain_text(needs)
        expect(said).to_contain_text("Nobody can STOP THE ROVER from here")
        expect(page.get_by_role("button", name="STOP")).to_have_count(0)
    context.close()
