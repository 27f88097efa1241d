"""A rover far away is drawn with fewer triangles, all of its parts with some."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import viser
from playwright.sync_api import Browser, Page

from benchmarks.scene_frames import COUNTING
from footfall.robot.meshes.display import display_parts
from footfall_ui.scene.painted import drawn_mesh
from footfall_ui.scene.robot import LEVELS, RobotDrawing
from tests.support.waiting import BOUND_MS, until

LATEST = "() => ({ ...window.drawnFrames?.at(-1), number: window.drawnFrames?.length ?? 0 })"


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    made = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield made
    made.stop()


def drawn(page: Page, server: viser.ViserServer, away: float) -> dict[str, Any]:
    """The picture from that far off [m], counted as WebGL is asked for it, once it stays the same."""
    before = page.evaluate(LATEST)["number"]
    (client,) = server.get_clients().values()
    with client.atomic():
        client.camera.position = np.array([away, 0.0, 1.0])
        client.camera.look_at = np.array([0.0, 0.0, 1.0])
    page.wait_for_function("before => drawnFrames.length > before", arg=before, timeout=BOUND_MS)
    seen = [page.evaluate(LATEST)]

    def quiet() -> bool:
        seen.append(page.evaluate(LATEST))
        return len(seen) > 3 and seen[-1]["triangles"] == seen[-3]["triangles"] > 0

    until(quiet, f"pictures from {away:g} m off that are alike")
    return seen[-1]


@pytest.mark.scene
def test_a_rover_far_away_takes_few_triangles_and_no_more_calls(
    chromium: Browser, server: viser.ViserServer, athlete
) -> None:
    RobotDrawing(server, athlete).place(np.array(athlete.description.postures["stand"]), np.eye(4))
    parts = display_parts(athlete.description)
    whole = sum(len(drawn_mesh(parts[link])[0].triangles) for link in athlete.description.meshes)
    page = chromium.new_page(viewport={"width": 200, "height": 120})
    page.add_init_script(f"({COUNTING})()")
    page.goto(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=1")
    page.wait_for_function(
        "whole => window.drawnFrames?.some(one => one.triangles >= whole)", arg=whole, timeout=BOUND_MS
    )
    # from the nearest link to the farthest it is less than 4 m
    (first, half), (second, least) = LEVELS
    near, middle, far = (drawn(page, server, away) for away in (first - 4.0, (first + second) / 2, second + 4.0))
    page.close()
    assert near["triangles"] == pytest.approx(whole, abs=10)
    assert middle["triangles"] == pytest.approx(half * whole, rel=0.05)
    assert least * whole * 0.95 < far["triangles"] < 1.5 * least * whole
    assert far["calls"] == middle["calls"] == near["calls"]
