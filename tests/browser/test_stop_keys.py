"""Ctrl+. and Escape twice ask for a stop from wherever the keyboard is, and never die unheard with the focus."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect

from footfall.planning.walk.problem import WalkGoal
from tests.browser.conftest import opened
from tests.browser.pictures import OUTPUTS
from tests.support.browsers import Browsers
from tests.support.page_steps import held
from tests.support.server import Running, running_server
from tests.support.spoken import current
from tests.support.waiting import until

WAYS = {"ctrl": ("Control+.",), "escape": ("Escape", "Escape")}
SCENE = re.compile(r"/scene/(\?.*)?$")
INSIDE = (
    "<body style='padding: 170px 0 0 250px'><button>inside</button><input id=field>"
    "<br><iframe id=inner srcdoc='<input id=deep>'></iframe>"
)
"""Clear of what lies over the scene."""
FORGET = """async () => {
  const { asksToStop } = (await import("/js/page.js")).modules["stopkeys.js"];
  asksToStop({ key: "Escape", timeStamp: -1e12 });  // an Escape of the test before is no first of two
}"""
SHOW = """one => {
  for (let part = one; part; part = part.parentElement) {
    part.hidden = false;
    if (part.tagName === "DETAILS") part.open = true;
  }
  one.disabled = false;
}"""
RESET = """() => {
  for (const one of document.querySelectorAll("dialog[open]")) one.close();
  document.getElementById("written")?.remove();
  document.activeElement.blur();
  window.focus();
}"""
WRITTEN = "document.body.append(Object.assign(document.createElement('p'), { id: 'written', contentEditable: 'true' }))"
FOCUSABLE = """() => [...document.querySelectorAll("a[href], button, input, select, textarea, summary, [tabindex]")]
  .map((one, i) => { one.dataset.walked = i; return one.id || one.textContent.trim().slice(0, 30); })"""
DEAF = """() => {
  window.heardBefore = { fetch: window.fetch, send: WebSocket.prototype.send };
  window.fetch = (address, { signal } = {}) => new Promise((_, fail) => signal?.addEventListener("abort", fail));
  WebSocket.prototype.send = () => {};
}"""
COUNTED = """() => {
  window.sendBefore = WebSocket.prototype.send;
  window.sent = 0;
  WebSocket.prototype.send = function (text) {
    if (!this.url.endsWith("/stop/line")) return sendBefore.call(this, text);
    sent += 1;
    this.dispatchEvent(new MessageEvent("message", { data: "{}" }));  // answered at once: a stop each would take long
  };
}"""
FOCUSED = f"""i => {{
  const one = document.querySelector(`[data-walked="${{i}}"]`);
  ({SHOW})(one);
  one.focus();
  return document.activeElement === one;
}}"""
IN_SIGHT = """one => {
  const { left, right, top, bottom } = one.getBoundingClientRect();
  const hit = (x, y) => one.contains(document.elementFromPoint(x, y));
  return left >= 0 && right <= innerWidth && top >= 0 && bottom <= innerHeight
    && hit(left + 3, top + 3) && hit(right - 3, bottom - 3);
}"""
HEARING = "() => { window.fetch = heardBefore.fetch; WebSocket.prototype.send = heardBefore.send; }"


@pytest.fixture(scope="module")
def quiet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """One server for all of them, without rover and scene."""
    with running_server(tmp_path_factory.mktemp("stop"), prepare=lambda s: s.open_sample("rock-step")) as running:
        yield running


@pytest.fixture(scope="module")
def shared(chromiums: Browsers, quiet: Running) -> Iterator[Page]:
    """One page for all of them, its scene switched off."""
    with opened(chromiums(False), quiet, "scene=off") as page:
        yield page


@pytest.fixture
def bare(shared: Page, quiet: Running) -> Page:
    """The page without a stop, a dialog, a field in use or a frame that shows something."""
    if shared.locator("#scene").get_attribute("src") != "about:blank":
        show(shared, "about:blank")
    shared.evaluate(RESET)
    shared.evaluate(FORGET)
    clear(quiet)
    expect(shared.locator("#stop-clear")).to_be_hidden()
    return shared


def clear(quiet: Running) -> None:
    if current(quiet).commands.gate["stopped"]:
        current(quiet).commands.clear_stop()


def stops(page: Page, quiet: Running, way: str) -> None:
    """The keys reach the server, and the page says so."""
    assert not current(quiet).commands.gate["stopped"]
    for key in WAYS[way]:
        page.keyboard.press(key)
    until(lambda: current(quiet).commands.gate["stopped"], "the stop", period=0.005)
    expect(page.locator("#stop-state")).to_contain_text("Stop in force")


# -- frames ----------------------------------------------------------------------------------


def show(page: Page, address: str) -> None:
    page.locator("#scene").evaluate(
        "(one, address) => new Promise(done => { one.onload = done; one.src = address; })", address
    )


def blank(page: Page) -> None:
    page.locator("#scene").click(position={"x": 400, "y": 250})
    assert page.evaluate("document.activeElement.id") == "scene"  # else it tests nothing


def filled(page: Page, selector: str) -> None:
    """The scene's frame as the proxy serves it: of the page's own origin."""
    page.route(SCENE, lambda route: route.fulfill(content_type="text/html", body=INSIDE))
    show(page, "/scene/")
    page.unroute(SCENE)
    page.frame_locator("#scene").locator(selector).click()


def nested(page: Page) -> None:
    filled(page, "#field")
    page.frame_locator("#scene").frame_locator("#inner").locator("#deep").click()


def loading(page: Page) -> None:
    """A document that is there, and whose load has no end yet."""
    held_up: list[Route] = []
    page.route("**/late.svg", lambda route: held_up.append(route))
    page.route(SCENE, lambda route: route.fulfill(content_type="text/html", body=f"{INSIDE}<img src=/late.svg>"))
    page.locator("#scene").evaluate("one => { one.src = '/scene/'; }")
    page.frame_locator("#scene").locator("#field").click()
    page.unroute(SCENE)
    assert held_up


def foreign(page: Page) -> None:
    """The browser's own page in place of one that the policy does not let in: nobody can listen there."""
    show(page, "http://localhost:9/")
    page.locator("#scene").click(position={"x": 400, "y": 250})
    until(lambda: page.evaluate("document.activeElement.id") != "scene", "the focus back")


FRAMES = {
    "blank": blank,
    "scene": lambda page: filled(page, "button"),
    "field in the scene": lambda page: filled(page, "#field"),
    "frame in the scene": nested,
    "loading scene": loading,
    "foreign": foreign,
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("frame", FRAMES)
def test_from_a_frame(bare: Page, quiet: Running, frame: str, way: str) -> None:
    FRAMES[frame](bare)
    stops(bare, quiet, way)


# -- dialogs and fields ----------------------------------------------------------------------


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("modal", [False, True])
@pytest.mark.parametrize("dialog", ["help", "palette", "shown", "note"])
def test_from_a_dialog(bare: Page, quiet: Running, dialog: str, modal: bool, way: str) -> None:
    bare.locator(f"#{dialog}").evaluate("(one, modal) => modal ? one.showModal() : one.show()", modal)
    bare.locator(f"#{dialog} :is(input, textarea, button)").first.focus()
    stops(bare, quiet, way)


def test_every_dialog_of_the_page_is_among_them(bare: Page) -> None:
    names = bare.locator("dialog").evaluate_all("all => all.map(one => one.id)")
    assert sorted(names) == ["help", "note", "palette", "shown"]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    "field",
    [
        "#footfall-x",
        "#palette-input",
        "#note-text",
        "#timeline-scrub",
        "#conservative",
        "#layout",
        "#written",
        "#picture",
    ],
)
def test_from_a_field(bare: Page, quiet: Running, field: str, way: str) -> None:
    if field == "#written":
        bare.evaluate(WRITTEN)
    bare.locator(field).evaluate(SHOW)
    bare.locator(field).focus()
    stops(bare, quiet, way)


@pytest.mark.parametrize("way", WAYS)
def test_from_a_list_that_is_open(bare: Page, quiet: Running, way: str) -> None:
    bare.locator("#layout").click()
    stops(bare, quiet, way)


AT_STOP = """() => {
  const box = document.getElementById("stop").getBoundingClientRect();
  return document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2).id;
}"""
PUT_AT = "(one, top) => { one.style.cssText = `position:fixed;right:12px;width:200px;top:${top}px`; }"
IS_OPEN = "one => one.matches(':open')"


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1024, 768), (768, 1024)])
def test_no_list_that_is_open_lies_over_stop(bare: Page, width: int, height: int) -> None:
    bare.set_viewport_size({"width": width, "height": height})
    field = bare.locator("#layer")  # the longest of all
    try:
        for top in range(120, height - 40, 40):
            field.evaluate(PUT_AT, top)
            field.press("Space")
            until(lambda: field.evaluate(IS_OPEN), "the open list")
            assert bare.evaluate(AT_STOP) == "stop", top
            bare.locator("h1").click()
            until(lambda: not field.evaluate(IS_OPEN), "the closed list")
    finally:
        field.evaluate("one => one.removeAttribute('style')")
        bare.set_viewport_size({"width": 1280, "height": 720})


def test_from_everything_that_takes_the_focus(bare: Page, quiet: Running) -> None:
    names = bare.evaluate(FOCUSABLE)
    assert len(names) > 150
    bare.evaluate(COUNTED)
    taken = 0
    for i, name in enumerate(names):
        if not bare.evaluate(FOCUSED, i):
            continue
        taken += 1
        bare.evaluate("() => { sent = 0; }")
        bare.keyboard.press("Control+.")
        until(lambda: bare.evaluate("sent") == 1, f"the stop from {name}", period=0.005)
    assert taken > 0.8 * len(names)
    bare.reload()  # as it was before all of it was shown
    bare.get_by_text("Stepping over a rock", exact=True).wait_for()


@pytest.mark.parametrize("key", ["ю", "Process", "."])
def test_on_a_keyboard_whose_period_is_elsewhere_and_while_a_word_is_composed(
    bare: Page, quiet: Running, key: str
) -> None:
    code = "Comma" if key == "." else "Period"
    bare.evaluate(
        """([key, code]) => document.body.dispatchEvent(
            new KeyboardEvent("keydown", { key, code, ctrlKey: true, bubbles: true }))""",
        [key, code],
    )
    until(lambda: current(quiet).commands.gate["stopped"], "the stop")


def test_no_other_key_stops(bare: Page, quiet: Running) -> None:
    for key in (".", "Control+,", "Control+Shift+a", "Escape"):
        bare.keyboard.press(key)
    bare.evaluate(FORGET)
    bare.keyboard.press("Escape")
    bare.evaluate("fetch('/api/v1/me')")  # after what the keys may have asked for
    assert not current(quiet).commands.gate["stopped"]
    assert not bare.evaluate("sessionStorage.getItem('footfall-stop')")


# -- states ----------------------------------------------------------------------------------


@pytest.mark.parametrize("way", WAYS)
def test_while_a_stop_is_in_force_it_is_asked_for_again(bare: Page, quiet: Running, way: str) -> None:
    stops(bare, quiet, "ctrl")
    bare.evaluate(FORGET)
    bare.evaluate(COUNTED)
    for key in WAYS[way]:
        bare.keyboard.press(key)
    until(lambda: bare.evaluate("sent") == 1, "the same stop once more")
    bare.evaluate("() => { WebSocket.prototype.send = sendBefore; }")


@pytest.mark.parametrize("way", WAYS)
def test_while_the_server_is_silent_it_is_asked_for_until_it_answers(bare: Page, quiet: Running, way: str) -> None:
    bare.evaluate(DEAF)
    for key in WAYS[way]:
        bare.keyboard.press(key)
    expect(bare.locator("#stop-state")).to_contain_text("STOP NOT CONFIRMED")
    assert not current(quiet).commands.gate["stopped"]
    bare.evaluate(HEARING)
    until(lambda: current(quiet).commands.gate["stopped"], "the stop")
    expect(bare.locator("#stop-state")).to_contain_text("Stop in force")


def test_asking_goes_on_when_the_page_is_loaded_again(bare: Page, quiet: Running) -> None:
    bare.evaluate(DEAF)
    bare.keyboard.press("Control+.")
    expect(bare.locator("#stop-state")).to_contain_text("STOP NOT CONFIRMED")
    bare.reload()
    until(lambda: current(quiet).commands.gate["stopped"], "the stop")
    expect(bare.locator("#stop-state")).to_contain_text("Stop in force")
    clear(quiet)
    bare.reload()  # that stop was confirmed: it is not asked for again
    bare.get_by_text("Stepping over a rock", exact=True).wait_for()
    assert not current(quiet).commands.gate["stopped"]


@pytest.mark.parametrize("way", WAYS)
def test_in_the_past_of_the_timeline(bare: Page, quiet: Running, way: str) -> None:
    expect(bare.locator("#timeline-scrub")).to_be_enabled()  # the page of the test before may have been left just now
    bare.keyboard.press(",")
    expect(bare.locator("#timeline-text")).to_contain_text("Past, ")
    bare.locator("#timeline-scrub").focus()
    stops(bare, quiet, way)
    bare.locator("#timeline-now").click()


@pytest.mark.parametrize("percent", [50, 200, 300, 500])
def test_at_any_zoom_of_the_browser(bare: Page, quiet: Running, percent: int) -> None:
    """Zoom makes the page's viewport smaller; the button stays in sight, with nothing over it, wherever one scrolls."""
    bare.set_viewport_size({"width": 1280 * 100 // percent, "height": 720 * 100 // percent})
    try:
        stops(bare, quiet, "ctrl")  # the bar has most to say now
        for place in (0, 300, 1e6):
            bare.evaluate("place => scrollTo(place, place)", place)
            assert bare.locator("#stop").evaluate(IN_SIGHT), (place, bare.locator("#stop").bounding_box())
        clear(quiet)
        bare.evaluate(FORGET)
        bare.locator("#scene").evaluate("one => one.focus()")
        stops(bare, quiet, "escape")
    finally:
        bare.set_viewport_size({"width": 1280, "height": 720})


@pytest.mark.parametrize("way", WAYS)
def test_while_the_rover_walks_by_itself_the_walk_ends(bare: Page, quiet: Running, way: str) -> None:
    live, heard = current(quiet), []
    live.rover.connected(heard.append)
    try:
        loop = live.walk_to(WalkGoal(1.0, 0.0))  # it waits for telemetry, which this rover never sends
        expect(bare.locator("#loop-now")).to_contain_text("it begins")
        for key in WAYS[way]:
            bare.keyboard.press(key)
        until(lambda: loop.state == "ended", "the end of the walk")
        assert loop.outcome == "stopped"
        assert loop.reason.startswith("the rover was stopped")  # by the latch, or by the epoch before it
        assert any(json.loads(one)["type"] == "stop" for one in heard)
        expect(bare.locator("#stop-state")).to_have_text("Stop sent, NOT YET ACKNOWLEDGED by the rover.")
    finally:
        live.rover.disconnected()
    expect(bare.locator("#stop-state")).to_contain_text("NO ROVER IS CONNECTED: it is told when it connects")


@pytest.mark.parametrize("line", [True, False], ids=["on the line", "as a request"])
def test_without_a_session_it_is_said_that_nothing_was_sent_and_a_session_that_opens_is_not_stopped(
    chromiums: Browsers, tmp_path: Path, line: bool
) -> None:
    context = chromiums(False).new_context(viewport={"width": 1280, "height": 720})
    page = context.new_page()
    if not line:
        page.route_web_socket("**/stop/line", lambda socket: socket.close())
    state = page.locator("#stop-state")
    with running_server(tmp_path) as running:
        page.goto(f"{running.url}/?scene=off")
        expect(page.locator("#toast")).to_contain_text("no session is open")
        for keys in WAYS.values():
            page.evaluate("() => { document.getElementById('stop-state').textContent = ''; }")
            for key in keys:
                page.keyboard.press(key)
            expect(state).to_contain_text("NO STOP WAS SENT: no session was open")
        page.screenshot(path=OUTPUTS / f"stop-without-a-session-{line}.png")
        live = running.sessions.create("opened later")
        page.get_by_text("opened later", exact=True).wait_for()
        assert not live.commands.gate["stopped"]
        assert not page.evaluate("sessionStorage.getItem('footfall-stop')")
        stops(page, running, "ctrl")
    context.close()


# -- pages that can't stop -------------------------------------------------------------------


@pytest.mark.parametrize("way", WAYS)
def test_without_a_login_the_page_says_that_nothing_was_stopped(bare: Page, quiet: Running, way: str) -> None:
    page = bare.context.new_page()
    page.route("**/api/v1/me", lambda route: route.fulfill(status=401, json={"detail": "log in"}))
    page.goto(f"{quiet.url}/login.html")
    expect(page.locator("#name")).to_be_focused()
    for key in WAYS[way]:
        page.keyboard.press(key)
    expect(page.get_by_role("alert")).to_contain_text("NO STOP WAS SENT")
    page.close()


def test_a_login_that_ended_while_a_stop_was_asked_for_says_so(bare: Page, quiet: Running) -> None:
    page = bare.context.new_page()
    page.goto(f"{quiet.url}/?scene=off")
    page.get_by_text("Stepping over a rock", exact=True).wait_for()
    page.evaluate(DEAF)
    page.keyboard.press("Control+.")
    expect(page.locator("#stop-state")).to_contain_text("STOP NOT CONFIRMED")
    page.route("**/api/v1/me", lambda route: route.fulfill(status=401, json={"detail": "log in"}))
    page.goto(f"{quiet.url}/login.html?ended")  # as an answer of 401 leads there
    expect(page.locator("#why")).to_contain_text("NO STOP WAS SENT")
    page.reload()
    expect(page.locator("#why")).to_have_text("Your login has ended. Log in again to go on.")
    page.close()


@pytest.mark.parametrize("way", WAYS)
def test_a_page_that_plays_alone_says_that_it_reaches_no_rover(
    bare: Page, quiet: Running, tmp_path: Path, way: str
) -> None:
    with quiet.client() as client:
        written = tmp_path / "session.html"
        written.write_bytes(client.get(f"/recordings/{held(quiet)['id']}.html").content)
    page = bare.context.new_page()
    page.goto(written.as_uri())
    expect(page.get_by_role("alert")).to_be_hidden()
    page.locator("#plan").focus()
    for key in WAYS[way]:
        page.keyboard.press(key)
    expect(page.get_by_role("alert")).to_contain_text("NO STOP WAS SENT")
    page.close()
