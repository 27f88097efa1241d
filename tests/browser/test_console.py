"""The page as a console: layouts, palette, legs, plots, timeline and notes, sessions, and a page that plays alone."""

import re
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.test_themes import told
from tests.support.page_steps import RIGID, as_shown, figure, held
from tests.support.server import Running
from tests.support.spoken import current, say, say_at
from tests.support.waiting import until

Keep = Callable[[str], None]
DRESSED = """name => {
  document.getElementById("theme").value = name;
  document.getElementById("theme").dispatchEvent(new Event("change"));
  const { backgroundColor, color } = getComputedStyle(document.body);
  return [backgroundColor, color, getComputedStyle(document.querySelector("section")).backgroundColor];
}"""
HOSTILE = "<img src=x onerror=document.title='owned'>"


def find_act(page: Page, typed: str) -> None:
    page.keyboard.press("Control+k")
    page.locator("#palette-input").fill(typed)


def test_a_layout_is_reached_by_a_key_and_kept(console: Page, look: Keep) -> None:
    expect(console.locator("#panel-plan")).to_be_visible()
    expect(console.locator("#panel-legs")).to_be_hidden()
    console.keyboard.press("8")
    for shown in ("#panel-legs", "#panel-telemetry", "#panel-commands"):
        expect(console.locator(shown)).to_be_visible()
    expect(console.locator("#panel-plan")).to_be_hidden()
    console.get_by_role("button", name="Hide Telemetry").click()
    console.get_by_role("button", name="Plan", exact=True).click()
    expect(console.locator("#h-plan")).to_be_focused()
    look("changed")
    console.reload()
    expect(console.locator("#panel-plan")).to_be_visible()
    expect(console.locator("#panel-telemetry")).to_be_hidden()
    expect(console.locator("#layout")).to_have_value("execute")
    console.keyboard.press("F6")
    expect(console.locator("#h-legs")).to_be_focused()
    find_act(console, "layout as del")
    console.keyboard.press("Enter")
    expect(console.locator("#panel-plan")).to_be_hidden()
    expect(console.locator("#panel-telemetry")).to_be_visible()


@RIGID
def test_the_palette_does_what_can_be_done_and_says_why_not(console: Page, quiet: Running, look: Keep) -> None:
    console.locator("#footfall-x").focus()
    find_act(console, "chleg4")
    first = console.locator("#palette-list li").first
    expect(first).to_contain_text("Choose leg 4")
    expect(first.locator("kbd")).to_have_text("4")
    console.keyboard.press("Enter")
    until(lambda: held(quiet)["view"]["leg"] == 4, "leg 4")
    expect(console.locator("#footfall-x")).to_be_focused()
    find_act(console, "compensate for sag")
    expect(first).to_have_attribute("aria-disabled", "true")
    expect(first).to_contain_text("predict the sag of the present plan first")
    look("refused")
    console.keyboard.press("Enter")
    expect(console.locator("#palette")).to_be_visible()
    console.locator("#palette-input").fill("timeline: ")  # of what fits alike, what can be done comes first
    expect(first).to_contain_text("Timeline: event")
    expect(first).not_to_have_attribute("aria-disabled", "true")
    console.locator("#palette-input").fill("no such act")
    expect(console.locator("#palette-note")).to_have_text("No act has such a name.")
    console.keyboard.press("Escape")
    expect(console.locator("#palette")).to_be_hidden()
    # a key says the same as the palette and the button
    console.locator("#h-ground").click()
    console.keyboard.press("r")
    expect(console.locator("#toast")).to_contain_text("predict the sag of the present plan first")
    expect(console.locator("#make-execution")).to_have_attribute("title", re.compile("sag of the present plan first"))


def test_a_page_without_its_scene_goes_on(console: Page, quiet: Running, look: Keep) -> None:
    expect(console.locator("#scene-note")).to_contain_text("The scene is off")
    console.goto(quiet.url)  # of a server without a scene
    expect(console.locator("#scene-note")).to_contain_text("it was switched off. Commands, telemetry and stop go on")
    look("none")
    # a scene that comes, and dies
    console.route(
        re.compile(r"/scene/(\?.*)?$"), lambda route: route.fulfill(content_type="text/html", body="<canvas></canvas>")
    )
    console.route("**/info", lambda route: route.fulfill(json={"scene": {"available": True, "reason": ""}}))
    console.get_by_role("button", name="Load the scene again").click()
    expect(console.locator("#scene-note")).to_be_hidden()
    canvas = console.frame_locator("#scene").locator("canvas")
    canvas.evaluate("canvas => canvas.dispatchEvent(new Event('webglcontextlost'))")
    expect(console.locator("#scene-note")).to_contain_text("lost its graphics. Commands, telemetry and stop go on")
    console.keyboard.press("Control+.")
    until(lambda: held(quiet)["stop"]["latched"], "the stop")
    expect(console.get_by_role("button", name="Load the scene again")).to_be_visible()


def test_legs_show_load_and_the_joint_that_is_nearest_its_limit(
    console: Page, quiet: Running, athlete, look: Keep
) -> None:
    console.keyboard.press("8")
    expect(console.locator("#legs-note")).to_contain_text("No telemetry yet")
    forces = np.zeros((6, 3))
    forces[:, 2] = [4000, 0, 1000, 1000, 1000, 1000]
    torques = np.zeros(36)
    torques[6 * 2 + 1] = 0.9 * athlete.torque_limits[6 * 2 + 1]
    torques[6 * 3 + 2] = -1.1 * athlete.torque_limits[6 * 3 + 2]
    state = say(quiet, 1, wheel_forces=forces, joint_torques=torques)
    rows = console.locator("#legs-table tbody tr")
    expect(rows).to_have_count(6)
    expect(rows.nth(0)).to_contain_text("stands")
    expect(rows.nth(0)).to_contain_text("50 %")
    expect(rows.nth(1)).to_contain_text("in air")
    expect(rows.nth(2).locator("td.doubt")).to_contain_text("90 % hip pitch")
    expect(rows.nth(3).locator("td.no")).to_contain_text("110 % knee pitch")
    footfall = held(quiet)["footfall_answer"]
    hip = state.T_site_base @ athlete.description.legs[2].T_base_hip[:, 3]
    away = np.linalg.norm(hip[:3] - [footfall["x"], footfall["y"], footfall["z"]])
    expect(rows.nth(2)).to_contain_text(f"✓ {away:.2f}")
    edges = "all => all.map(one => one.getBoundingClientRect().x)"
    before = console.locator("#legs-table th").evaluate_all(edges)
    posture = state.posture.copy()
    posture[6 * 1] += 0.05
    say(quiet, 2, wheel_forces=forces, joint_torques=torques, posture=posture)
    expect(rows.nth(1)).to_contain_text("in air, moves")
    assert console.locator("#legs-table th").evaluate_all(edges) == before  # nothing jumps while the rover moves
    look("legs")


def test_legs_of_a_rover_that_reports_no_forces_are_not_said_to_stand_or_not(console: Page, quiet: Running) -> None:
    console.keyboard.press("8")
    say(quiet, 1, wheel_forces=np.zeros((6, 3)))
    rows = console.locator("#legs-table tbody tr")
    expect(rows).to_have_count(6)
    for leg in range(6):
        expect(rows.nth(leg)).to_contain_text("? no forces")
    console.locator("#panel-legs .fold").click()
    expect(console.locator("#panel-legs > .state")).to_have_text("no forces are reported")


def test_plots_show_what_was_said_and_mark_what_is_stale(console: Page, quiet: Running, athlete, look: Keep) -> None:
    console.keyboard.press("8")
    torques = np.zeros(36)
    torques[6 * 2 + 1] = 0.95 * athlete.torque_limits[6 * 2 + 1]
    for number in range(1, 6):
        say(quiet, number, joint_torques=torques * number / 5)
    listed = console.locator("#plot-series li")
    expect(listed.nth(1)).to_contain_text(f"{torques[13]:.1f}, 95 % to limit")
    console.locator("#plot-quantity").select_option("place")
    live = current(quiet)
    assert live.rover.frame is not None
    for i in range(3):
        expect(listed.nth(i)).to_contain_text(figure(live.rover.frame.state.T_site_base[i, 3], 3))
    assert console.locator("#plot canvas").count() == 1
    expect(console.locator("#plot-note")).to_contain_text("Stale")
    expect(console.locator("#plot-note")).not_to_contain_text("Numbers of")
    expect(console.locator("#legs-note")).to_contain_text("Stale")
    look("stale")
    console.keyboard.press("q")
    expect(console.locator("#plot-note")).to_contain_text("Held")


def test_numbers_of_a_moment_that_was_pointed_at_are_told_as_such(console: Page, quiet: Running) -> None:
    console.keyboard.press("8")
    begin, torques = time.monotonic() - 100, np.zeros(36)
    for number in range(1, 91):
        torques[6 * 2 + 1] = 11.0 if number < 60 else 77.0
        say_at(begin + number, quiet, number, joint_torques=torques)
    console.reload()
    pitch, note = console.locator("#plot-series li b").nth(1), console.locator("#plot-note")
    to_now = console.locator("#timeline-now")
    expect(pitch).to_contain_text("77.0")
    expect(to_now).to_be_disabled()
    over = console.locator("#plot .u-over").bounding_box()
    assert over is not None
    console.mouse.click(over["x"] + over["width"] / 3, over["y"] + over["height"] / 2)
    expect(pitch).to_contain_text("11.0")
    expect(note).to_contain_text(re.compile(r"Numbers of \d\d:\d\d:\d\d"))
    expect(note).to_have_class("doubt")
    current(quiet).add_note("something else has happened")
    expect(console.locator("#timeline-text")).to_contain_text("something else has happened")
    expect(note).to_contain_text("Numbers of")
    to_now.click()
    expect(pitch).to_contain_text("77.0")
    expect(note).not_to_contain_text("Numbers of")
    expect(to_now).to_be_disabled()


def test_plots_go_on_with_what_was_said_before_the_page_was_loaded(console: Page, quiet: Running, look: Keep) -> None:
    torques, now = np.zeros(36), time.monotonic()
    for number in range(1, 41):
        torques[6 * 2 + 1] = 77.0 if number == 10 else 1.0
        say_at(now - 60 + number + (15 if number > 20 else 0), quiet, number, joint_torques=torques)
    unheard = "**/telemetry/past*"
    console.route(unheard, lambda route: route.abort())  # the link breaks while the page asks
    console.reload()
    expect(console.locator("#timeline-text")).to_contain_text("Latest")
    console.keyboard.press("8")
    held_before = """async () => {
      const { earlier } = (await import("/js/page.js")).modules["earlier.js"];
      const { channelsOf, heardFrom } = (await import("/js/page.js")).modules["samples.js"];
      const { found, why } = earlier(channelsOf("torque", 2), 120);
      return why || [heardFrom(), ...found];
    }"""
    until(lambda: console.evaluate(held_before) == "The server does not answer.", "the answer that does not come")
    console.unroute(unheard)
    until(lambda: len(console.evaluate(held_before)[1]) > 1, "what the server kept, asked for again")
    heard_from, times, _, knee, *_ = console.evaluate(held_before)
    assert max(knee) == 77.0
    assert sorted(times) == times
    assert times[-1] < heard_from
    steps = np.diff(times)
    assert (steps > 10).sum() == 1, "nothing stands where nothing was said"
    assert steps.max() == pytest.approx(16, abs=0.5)
    numbers = iter(range(41, 10_000))

    def told() -> str:
        say(quiet, next(numbers), joint_torques=torques)
        return console.locator("#plot-note").inner_text()

    until(lambda: "Shaded" in told(), "the mark of what was before")
    look("before")


def test_what_the_bar_says_of_plan_and_rover_is_not_cut(console: Page) -> None:
    cut = """async () => {
      const texts = (await import("/js/page.js")).modules["texts/link.js"];
      const box = document.getElementById("status-match");
      return ["nearEnough", "startsHere", "onOlderGround"].filter((name) => {
        box.dataset.state = "good";
        box.textContent = texts[name];
        return box.scrollHeight > box.clientHeight;
      });
    }"""
    assert console.evaluate(cut) == []


def test_the_timeline_leads_back_to_what_was_planned_and_takes_notes(console: Page, quiet: Running, look: Keep) -> None:
    text = console.locator("#timeline-text")
    log = held(quiet, "/sessions/current/log")["events"]
    expect(text).to_contain_text("Now. Latest:")
    planned = next(i for i, event in enumerate(log) if event["payload"].get("kind") == "plan")
    for _ in range(len(log) - 1 - planned):
        console.keyboard.press(",")
    expect(text).to_contain_text("plan, leg 2, found")
    expect(text).to_contain_text("Past, ")
    expect(text).to_have_attribute("data-state", "warn")
    console.get_by_role("button", name="Show", exact=True).click()
    checks = held(quiet, "/sessions/current/plans/current")["checks"]
    expect(console.locator("#shown tbody tr")).to_have_count(len(checks))
    look("plan")
    console.keyboard.press("Escape")
    # the slider reaches the same event: a place on the line stands for a moment
    expect(console.locator("#timeline-scrub")).not_to_have_value("10000")
    console.locator("#timeline-scrub").fill("0")
    expect(text).to_contain_text("session created")
    console.locator("#h-ground").click()
    console.keyboard.press("y")
    console.locator("#note-text").fill(HOSTILE)
    console.get_by_role("button", name="Write it down").click()
    expect(console.locator("#log li").first).to_contain_text(HOSTILE)
    assert held(quiet)["notes"][-1]["text"] == HOSTILE
    console.get_by_role("button", name="Now", exact=True).click()
    expect(text).to_contain_text(HOSTILE)
    expect(text).to_have_attribute("data-state", "none")
    console.get_by_role("button", name="Show", exact=True).click()
    expect(console.locator("#shown-body")).to_have_text(HOSTILE)
    assert console.locator("img[src=x]").count() == 0
    assert console.title() == "FootFall"


def test_the_scene_goes_back_along_the_timeline_and_returns(console: Page, quiet: Running) -> None:
    asked: list = []
    console.on("request", lambda one: asked.append(one.post_data_json) if one.url.endswith("/scene/moment") else None)
    note, button = console.locator("#past-note"), console.locator("#timeline-scene")
    expect(button).to_be_disabled()
    with quiet.client() as client:
        last = client.get("/sessions/current").json()["events"] - 1
    console.locator("#timeline-back").click()
    button.click()
    expect(note).to_contain_text("The scene shows the past")
    console.locator("#timeline-back").click()
    until(lambda: len(asked) >= 2, "the moment before")
    expect(button).to_have_attribute("aria-pressed", "true")
    console.locator("#timeline-now").click()
    expect(note).to_be_hidden()
    until(lambda: asked[-1:] == [{"event": None}], "the present")
    assert [one["event"] for one in asked] == [last - 1, last - 2, None]


def test_who_scrubs_to_the_end_sees_the_scene_as_it_is(console: Page) -> None:
    console.locator("#timeline-back").click()
    console.locator("#timeline-scene").click()
    expect(console.locator("#past-note")).to_be_visible()
    console.locator("#timeline-scrub").fill("10000")
    expect(console.locator("#timeline-text")).to_contain_text("Now. Latest:")
    expect(console.locator("#past-note")).to_be_hidden()


def test_the_scene_is_not_said_to_be_as_it_is_before_the_server_has_answered(console: Page) -> None:
    note = console.locator("#past-note")
    console.locator("#timeline-back").click()
    console.locator("#timeline-scene").click()
    expect(note).to_contain_text("The scene shows the past")
    console.route("**/scene/moment", lambda one: one.fulfill(status=409, json={"detail": "not now"}), times=1)
    console.locator("#timeline-now").click()
    expect(note).to_contain_text("The scene may show the past still")
    expect(note).to_be_hidden()
    # what is refused is not shown, and not said to be
    console.route("**/scene/moment", lambda one: one.fulfill(status=409, json={"detail": "not now"}), times=1)
    console.locator("#timeline-back").click()
    console.locator("#timeline-scene").click()
    expect(console.locator("#toast")).to_have_text("not now")
    expect(console.locator("#timeline-scene")).to_have_attribute("aria-pressed", "false")
    expect(note).to_be_hidden()


@RIGID
def test_the_ghost_goes_where_the_rover_was(console: Page, quiet: Running) -> None:
    plan = held(quiet, "/sessions/current/plans/current")["plan"]
    travel = [np.abs(np.subtract(b, a)).max() for a, b in zip(plan["waypoints"], plan["waypoints"][1:], strict=False)]
    i = len(travel) // 2
    say(quiet, 1, posture=plan["waypoints"][i])
    heard = "async () => (await import('/js/page.js')).modules['samples.js'].heardFrom() > 0"
    until(lambda: console.evaluate(heard), "the page's hearing of it")  # wait_for_function takes any promise for true
    expect(console.locator("#scrub")).to_be_enabled()  # the page has the plan
    console.evaluate(
        """async () => {
            const { heardFrom } = (await import("/js/page.js")).modules["samples.js"];
            (await import("/js/page.js")).modules["cursor.js"].point(heardFrom());
        }"""
    )
    share = sum(travel[:i]) / sum(travel)
    until(lambda: abs(held(quiet)["view"]["scrub"] - share) < 1e-3, "the ghost's place")


def test_sessions_are_compared_and_checked(console: Page, quiet: Running, look: Keep) -> None:
    with quiet.client() as client:
        rock = client.get("/sessions/current").json()["id"]
        client.post("/sessions", json={"name": HOSTILE}).raise_for_status()
    console.get_by_text(HOSTILE, exact=True).first.wait_for()
    console.keyboard.press("9")
    rows = console.locator("#sessions tbody tr")
    expect(rows).to_have_count(2)
    boxes = console.locator("#sessions input[type=checkbox]")
    expect(boxes).to_have_count(2)
    for i in range(2):
        boxes.nth(i).check()
    console.get_by_role("button", name="Compare the two").click()
    expect(console.locator("#sessions-answer tbody tr", has_text="plan").first).to_contain_text("only one of the two")
    look("compared")
    console.get_by_role("button", name=f"Check: {HOSTILE}", exact=False).click()
    expect(console.locator("#sessions-answer .yes").first).to_contain_text("came out as recorded")
    console.get_by_role("button", name=re.compile(f"^Open: .*{rock}$")).click()
    # no call that waits without bound while the page is loaded anew
    expect(console.locator("#status-session")).to_have_text("Stepping over a rock")
    expect(console.locator("#sessions tbody tr")).to_have_count(2)
    expect(console.locator("img[src=x]")).to_have_count(0)


@pytest.mark.parametrize("sample", ["rock-walk"])
def test_an_exported_page_of_a_walk_does_not_say_that_nothing_was_planned(
    chromium: Browser, quiet: Running, tmp_path: Path
) -> None:
    written = tmp_path / "session.html"
    with quiet.client() as client:
        written.write_bytes(client.get(f"/recordings/{held(quiet)['id']}.html").content)
    page = chromium.new_context(offline=True).new_page()
    page.goto(written.as_uri())
    expect(page.locator("#events")).to_contain_text("walk, found")
    expect(page.locator("#plan-text")).to_contain_text("No step was planned. Walks")
    page.context.close()


def test_an_exported_page_plays_without_a_server(
    chromium: Browser, quiet: Running, tmp_path: Path, look_at: Callable[[Page, str], None]
) -> None:
    current(quiet).add_note("without_a_space" * 40)
    current(quiet).add_note(HOSTILE)
    with quiet.client() as client:
        session = client.get("/sessions/current").json()
        written = tmp_path / "session.html"
        written.write_bytes(client.get(f"/recordings/{session['id']}.html").content)
        plan = client.get("/sessions/current/plans/current").json()
    context = chromium.new_context(viewport={"width": 1280, "height": 900}, offline=True)
    page = context.new_page()
    faults: list[str] = []
    asked: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    page.on("request", lambda request: asked.append(request.url.split(":")[0]))
    page.goto(written.as_uri())
    expect(page.locator("#events li")).to_have_count(session["events"])
    expect(page.locator("#events li").last).to_contain_text(HOSTILE)
    expect(page.locator("#checks tbody tr")).to_have_count(len(plan["checks"]))
    for row, check in zip(page.locator("#checks tbody tr").all(), plan["checks"], strict=True):
        expect(row.locator("td").last).to_have_text(as_shown(check["where"]))
    assert page.evaluate(
        "[...document.querySelectorAll('#events, main')].every(one => one.scrollWidth <= one.clientWidth)"
    )
    expect(page.locator("#commands tbody tr")).to_have_count(len(held(quiet, "/sequences/current")["commands"]))
    expect(page.locator("#commands tbody tr").first.locator("td").nth(2)).to_have_text("2")
    before = page.locator("#beside").evaluate("canvas => canvas.toDataURL()")
    page.locator("#scrub").fill("500")
    expect(page.locator("#scrub-read")).to_have_text("50 %")
    assert page.locator("#beside").evaluate("canvas => canvas.toDataURL()") != before
    page.get_by_role("button", name="Event before").click()
    expect(page.locator("#event")).not_to_contain_text(HOSTILE)
    while "plan, found" not in (page.locator("#event").text_content() or ""):
        page.get_by_role("button", name="Event before").click()
    page.evaluate("() => scrollTo(0, 0)")
    look_at(page, "player")
    hyphens = page.locator("main").evaluate(r"one => one.textContent.match(/(?:^|[\s(,:])-\d[\d.]*/g)")
    assert hyphens is None, "a minus sign is none of a keyboard's"
    wells = {name: page.evaluate(DRESSED, name) for name in ("light", "sunlight", "dark")}
    assert wells == {name: [told(name, "ground"), told(name, "text"), told(name, "panel")] for name in wells}
    page.locator("#theme").select_option("light")
    assert page.locator("#beside").evaluate("canvas => canvas.toDataURL()") != before
    page.reload()
    expect(page.locator("#theme")).to_have_value("light")
    look_at(page, "player-light")
    context.close()
    assert not faults
    assert set(asked) <= {"file", "data"}
