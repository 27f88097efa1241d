"""The operator's page, driven by clicks and keys; what the page shows is compared with what the API holds."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import FilePayload, Page, expect

import footfall_ui.scene.clicks
from tests.support.page_steps import as_shown, figure, held
from tests.support.server import Running
from tests.support.waiting import until

README = Path(__file__).resolve().parents[2] / "README.md"
Keep = Callable[[str], None]


def changed(served: Running, name: str, before: object) -> None:
    until(lambda: held(served)[name] != before, f"a new {name}")


@pytest.fixture
def picked(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What each click on the scene met, one after the other: a point of the ground, or None."""
    found: list[Any] = []

    def kept(*ray: Any) -> Any:
        found.append(pick(*ray))
        return found[-1]

    pick = footfall_ui.scene.clicks.pick
    monkeypatch.setattr(footfall_ui.scene.clicks, "pick", kept)
    return found


def click_ground(page: Page, served: Running, picked: list[Any], x: float, y: float) -> dict:
    """Click on the scene where the ground point (x, y) is drawn; the view is learnt from clicks at known pixels."""
    frame = page.locator("#scene")
    box = frame.bounding_box()
    assert box is not None
    pixels, points = [], []

    def click(u: float, v: float) -> dict | None:
        before, clicks = held(served)["footfall"], len(picked)
        page.mouse.click(box["x"] + u, box["y"] + v)
        until(lambda: len(picked) > clicks, "the scene's hearing of a click")
        if picked[-1] is None:
            return None  # the ray met no ground: a hole, or the edge of the map
        until(lambda: held(served)["footfall"] != before, "a chosen footfall")
        return held(served)["footfall"]

    for u, v in ((0.3, 0.62), (0.7, 0.62), (0.25, 0.8), (0.72, 0.8), (0.4, 0.72), (0.6, 0.7), (0.5, 0.83)):
        chosen = click(u * box["width"], v * box["height"])
        if chosen:
            pixels.append((u * box["width"], v * box["height"]))
            points.append((chosen["x"], chosen["y"]))
    assert len(points) >= 4, "hardly any click on the scene met the ground"
    rows = []
    for (u, v), (px, py) in zip(pixels, points, strict=True):
        rows += [[px, py, 1, 0, 0, 0, -u * px, -u * py, -u], [0, 0, 0, px, py, 1, -v * px, -v * py, -v]]
    plane_to_pixel = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)  # direct linear transform
    aim = np.array([x, y])
    for _ in range(4):  # the ground is no plane: correct the aim by the miss, as a person would
        u, v, w = plane_to_pixel @ (*aim, 1.0)
        chosen = click(u / w, v / w)
        assert chosen is not None
        miss = np.array([x - chosen["x"], y - chosen["y"]])
        if np.hypot(*miss) < 0.1:
            return chosen
        aim += miss
    raise AssertionError(f"the click came no nearer than {np.hypot(*miss):.2f} m")


@pytest.mark.scene
@pytest.mark.parametrize("physics", [True])
def test_the_first_step_of_the_readme(picked: list[Any], page: Page, served: Running, look: Keep) -> None:
    """Every bold name of the README's browser steps is pressed, in its order."""
    part = README.read_text().split("### In the browser")[1].split("###")[0]
    steps = re.findall(r"^\d\. (.*)$", part, re.M)
    names = [re.findall(r"\*\*(.+?)\*\*", step) for step in steps]
    assert names == [
        ["Take images"],
        ["Build terrain"],
        ["Leg 2"],
        ["Show where leg 2 can stand"],
        ["Choose"],
        ["Plan step"],
        ["Ghost"],
        ["Make commands", "Export"],
        ["Arm", "Send to rover"],
    ]

    def press(name: str) -> None:
        page.get_by_role("button", name=re.compile(rf"^{re.escape(name)}(:|$)")).click()

    look("1-opened")
    before = held(served)
    press("Take images")
    changed(served, "snapshot", before["snapshot"])
    press("Build terrain")
    changed(served, "dem", before["dem"])
    page.get_by_role("radio", name="Leg 2", exact=True).click()
    press("Show where leg 2 can stand")
    until(lambda: held(served)["maps_current"].get("2"), "the maps of leg 2")
    expect(page.locator("#legend")).to_contain_text("reachable and stable")
    look("2-coloured")

    gauge = page.locator("#gauge summary")
    gauge.click()  # it lies over the ground
    clicked = click_ground(page, served, picked, -0.55, 1.65)
    gauge.click()
    assert np.hypot(clicked["x"] + 0.55, clicked["y"] - 1.65) < 0.1
    answer = held(served)["footfall_answer"]
    expect(page.locator("#footfall-answer")).to_contain_text(figure(answer["x"], 3))
    look("3-clicked")
    page.locator("#footfall-x").fill("-0.432")
    page.locator("#footfall-y").fill("1.794")
    press("Choose")
    until(lambda: abs(held(served)["footfall"]["x"] + 0.432) < 1e-9, "the typed footfall")
    assert held(served)["footfall_answer"]["acceptable"]

    old = held(served)["plan"]["digest"]
    press("Plan step")
    until(lambda: held(served)["plan"]["digest"] != old, "the plan")
    assert held(served)["plan"]["status"] == "found", held(served)["plan"]
    expect(page.locator("#plan-answer")).to_contain_text("Found by")
    with served.client() as client:
        result = client.get("/sessions/current/plans/current").json()
    rows = page.locator("#checks tbody tr")
    expect(rows).to_have_count(len(result["checks"]))
    assert rows.first.locator("td").first.inner_text() == result["checks"][0]["name"]

    page.locator("#scrub").fill("430")
    until(lambda: abs(held(served)["view"]["scrub"] - 0.43) < 1e-9, "the ghost's place")
    look("4-planned")

    old = held(served)["sequence"]
    press("Make commands")
    until(lambda: held(served)["sequence"] != old, "the sequence")
    with served.client() as client:
        sequence = client.get("/sequences/current").json()
    expect(page.locator("#commands tbody tr")).to_have_count(len(sequence["commands"]))
    page.locator("#export-format").select_option("json")
    with page.expect_download() as download:
        press("Export")
    exported = json.loads(Path(download.value.path()).read_text())
    with served.client() as client:
        assert exported == client.get("/sequences/current/export", params={"format": "json"}).json()

    press("Arm")
    press("Send to rover")
    until(lambda: held(served)["commands"], "the first command")
    expect(page.locator("#status-mode")).to_have_text("moving")
    look("5-moving")
    last = len(sequence["commands"]) - 1
    until(lambda: any(c["row"] == last and c["state"] == "done" for c in held(served)["commands"]), "arrival")
    live = served.sessions.current
    assert live is not None
    predicted = np.array(sequence["predicted"][-1])
    # springs give way to what the legs carry, and the acknowledgement may be a little ahead of the next telemetry frame
    until(
        lambda: live.rover.frame and np.allclose(live.rover.frame.state.posture, predicted, atol=0.05),
        "the predicted posture",
    )
    expect(page.locator("#status-match")).to_have_text("carried out as predicted")
    look("6-arrived")


def test_stop_is_above_a_dialog_and_shows_sent_and_acknowledged(page: Page, served: Running, look: Keep) -> None:
    page.keyboard.press("?")
    expect(page.locator("#help")).to_be_visible()
    page.get_by_role("button", name="STOP", exact=True).click()
    expect(page.locator("#stop-state")).to_contain_text("acknowledged by the rover")
    stop = held(served)["stop"]
    assert stop["latched"]
    assert stop["acknowledged"]
    look("stopped")
    page.get_by_role("button", name="STOP", exact=True).click()  # once more does no harm
    with served.client() as client:
        refused = client.post("/sequences/current/arm", json={})
    assert refused.status_code == 409
    page.get_by_role("button", name="Clear stop").click()
    until(lambda: not held(served)["stop"]["latched"], "the stop cleared")
    expect(page.locator("#stop-state")).to_contain_text("Not a safety-rated stop.")


def test_stop_by_keyboard_from_a_field(page: Page, served: Running) -> None:
    page.locator("#footfall-x").focus()
    page.keyboard.press("Control+.")
    until(lambda: held(served)["stop"]["acknowledged"], "the stop acknowledged")


def test_a_refused_footfall_says_why(console: Page, quiet: Running, look: Keep) -> None:
    console.locator("#footfall-x").fill("3.2")
    console.locator("#footfall-y").fill("3.2")
    console.get_by_role("button", name="Choose", exact=True).click()
    expect(console.locator("#footfall-answer")).to_contain_text("out of reach")
    console.get_by_role("button", name="Plan step", exact=True).click()
    expect(console.locator("#plan-answer")).to_contain_text("No plan")
    reason = as_shown(held(quiet)["plan"]["reason"])
    assert "leg" in reason
    expect(console.locator("#plan-answer")).to_contain_text(reason)
    expect(console.locator("#job-said")).to_have_text(f"No plan: {reason}")
    expect(console.get_by_role("button", name="Make commands")).to_be_disabled()
    look("refused")


def test_an_edit_that_breaks_a_rule_is_marked_and_can_be_undone(page: Page, served: Running, look: Keep) -> None:
    field = page.get_by_label("Seconds of row 2", exact=True)
    field.fill("0.01")
    field.press("Enter")
    row = page.locator("#commands tbody tr").nth(1)
    expect(row).to_have_class("failing")
    expect(page.get_by_role("button", name="Export", exact=True)).to_be_disabled()
    expect(page.get_by_role("button", name="Arm", exact=True)).to_be_disabled()
    with served.client() as client:
        broken = [rule for rule in client.get("/sequences/current").json()["rules"] if not rule["holds"]]
    assert [rule["rule"] for rule in broken] == ["speed"]
    expect(row).to_contain_text(as_shown(broken[0]["text"]))
    row.scroll_into_view_if_needed()
    look("failing")
    page.get_by_role("button", name="Undo", exact=True).click()
    expect(row).not_to_have_class("failing")
    expect(page.get_by_role("button", name="Export", exact=True)).to_be_enabled()


def test_names_from_files_are_text(console: Page, quiet: Running) -> None:
    hostile = "<img src=x onerror=document.title='owned'>"
    heights = "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n0 0 0\n0 0 0\n0 0 0\n"
    console.locator("#terrain-file").set_input_files(
        {"name": f"{hostile}.asc", "mimeType": "text/plain", "buffer": heights.encode()}
    )
    expect(console.locator("#ground-text")).to_contain_text("<img")
    assert console.title() == "FootFall"
    assert console.locator("#ground-text img").count() == 0


def test_a_scan_is_loaded_with_the_unit_and_direction_that_are_chosen(console: Page, quiet: Running) -> None:
    rows = "".join(f"{x} 2500 {y}\n" for x in range(0, 1000, 20) for y in range(0, 1000, 20))
    file: FilePayload = {"name": "lidar.xyz", "mimeType": "text/plain", "buffer": rows.encode()}
    before = held(quiet)["dem"]
    console.locator("#terrain-file").set_input_files(file)
    refusal = console.get_by_text("does not say what its coordinates mean").first
    expect(refusal).to_be_visible()
    assert held(quiet)["dem"] == before
    console.get_by_text("Unit and axis of a scan", exact=True).click()
    console.locator("#scan-unit").select_option("mm")
    console.locator("#scan-up").select_option("y")
    console.locator("#terrain-file").set_input_files(file)
    expect(console.locator("#ground-text")).to_contain_text("lidar.xyz")
    changed(quiet, "dem", before)


def test_lost_rover_is_told(page: Page, served: Running, look: Keep) -> None:
    served.rover.close()
    expect(page.locator("#status-link")).to_have_attribute("data-state", "bad")
    expect(page.locator("#status-link")).to_contain_text("LOST, last heard")
    look("lost")


def test_long_work_is_in_sight_wherever_and_can_be_cancelled(console: Page, quiet: Running, look: Keep) -> None:
    before = held(quiet)["dem"]
    console.keyboard.press("9")  # nothing of the ground is shown there
    console.keyboard.press("t")
    cancel = console.get_by_role("button", name="Cancel", exact=True)
    expect(cancel).to_be_visible()
    expect(console.locator("#job-text")).to_contain_text("Terrain: ")
    look("running")
    console.keyboard.press("x")
    until(lambda: held(quiet)["jobs"][-1]["state"] in ("cancelled", "done"), "the end of the job")
    assert held(quiet)["jobs"][-1]["state"] == "cancelled"
    expect(cancel).to_be_hidden()
    assert held(quiet)["dem"] == before
    expect(console.locator("#job-said")).to_have_text("Terrain cancelled")
    # how it ended leads to where it is told
    console.locator("#job-said").click()
    expect(console.locator("#h-ground")).to_be_focused()


def test_images_that_are_asked_for_are_waited_for_in_sight(page: Page, served: Running) -> None:
    before = held(served)["snapshot"]
    page.keyboard.press("i")
    expect(page.locator("#job-text")).to_contain_text("Waiting for images: ")
    expect(page.locator("#job-cancel")).to_be_hidden()
    changed(served, "snapshot", before)
    expect(page.locator("#job-said")).to_have_text("Images received")
    # a plan of the ground before is still the plan; what was cleared since makes it one of older ground
    expect(page.locator("#status-match")).to_have_text("plan starts where the rover is")
    page.keyboard.press("c")
    expect(page.locator("#status-match")).to_have_text("planned on older ground")
    expect(page.locator("#status-match")).to_have_attribute("data-state", "warn")
    # no footfall is judged on that ground: neither green nor red
    page.locator("#footfall-x").fill("3.2")
    page.locator("#footfall-y").fill("3.2")
    page.get_by_role("button", name="Choose", exact=True).click()
    said = page.locator("#footfall-answer p").first
    expect(said).to_contain_text("Not judged yet: leg 2 at (3.200, 3.200")
    expect(said).to_have_class("doubt")


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1024, 768), (820, 1100)])
def test_stop_is_in_sight_on_every_screen(console: Page, quiet: Running, look: Keep, width: int, height: int) -> None:
    console.set_viewport_size({"width": width, "height": height})
    console.keyboard.press("?")
    box = console.locator("#stop").bounding_box()
    assert box is not None
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= width
    assert 0 <= box["y"] <= 60
    at = [box["x"] + box["width"] / 2, box["y"] + box["height"] / 2]
    assert console.evaluate("([x, y]) => document.elementFromPoint(x, y).id", at) == "stop"
    look("screen")


COVERED = """() => {
    const scene = document.querySelector(".scene").getBoundingClientRect();
    const boxes = [...document.querySelectorAll(".scene .overlay")].filter((one) => one.checkVisibility())
        .map((one) => [one.className, one.getBoundingClientRect()]);
    const within = (b) => b.left >= scene.left && b.right <= scene.right
        && b.top >= scene.top && b.bottom <= scene.bottom;
    const outside = boxes.filter(([, b]) => !within(b));
    const over = boxes.flatMap(([name, a], i) => boxes.slice(i + 1)
        .filter(([, b]) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)
        .map(([other]) => `${name} and ${other}`));
    return { height: scene.height, shown: boxes.length, outside: outside.map(([name]) => name), over };
}"""


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1024, 768), (820, 1100)])
def test_nothing_over_the_scene_covers_anything_else_there(console: Page, width: int, height: int) -> None:
    console.set_viewport_size({"width": width, "height": height})
    expect(console.locator("#scrub-time")).to_be_visible()
    for layout in ("walk", "plan a step", "execute", "review"):
        console.locator("#layout").select_option(layout)
        seen = console.evaluate(COVERED)
        assert seen["shown"] >= 4
        assert seen["outside"] == seen["over"] == [], (layout, seen)
        assert seen["height"] >= 270


LONGER = f"""() => {{
    const long = "a note of many words that takes a line more than the gauge has ".repeat(60);
    for (const id of ["gauge-note", "legend"]) document.getElementById(id).textContent = long;
    const [layers, gauge] = [".layers", ".gauge"].map((name) => document.querySelector(name));
    gauge.open = true;
    const choice = document.getElementById("layer").getBoundingClientRect();
    return {{
        ...({COVERED})(),
        scrolled: [layers, gauge].map((one) => one.scrollHeight - one.clientHeight),
        spare: layers.getBoundingClientRect().bottom - choice.bottom,
    }};
}}"""


def test_a_long_gauge_and_legend_share_the_height_beside_the_scene(console: Page) -> None:
    """Whatever they say: neither lies over the other, each scrolls, and what chooses the colours stays in sight."""
    console.set_viewport_size({"width": 1024, "height": 768})
    console.locator("#layout").select_option("execute")
    seen = console.evaluate(LONGER)
    assert seen["outside"] == seen["over"] == [], seen
    assert min(seen["scrolled"]) > 0
    assert seen["spare"] >= 0
