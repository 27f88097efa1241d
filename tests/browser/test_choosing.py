"""Choosing a footfall on the page: layers side by side, suggestions, what-if of the chassis, clear and undo."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.support.page_steps import as_shown, figure, held, press
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]


def coloured(page: Page, served: Running, leg: int) -> str:
    """Ask for maps of a leg; their digest, which may be that of the maps before."""
    page.get_by_role("radio", name=f"Leg {leg}", exact=True).click()
    until(lambda: held(served)["view"]["leg"] == leg, "the chosen leg")
    before = {job["id"] for job in held(served)["jobs"]}
    press(page, "Show where leg 2 can stand")

    def done() -> bool:
        jobs = [job for job in held(served)["jobs"] if job["id"] not in before and job["kind"] == "maps"]
        return bool(jobs) and jobs[-1]["state"] == "done"

    until(done, f"maps of leg {leg}")
    return held(served)["maps"][str(leg)]


def test_suggestions_wait_for_colours_that_are_being_made(console: Page, quiet: Running, look: Keep) -> None:
    coloured(console, quiet, 2)
    made, job = [], {"id": "soon", "kind": "maps", "state": "running", "fraction": 0.35, "text": ""}
    console.route(
        "**/suggestions", lambda route: route.fulfill(status=409, json={"detail": "being made", "job": "soon"}), times=1
    )
    console.route(
        "**/jobs/soon", lambda route: route.fulfill(json=job | {"state": "done" if made else "running", "error": None})
    )
    console.keyboard.press("g")
    wait = console.locator("#suggestions-wait")
    expect(wait).to_have_text(
        "The colours for leg 2 are being made, 35 % so far: footfalls are suggested once they are there."
    )
    expect(console.locator("#suggestions li")).to_have_count(0)
    look("waits")
    made.append(True)
    expect(console.locator("#suggestions li")).to_have_count(5)
    expect(wait).to_be_empty()
    expect(console.locator("#toast")).to_be_hidden()


def test_suggestions_go_once_they_would_be_ranked_otherwise(console: Page, quiet: Running) -> None:
    coloured(console, quiet, 2)
    listed, note = console.locator("#suggestions li"), console.locator("#suggestions-note")
    otherwise = "Weights or direction are others now: suggest again."
    press(console, "Suggest footfalls")
    expect(listed).to_have_count(5)
    console.locator("#suggest-towards").select_option("90")
    expect(listed).to_have_count(0)
    expect(note).to_have_text(otherwise)
    press(console, "Suggest footfalls")
    expect(listed).to_have_count(5)
    expect(note).not_to_have_text(otherwise)
    console.locator("#panel-footfall summary").get_by_text("Weights of the suggestions", exact=True).click()
    console.locator("#weights input").first.fill("7")
    expect(listed).to_have_count(0)
    expect(note).to_have_text(otherwise)


def test_a_legend_that_did_not_come_leaves_none_of_another_layer(console: Page, quiet: Running) -> None:
    digest = coloured(console, quiet, 2)
    legend = console.locator("#legend")
    expect(legend).to_contain_text("reachable and stable")
    console.route(f"**/maps/{digest}", lambda one: one.fulfill(status=409, json={"detail": "not now"}), times=1)
    console.locator("#layer").select_option("slope")
    expect(legend).to_be_empty()
    expect(legend).to_contain_text("°")


def test_suggestions_and_two_layers_side_by_side(console: Page, quiet: Running, look: Keep) -> None:
    console.locator("#friction-aware").check()
    console.locator("#panel-ground summary").get_by_text("Balance assumptions", exact=True).click()
    console.locator("#payload").fill("150")
    console.locator("#tilt").fill("5")
    console.locator("#uphill").fill("90")
    console.locator("#gravity").select_option("1.62")
    digest = coloured(console, quiet, 2)
    with quiet.client() as client:
        judged = client.get(f"/sessions/current/maps/{digest}").json()["settings"]["balance"]
    assert (judged["payload_mass"], judged["gravity"], judged["friction"]) == (150, 1.62, 0.6)
    assert (judged["slope"], judged["uphill"]) == pytest.approx((np.deg2rad(5), np.pi / 2))
    expect(console.locator("#legend")).to_contain_text("collides")
    press(console, "Suggest footfalls")
    expect(console.locator("#suggestions li")).to_have_count(5)
    with quiet.client() as client:
        suggested = client.post("/sessions/current/suggestions", json={"leg": 2}).json()["footfalls"]
    listed = console.locator("#suggestions li").all_inner_texts()
    for text, one in zip(listed, suggested, strict=True):
        assert f"({figure(one['x'], 2)}, {figure(one['y'], 2)}) m" in text
        assert as_shown(one["reasons"][-1]) in text
        assert as_shown(one["apart"]["text"]) in text
    assert len({one["apart"]["text"] for one in suggested}) == 5
    console.locator("#suggestions button").first.click()
    until(lambda: held(quiet)["footfall"]["x"] == suggested[0]["x"], "the suggested footfall")
    assert held(quiet)["footfall_answer"]["acceptable"]

    console.locator("#area-map").click()
    sides = [console.locator("#map-left"), console.locator("#map-right")]
    with quiet.client() as client:
        about = client.get(f"/sessions/current/maps/{digest}").json()
        pictures = [
            client.get(f"/sessions/current/maps/{digest}/{name}.npy") for name in ("footing", "footing_friction")
        ]
    assert all(picture.status_code == 200 for picture in pictures)
    for side in sides:
        # a picture was drawn: not one flat colour
        until(lambda s=side: s.evaluate(_COLOURS) > 2, "a picture of the layer")
    # not Playwright's own: it waits for frames that a scene drawn in software may be slow to give
    sides[0].evaluate("side => side.scrollIntoView()")
    box = sides[0].bounding_box()
    assert box is not None
    console.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 0.3 * box["height"])
    read = console.locator("#map-read")
    expect(read).to_contain_text("slope")
    told = re.search(r"\(([−\d.]+), [−\d.]+\) m", read.inner_text())
    assert told is not None
    width, height = sides[0].evaluate("side => [side.clientWidth, side.clientHeight]")
    west, south, east, north = held(quiet)["terrain"]["bounds"]
    scale = 0.92 * min(width / (east - west), height / (north - south))  # all of the ground is in sight
    expected = (west + east) / 2 + (0.4 * box["width"] - 1 - width / 2) / scale
    assert abs(float(told[1].replace("−", "-")) - expected) < 2 * about["geometry"]["resolution"] + 0.01
    look("side-by-side")
    # it is of that leg
    console.get_by_role("radio", name="Leg 3", exact=True).click()
    expect(read).to_contain_text("Point at the map")
    expect(read).not_to_contain_text("slope")


_COLOURS = """canvas => {
  const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  const seen = new Set();
  for (let i = 0; i < data.length; i += 4) seen.add(`${data[i]},${data[i + 1]},${data[i + 2]}`);
  return seen.size;
}"""


def test_a_what_if_is_marked_and_ends(page: Page, served: Running, look: Keep) -> None:
    page.get_by_role("radio", name="Leg 2", exact=True).click()
    until(lambda: held(served)["view"]["leg"] == 2, "the chosen leg")
    page.locator("#panel-what-if summary").click()
    real = held(served)["state"]
    page.locator("#shift-dz").fill("-0.1")
    press(page, "Show what if")
    until(lambda: held(served)["what_if"], "the what-if")
    assert held(served)["what_if"]["dz"] == pytest.approx(-0.1)
    expect(page.locator("#status-what-if")).to_contain_text("up −0.100 m")
    # colours follow the shifted chassis, not the rover
    until(lambda: held(served)["maps_current"].get("2"), "maps of the shifted chassis")
    with served.client() as client:
        maps = client.get(f"/sessions/current/maps/{held(served)['maps']['2']}").json()
    assert maps["parents"]["state"] == held(served)["state"] != real
    look("what-if")
    press(page, "Check the move")
    expect(page.locator("#what-if-answer")).to_contain_text("contact drift")
    press(page, "Back to the rover")
    until(lambda: held(served)["what_if"] is None, "the end of the what-if")
    expect(page.locator("#status-what-if-box")).to_be_hidden()
    until(lambda: held(served)["maps_current"].get("2"), "maps of the rover as it stands")
    assert held(served)["state"] == real

    page.locator("#shift-dz").fill("-1.9")
    press(page, "Show what if")
    expect(page.locator("#what-if-answer .no")).to_contain_text("leg")
    assert held(served)["what_if"] is None
    look("what-if-refused")


def test_a_shift_is_found_for_a_footfall_out_of_reach(console: Page, quiet: Running, look: Keep) -> None:
    with quiet.client() as client:
        digest = coloured(console, quiet, 2)
        grid = client.get(f"/sessions/current/maps/{digest}").json()["geometry"]
        raw = client.get(f"/sessions/current/maps/{digest}/footing.npy").content
    footing = np.frombuffer(raw[-grid["rows"] * grid["cols"] :], np.uint8).reshape(grid["rows"], grid["cols"])
    y, x = np.meshgrid(
        grid["y0"] + grid["resolution"] * np.arange(grid["rows"]),
        grid["x0"] + grid["resolution"] * np.arange(grid["cols"]),
        indexing="ij",
    )
    # just beyond the green, away from the chassis
    green = footing == 3
    beyond = (footing == 1) & (np.hypot(x, y) > np.hypot(x[green], y[green]).max())
    away = np.array([np.hypot(x[green] - a, y[green] - b).min() for a, b in zip(x[beyond], y[beyond], strict=True)])
    at = int(np.argmin(np.abs(away - 0.1)))
    console.locator("#footfall-x").fill(f"{x[beyond][at]:.3f}")
    console.locator("#footfall-y").fill(f"{y[beyond][at]:.3f}")
    press(console, "Choose")
    expect(console.locator("#footfall-answer .no")).to_be_visible()
    console.locator("#panel-what-if summary").click()
    press(console, "Find a shift for the footfall")
    until(lambda: held(quiet)["shift"], "an answer about shifts")
    with quiet.client() as client:
        answer = client.get("/sessions/current/shifts/current").json()
    shown = console.locator("#what-if-answer")
    if answer["status"] == "found":
        expect(shown).to_contain_text("A shift makes it possible")
        assert float(console.locator("#shift-dx").input_value()) == pytest.approx(answer["shift"]["dx"], abs=1e-3)
    else:
        expect(shown).to_contain_text(as_shown(answer["reason"][:40]))
    look("shift")


def test_ground_is_cleared_and_comes_back(console: Page, quiet: Running) -> None:
    before = held(quiet)
    assert before["footfall"] is not None
    press(console, "Clear around footfall")
    until(lambda: held(quiet)["dem"] != before["dem"], "a cleared terrain")
    cleared = held(quiet)
    assert cleared["terrain"]["known"] < before["terrain"]["known"]
    expect(console.locator("#footfall-answer")).to_contain_text("not known")
    console.locator("#h-ground").click()
    console.keyboard.press("u")
    until(lambda: held(quiet)["dem"] == before["dem"], "the terrain before")
