"""The command sheet in a browser, which shows it and prints it."""

import re

import pytest
from playwright.sync_api import Browser

from footfall.io.exports import export
from tests.support.sequences import HOSTILE, four_kinds


def test_chromium_shows_and_prints_it(chromium: Browser, tmp_path):
    """The consumer: no request, no script, no fault; hostile names come out as they were written; A4 pages."""
    hostile = "".join(HOSTILE)
    sheet = tmp_path / "sheet.html"
    export(four_kinds(phase=hostile), "html", sheet)
    asked, faults = [], []
    page = chromium.new_page()
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text))
    page.on("dialog", lambda dialog: faults.append(dialog.message))
    page.goto(sheet.as_uri())
    assert page.title().startswith("Command sheet: athlete, sequence ")
    assert page.locator("svg").count() == 2
    assert page.locator("tbody tr").count() == 9
    shown = page.locator("tbody tr").first.locator("td").nth(4).inner_text()
    box = page.locator("svg").first.bounding_box()
    assert box is not None
    assert box["width"] == pytest.approx(88 / 25.4 * 96, abs=2)
    printed = page.pdf(prefer_css_page_size=True)
    page.close()
    assert asked == [sheet.as_uri()]
    assert faults == []
    assert "<script>alert(1)</script>" in shown
    assert "</title></style>" in shown
    width, height = (float(number) for number in re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", printed)[0])
    assert (width, height) == pytest.approx((595.3, 841.9), abs=1)
