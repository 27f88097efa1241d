"""What the page does when something goes wrong: reload, restart, lost rover, another session, a full screen."""

import errno
import os
import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, Route, expect

from footfall.session.gate_notices import GateNotices
from footfall.session.storage.sqlite_log import SqliteLog
from footfall.telemetry.link import ErrorMessage
from tests.support.page_steps import RIGID, held, lay_out, press
from tests.support.server import Running, running_server
from tests.support.spoken import current
from tests.support.waiting import until

OUTPUTS = Path(__file__).resolve().parents[2] / "test-outputs" / "screenshots"


@pytest.fixture
def bare(chromium: Browser, quiet: Running) -> Iterator[Page]:
    """The operator's page without its scene."""
    context = chromium.new_context(viewport={"width": 1280, "height": 720})
    lay_out(context)
    page = context.new_page()
    page.goto(quiet.url)
    page.get_by_text(current(quiet).state.name, exact=True).wait_for()
    yield page
    context.close()


@RIGID
def test_a_run_survives_a_reload_and_a_killed_rover_is_told(bare: Page, quiet: Running) -> None:
    quiet.rover.start()
    expect(bare.locator("#status-mode")).to_have_text("idle")
    arm = bare.get_by_role("button", name="Arm", exact=True)
    expect(arm).to_be_enabled()
    arm.click()
    send = bare.get_by_role("button", name="Send to rover", exact=True)
    expect(send).to_be_enabled()
    # two clicks in one turn of the page: one run
    send.evaluate("button => { button.click(); button.click(); }")
    expect(bare.locator("#toast")).to_be_hidden()
    until(lambda: any(c["state"] == "started" for c in held(quiet)["commands"]), "the first command")
    assert len({c["run"] for c in held(quiet)["commands"]}) == 1
    bare.reload()
    expect(bare.locator("#status-mode")).to_have_text("moving")
    expect(bare.locator("#arm-state")).to_contain_text("sending row")
    with quiet.client() as client:
        pid = client.get("/info").json()["simulated_rover"]["pid"]
    os.kill(pid, signal.SIGKILL)
    expect(bare.locator("#commands tbody")).to_contain_text("unknown")
    expect(bare.locator("#arm-state")).to_have_text("not armed")
    assert held(quiet)["commands"][-1]["state"] == "unknown"


def test_nothing_is_armed_before_the_rover_has_confirmed_the_epoch(
    bare: Page, quiet: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(GateNotices, "epoch", lambda _: None)  # as if the way to the rover lost it each time
        quiet.rover.start()
        expect(bare.locator("#status-mode")).to_have_text("idle")
        arm = bare.get_by_role("button", name="Arm", exact=True)
        expect(arm).to_be_disabled()
        expect(arm).to_have_attribute("title", re.compile("rover has not confirmed"))
        expect(bare.locator("#arm-state")).to_contain_text("not armed. The rover has not confirmed")
    # told again every second, and the page needs no other event to see that it was answered
    expect(arm).to_be_enabled()
    expect(bare.locator("#arm-state")).to_have_text("not armed")


def test_another_session_becomes_current_and_the_page_follows(bare: Page, quiet: Running) -> None:
    with quiet.client() as client:
        client.post("/sessions", json={"name": "the other one"})
    bare.get_by_text("the other one", exact=True).wait_for()
    expect(bare.locator("#commands")).to_be_hidden()


def test_a_complaint_of_the_rover_is_shown(bare: Page, quiet: Running) -> None:
    live = quiet.sessions.current
    assert live is not None
    live.rover.take_complaint(ErrorMessage("images-1", "camera 3 is cold").text, message_id="images-1")
    expect(bare.locator("#toast")).to_contain_text("camera 3 is cold")
    expect(bare.locator("#log")).to_contain_text("camera 3 is cold")


def test_who_stopped_is_told_by_the_page_that_did(bare: Page, quiet: Running) -> None:
    live = quiet.sessions.current
    assert live is not None
    live.commands.clear_stop()
    page = bare.evaluate("sessionStorage.getItem('footfall-page')")
    press(bare, "STOP")
    until(lambda: held(quiet)["stop"]["latched"], "the stop")
    assert next(e.payload["by"]["page"] for e in reversed(live.events()) if e.type == "stop_requested") == page
    press(bare, "Clear stop")
    until(lambda: not held(quiet)["stop"]["latched"], "a cleared stop")


def test_what_is_not_written_stays_in_sight(bare: Page, quiet: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "no space left")

    monkeypatch.setattr(SqliteLog, "append", full)
    with quiet.client() as client:
        client.post("/stop")
        for _ in ("told", "found by a page that is opened later"):
            expect(bare.locator("#status-server")).to_contain_text("NOT WRITTEN")
            expect(bare.locator("#status-server")).to_have_attribute("data-state", "bad")
            bare.reload()
        monkeypatch.undo()
        client.post("/stop/clear").raise_for_status()
    expect(bare.locator("#status-server")).to_have_text("connected")


@pytest.mark.scene
def test_keys_pressed_in_the_scene(page: Page, served: Running) -> None:
    scene = page.frame_locator("#scene").locator("body")
    scene.wait_for()
    expect(page.locator("#scene-note")).to_be_hidden()
    inside = next(frame for frame in page.frames if "/scene/" in frame.url)
    inside.evaluate("document.body.tabIndex = 0; document.body.focus()")
    before = held(served)["events"]
    page.keyboard.press("3")
    until(lambda: held(served)["view"]["leg"] == 3, "leg 3")
    for key in "wasdqe":  # they move the scene's camera
        page.keyboard.press(key)
    page.keyboard.press("4")
    until(lambda: held(served)["view"]["leg"] == 4, "leg 4")
    assert held(served)["events"] == before
    page.keyboard.press("Control+.")
    until(lambda: held(served)["stop"]["acknowledged"], "the stop acknowledged")
    # viser's own panel is docked in a narrow frame, and hidden there as well
    page.set_viewport_size({"width": 480, "height": 720})
    until(lambda: inside.evaluate("innerWidth") <= 480, "a narrow scene")
    until(lambda: inside.get_by_text("Save Canvas").count() == 1, "viser's panel")
    expect(inside.get_by_text("Save Canvas")).to_be_hidden()


def test_stop_does_not_wait_behind_requests_that_hang(bare: Page, quiet: Running) -> None:
    # a browser has six connections to one server: as many streams as that keep every other request waiting
    bare.evaluate("for (let i = 0; i < 8; i++) new EventSource('/api/v1/sessions/current/events')")
    asked = bare.evaluate("""() => Promise.race([
        fetch("/api/v1/info").then(() => "answered"),
        new Promise(done => setTimeout(() => done("waiting"), 1000)),
    ])""")
    assert asked == "waiting"
    bare.keyboard.press("Control+.")
    until(lambda: held(quiet)["stop"]["latched"], "the stop")


def test_many_pages_of_one_browser_follow_the_session(bare: Page, quiet: Running) -> None:
    pages = [bare.context.new_page() for _ in range(7)]
    for page in pages:
        page.goto(quiet.url)
    with quiet.client() as client:
        client.put("/sessions/current/view", json={"leg": 4})
    for page in [bare, *pages]:
        expect(page.locator("#status-server")).to_have_attribute("data-state", "good")
        expect(page.locator("#leg-4")).to_have_attribute("aria-checked", "true")


def test_one_press_of_stop_is_enough_where_the_server_answers_late(bare: Page, quiet: Running) -> None:
    tries = []

    def lose_two(route: Route) -> None:
        tries.append(route.request.url)
        route.abort() if len(tries) <= 2 else route.continue_()

    bare.route_web_socket("**/stop/line", lambda socket: socket.close())
    bare.route("**/api/v1/stop", lose_two)
    bare.reload()
    bare.get_by_text("Stepping over a rock", exact=True).wait_for()
    bare.keyboard.press("Control+.")
    expect(bare.locator("#stop-state")).to_contain_text("NOT CONFIRMED")
    expect(bare.locator("#stop-state")).to_contain_text("Stop in force")
    assert held(quiet)["stop"]["latched"]
    assert len(tries) == 3


def test_nothing_covers_stop(bare: Page, quiet: Running, request: pytest.FixtureRequest) -> None:
    bare.keyboard.press("?")
    expect(bare.locator("#help")).to_be_visible()
    bare.evaluate("""() => {
        const box = document.getElementById("toast");
        box.hidden = false;
        box.textContent = "long ".repeat(400);
    }""")
    for width, height in ((1280, 720), (800, 1100)):
        bare.set_viewport_size({"width": width, "height": height})
        bare.screenshot(path=OUTPUTS / f"{request.node.name}-{width}.png")
        for selector in ("#stop", "#stop-state"):
            on_top = bare.evaluate(
                """selector => {
                    const target = document.querySelector(selector);
                    const { x, y, width, height } = target.getBoundingClientRect();
                    return [[.5, .5], [.05, .1], [.95, .9]].every(([u, v]) =>
                        document.elementFromPoint(x + u * width, y + v * height) === target);
                }""",
                selector,
            )
            assert on_top, f"{selector} is covered or out of the window at {width} × {height}"
    bare.keyboard.press("Escape")
    bare.keyboard.press("Escape")
    until(lambda: held(quiet)["stop"]["latched"], "the stop")


def test_unknown_ground_is_neither_green_nor_red(bare: Page, quiet: Running) -> None:
    with quiet.client() as client:
        result = client.get("/sessions/current/plans/current").json()
    name = "unknown ground under the path"
    checks = [
        {"name": name, "holds": True, "margin": None, "unit": "", "where": where}
        for where in ("none", "between waypoints 3 and 4")
    ]
    bare.route("**/plans/*", lambda route: route.fulfill(json={**result, "checks": checks}))
    bare.reload()
    rows = bare.locator("#checks tbody tr")
    expect(rows.nth(0).locator("td").first).to_have_class("yes")
    expect(rows.nth(1).locator("td").first).to_have_class("doubt")


def test_the_page_outlives_its_server(chromium: Browser, tmp_path: Path) -> None:
    """The server ends; stop says so; the next server holds another session, and the page shows that one."""
    context = chromium.new_context(viewport={"width": 1280, "height": 720})
    lay_out(context)
    page = context.new_page()
    with running_server(tmp_path / "one", prepare=lambda s: s.create("before")) as first:
        page.goto(first.url)
        page.get_by_text("before", exact=True).wait_for()
        expect(page.locator("#status-server")).to_have_attribute("data-state", "good")
        port = int(first.url.rsplit(":", 1)[1])
    expect(page.locator("#status-server")).to_contain_text("silent for")
    press(page, "STOP")
    expect(page.locator("#stop-state")).to_contain_text("NOT CONFIRMED")
    expect(page.locator("#toast")).not_to_contain_text("Nothing was sent")
    with running_server(tmp_path / "two", prepare=lambda s: s.create("after"), port=port) as second:
        # beside a stop in force there is no room for the session's name
        expect(page.locator("#status-session")).to_have_text("after")
        expect(page.locator("#status-server")).to_have_attribute("data-state", "good")
        press(page, "STOP")
        expect(page.locator("#stop-state")).to_contain_text("NO ROVER IS CONNECTED")
        assert held(second)["stop"]["latched"]
        press(page, "Clear stop")
        expect(page.locator("#stop-state")).to_have_text(re.compile("Not a safety-rated stop"))
        page.get_by_text("after", exact=True).wait_for()
        # a server that is there but does not answer is not shown as connected
        page.route("**/api/v1/**", lambda route: None)
        expect(page.locator("#status-server")).to_contain_text("silent for")
        page.unroute("**/api/v1/**")
        # another session takes over without a word of the old one's rover
        with second.client() as client:
            client.post("/sessions", json={"name": "third"})
        page.get_by_text("third", exact=True).wait_for()
    context.close()
