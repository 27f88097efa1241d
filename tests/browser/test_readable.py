"""What an operator reads at a glance: as clear as the rest in every theme, and apart from what stands beside it."""

import pytest
from playwright.sync_api import Page, expect

from tests.architecture.test_page_themes import FLOORS, Color, contrast, over

SEEN = """selector => {
  const told = { color: getComputedStyle(document.querySelector(selector)).color, under: [], opacity: 1 };
  for (let one = document.querySelector(selector); one; one = one.parentElement) {
    told.under.push(getComputedStyle(one).backgroundColor);
    told.opacity *= Number(getComputedStyle(one).opacity);
  }
  return told;
}"""
"""A text's colour, those that lie under it from the nearest on, and how much of it is seen."""
LINES = """selector => {
  const text = document.createRange();
  text.selectNodeContents(document.querySelector(selector));
  return new Set([...text.getClientRects()].map(one => Math.round(one.top))).size;
}"""
APART = """([before, after]) => {
  const edges = [before, after].map(selector => {
    const text = document.createRange();
    text.selectNodeContents(document.querySelector(selector));
    return text.getBoundingClientRect();
  });
  return edges[1].left - edges[0].right;
}"""
SAMPLES = """() => [...document.querySelectorAll("#gauge-outlines label")].map(label => {
  const line = label.querySelector(".line").getBoundingClientRect();
  const text = document.createRange();
  text.selectNodeContents([...label.childNodes].findLast(one => one.textContent.trim()));
  const rim = 3; // px of the dark ground around the line
  return Math.min(
    text.getBoundingClientRect().left - line.right - rim,
    line.left - rim - label.querySelector("input").getBoundingClientRect().right,
  );
})"""


def rgba(told: str) -> Color:
    """Of a colour as browsers compute it."""
    parts = [float(one) for one in told[told.index("(") + 1 : -1].split(",")]
    r, g, b = (one / 255 for one in parts[:3])
    return r, g, b, parts[3] if len(parts) > 3 else 1.0


LONG_SEEN = """async () => {
  const { known, changed } = (await import("/js/page.js")).modules["store.js"];
  const summary = { ...known.summary, terrain: { ...known.summary.terrain, seen: 1e9 } };
  Object.defineProperty(known, "summary", { get: () => summary, set: () => {} });
  changed();
}"""
"""The ground was seen so long ago that new images are next, for which there is no rover."""


@pytest.mark.parametrize("theme", FLOORS)
def test_what_is_next_is_read_also_while_it_can_t_be_done(console: Page, theme: str) -> None:
    console.get_by_label("Theme").select_option(theme)
    console.evaluate(LONG_SEEN)
    expect(console.locator("#next-act")).to_be_disabled()
    seen = console.evaluate(SEEN, "#next-act")
    under: Color = (0.0, 0.0, 0.0, 1.0)
    for layer in reversed(seen["under"]):
        under = over(rgba(layer), under)
    r, g, b, _ = rgba(seen["color"])
    assert contrast(over((r, g, b, seen["opacity"]), under), under) >= FLOORS[theme]


@pytest.mark.parametrize("theme", FLOORS)
def test_the_samples_of_the_gauge_stand_apart_from_their_words(console: Page, theme: str) -> None:
    console.get_by_label("Theme").select_option(theme)
    expect(console.locator("#gauge-outlines")).to_be_visible()
    apart = console.evaluate(SAMPLES)
    assert len(apart) == 3
    assert min(apart) >= 2
    tops = console.locator("#gauge-outlines label").evaluate_all(
        "all => all.map(one => one.getBoundingClientRect().top)"
    )
    assert max(tops) == min(tops), "they share one line"


def test_who_may_command_is_one_line_where_there_is_room(console: Page) -> None:
    expect(console.locator("#status-user")).to_contain_text("No login")
    console.set_viewport_size({"width": 1920, "height": 1080})
    assert console.evaluate(LINES, "#status-user") == 1
    assert console.evaluate("() => document.documentElement.scrollWidth <= innerWidth")


RUN = """async () => {
  const { known, changed } = (await import("/js/page.js")).modules["store.js"];
  for (const one of known.sequence.commands) one.name = "POSTURE_MOVE";
  known.sequence.legs.fill(null);
  const told = { state: "received", reason: "", times: { received: 1e9 } };
  const rows = known.sequence.commands.map((_, row) => ({ row, ...told }));
  const summary = { ...known.summary, run: { ...known.summary.run, sequence: known.sequence.digest, rows } };
  Object.defineProperty(known, "summary", { get: () => summary, set: () => {} });
  changed();
  for (const one of document.querySelectorAll("#side, .table-scroll")) one.style.borderRight = "15px solid";
}"""
"""Every row was acknowledged, whatever the server says later; and there is room for the bars that other browsers scroll
by, which the tests' hides."""


@pytest.mark.parametrize("width", [1280, 1024])
def test_all_columns_of_the_commands_are_in_sight_during_a_run(console: Page, width: int) -> None:
    console.set_viewport_size({"width": width, "height": 720})
    console.evaluate(RUN)
    expect(console.locator("#commands tbody tr").first).to_contain_text("acknowledged 01:46:40")
    table = console.locator(".table-scroll:has(#commands)")
    assert table.evaluate("one => one.scrollWidth <= one.clientWidth")
    assert console.locator("#side").evaluate("one => one.scrollWidth <= one.clientWidth")
    console.get_by_role("button", name="Delete row 1", exact=True).scroll_into_view_if_needed()
    expect(console.get_by_role("button", name="Delete row 1", exact=True)).to_be_in_viewport(ratio=1)


def test_the_longest_command_is_not_one_word_with_its_leg(console: Page) -> None:
    row = "#commands tbody tr:first-child td:nth-child({})"
    console.locator(row.format(2)).evaluate("one => { one.textContent = 'POSTURE_MOVE'; }")
    console.locator(row.format(3)).evaluate("one => { one.textContent = 'all'; }")
    assert console.evaluate(APART, [row.format(2), row.format(3)]) >= 8
    assert console.locator("#panel-commands").evaluate("one => one.scrollWidth <= one.clientWidth")


MIDDLES = """() => [...document.querySelectorAll("#commands tbody input")].map(field => {
  const text = document.createRange();
  text.selectNodeContents(field.closest("tr").cells[1]);
  const [word, box] = [text, field].map(one => one.getBoundingClientRect());
  return (word.top + word.bottom) / 2 - (box.top + box.bottom) / 2;
})"""
"""By how much each command's name is lower than its field [px]."""


def test_a_command_s_words_are_in_line_with_its_field(console: Page) -> None:
    expect(console.locator("#commands input").first).to_be_visible()
    middles = console.evaluate(MIDDLES)
    assert len(middles) > 10
    assert max(abs(one) for one in middles) < 2, middles


LONGEST = """text => {
  const read = document.getElementById("scrub-read");
  const before = document.getElementById("ghost").offsetHeight;
  read.textContent = text;
  return {
    cut: [read.scrollWidth - read.clientWidth, read.scrollHeight - read.clientHeight],
    grown: document.getElementById("ghost").offsetHeight - before,
  };
}"""


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1920, 1080)])
def test_where_the_ghost_is_in_the_commands_is_read_in_full(console: Page, width: int, height: int) -> None:
    console.set_viewport_size({"width": width, "height": height})
    expect(console.locator("#scrub-read")).to_contain_text("of the")
    seen = console.evaluate(LONGEST, "100 % of the commands, POSTURE_MOVE, row 1376 of 1376")
    assert seen == {"cut": [0, 0], "grown": 0}
