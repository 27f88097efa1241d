"""On a tablet stop, status, scene and the next act stay in sight while commands go out; a finger meets what it aims at.

And in any width the words of a stop lie over nothing else of the status bar.
"""

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.test_page import COVERED
from tests.support.server import Running
from tests.support.spoken import current, say
from tests.support.waiting import BOUND, until

FREQUENT = [
    *("#stop", "#next-act", "#walk-until", "#legs button", "#ghost-play", "#scrub", "#timeline-back", "#timeline-on"),
    *("#timeline-now", "#note-open", "#arm", "#send", "#run-hold", "#run-abort", "#export"),
]
FINGER = 44
"""A target's least width and height [px], as WCAG 2.5.5 has it."""
IN_SIGHT = ["#stop", "#stop-state", "#status-link", "#status-mode", "#status-match", "#next-act", ".scene", "#scrub"]
SIZES = [(1024, 768), (768, 1024)]
IN_THE_MIDDLE = """one => {
  one.scrollIntoView({ block: "center" });
  return new Promise(done => new IntersectionObserver(([seen], watch) => {
    watch.disconnect();
    done(seen.intersectionRatio === 1);
  }).observe(one));
}"""
"""Scrolls to it, and says whether all of it is in sight when the page is drawn."""


@pytest.fixture(params=SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def tablet(chromium: Browser, quiet: Running, request: pytest.FixtureRequest) -> Iterator[Page]:
    width, height = request.param
    context = chromium.new_context(viewport={"width": width, "height": height}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.goto(f"{quiet.url}/?scene=off")
    expect(page.locator("#timeline-text")).to_contain_text("Latest", timeout=BOUND * 1000)
    yield page
    context.close()


def sending(quiet: Running) -> None:
    """A run whose first row is with the rover."""
    live = current(quiet)
    live.rover.connected(lambda text: None)
    say(quiet, 1)
    live.commands.send(live.commands.arm()["token"])


def test_what_counts_stays_in_sight_while_commands_go_out(
    tablet: Page, quiet: Running, look_at: Callable[[Page, str], None]
) -> None:
    sending(quiet)
    tablet.locator("#layout").select_option("execute")
    expect(tablet.locator("#arm-state")).to_be_visible()
    for end in ("#h-commands", "#clearances-note", "#send"):
        # what is drawn above it meanwhile moves it on: it is in sight once nothing does
        until(lambda end=end: tablet.locator(end).evaluate(IN_THE_MIDDLE), f"{end} in sight")
        for part in IN_SIGHT:
            expect(tablet.locator(part)).to_be_in_viewport(ratio=1)
    assert tablet.evaluate("() => [scrollX, scrollY, document.querySelector('main').scrollTop]") == [0, 0, 0]
    look_at(tablet, "sending")


MEASURED = """selectors => {
  const run = document.getElementById("run-acts");
  for (const one of [run, ...run.children]) one.hidden = false;
  return selectors.flatMap(selector => [...document.querySelectorAll(selector)].map(one => {
    const { width, height } = one.getBoundingClientRect();
    return [selector, width, height];
  }));
}"""
"""Shows what a run shows, and measures at once: a rover that falls silent ends a run at any moment."""


def test_a_finger_meets_what_is_used_often(tablet: Page) -> None:
    assert tablet.evaluate("() => matchMedia('(pointer: coarse)').matches")
    tablet.locator("#layout").select_option("execute")
    expect(tablet.locator("#send")).to_be_visible()
    found = tablet.evaluate(MEASURED, FREQUENT)
    assert {selector for selector, *_ in found} == set(FREQUENT)
    assert [one for one in found if min(one[1:]) < FINGER - 0.01] == []


def test_nothing_over_the_scene_covers_anything_else_on_a_tablet(tablet: Page) -> None:
    expect(tablet.locator("#scrub-time")).to_be_visible()
    for layout in ("walk", "plan a step", "execute", "review", "plots"):
        tablet.locator("#layout").select_option(layout)
        seen = tablet.evaluate(COVERED)
        assert seen["outside"] == seen["over"] == [], (layout, seen)
        assert seen["height"] >= 270


OVERLAPS = """async () => {
  const texts = (await import("/js/page.js")).modules["texts/link.js"];
  const said = [
    texts.noSafetyStop, texts.stopFailed, texts.standsStopped, texts.stopAcknowledged, texts.stopNotAcknowledged,
    texts.stopWithoutRover, texts.stopBefore(3000, texts.notAcknowledgedBefore),
    texts.stopOnItsWay(texts.arrivesIn(1.2) + texts.answerIn(2.5)),
  ];
  const state = document.getElementById("stop-state");
  const whatIf = document.getElementById("status-what-if-box");
  const header = document.querySelector("header.status").getBoundingClientRect();
  const found = [];
  const server = document.getElementById("status-server");
  const states = [[true, "good"], [false, "good"], [true, "bad"], [false, "bad"]];
  const cases = said.flatMap(text => states.map(state => [text, ...state]));
  for (const [text, hidden, heard] of cases) {
    whatIf.hidden = hidden;
    server.dataset.state = heard;
    server.textContent = heard === "good" ? texts.connected : texts.silentFor(3000);
    state.textContent = text;
    const inForce = text !== texts.noSafetyStop;
    state.className = inForce ? "in-force" : "";
    const named = document.getElementById("status-session").checkVisibility();
    if (inForce && !named) found.push(`no session's name beside: ${text}`);
    document.getElementById("stop-clear").hidden = !inForce;
    const box = document.querySelector(".stop-box").getBoundingClientRect();
    for (const one of document.querySelectorAll("header dl > div")) {
      if (!one.checkVisibility()) continue;
      const range = document.createRange();
      range.selectNodeContents(one.querySelector("dd"));
      const own = range.getBoundingClientRect();
      const apart = own.right <= box.left || own.left >= box.right || own.bottom <= box.top || own.top >= box.bottom;
      if (!apart || own.right > innerWidth + 1) found.push(`${one.textContent} and ${text}, server ${heard}`);
    }
    const words = document.createRange();
    words.selectNodeContents(state);
    const own = words.getBoundingClientRect();
    if (own.top < header.top || own.bottom > header.bottom) found.push(`cut off: ${text}`);
  }
  return found;
}"""
"""Sets all that a stop may say, with a what-if and without, of a server that is heard and one that is silent.

Measures at once, before the page draws again."""


@pytest.mark.parametrize("width", [768, 1024, 1200, 1251, 1280, 1366, 1600])
def test_the_words_of_a_stop_lie_over_nothing_else(console: Page, width: int) -> None:
    console.set_viewport_size({"width": width, "height": 800})
    expect(console.locator("#status-server")).to_have_text("connected")
    assert console.evaluate(OVERLAPS) == []


IN_PART = """() => {
  const { offsetLeft: left, offsetTop: top, width, height, scale } = visualViewport;
  const stop = document.getElementById("stop");
  const box = stop.getBoundingClientRect();
  const whole = box.left >= left && box.right <= left + width + 1 && box.top >= top && box.bottom <= top + height + 1;
  const hit = document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2);
  return { scale, left, top, whole, hit: hit === stop, width: box.width * scale };
}"""
"""Whether STOP lies in the part of the page that is in sight, over all else, and how wide it is on the screen."""


def test_stop_stays_in_sight_where_a_part_of_the_page_is_shown(
    tablet: Page, look_at: Callable[[Page, str], None]
) -> None:
    before = tablet.evaluate(IN_PART)
    assert (before["scale"], before["whole"]) == (1, True)
    device = tablet.context.new_cdp_session(tablet)
    device.send("Emulation.setPageScaleFactor", {"pageScaleFactor": 2.5})
    tablet.locator("#note-open").evaluate("one => one.scrollIntoView()")
    until(lambda: tablet.evaluate(IN_PART)["top"] > 100, "a part of the page, made larger")
    until(lambda: tablet.evaluate(IN_PART)["whole"], "STOP in sight")
    seen = tablet.evaluate(IN_PART)
    assert seen["scale"] == pytest.approx(2.5)
    assert seen["hit"]
    assert seen["width"] == pytest.approx(before["width"], abs=1)
    look_at(tablet, "part")
    device.send("Emulation.setPageScaleFactor", {"pageScaleFactor": 1})
    expect(tablet.locator("#stop")).not_to_have_class("adrift")
    assert tablet.evaluate(IN_PART)["whole"]


CUT = "one => one.scrollWidth > one.clientWidth + 1 || one.scrollHeight > one.clientHeight + 1"


def test_beside_a_stop_in_force_the_bar_says_which_session_it_is(console: Page) -> None:
    assert console.evaluate("innerWidth") == 1280
    console.locator("#stop").click()
    expect(console.locator("#stop-state")).to_contain_text("Stop in force")
    name = console.locator("#status-session")
    expect(name).to_be_visible()
    expect(name).to_have_text("Stepping over a rock")
    assert not name.evaluate(CUT)
    server = console.locator("#status-server")
    expect(server).to_be_hidden()  # while all is well with it
    assert server.evaluate("(one) => { one.dataset.state = 'bad'; return one.checkVisibility(); }")
