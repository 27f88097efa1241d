"""The handle of what is in hand, dragged with a real mouse in the scene."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import viser
from numpy.typing import NDArray
from playwright.sync_api import Browser, FloatRect, Page, expect

from footfall.core.frames import rotation_from_quat_wxyz
from tests.support.drawing import Drawing
from tests.support.page_steps import held, lay_out
from tests.support.server import Running, running_server
from tests.support.waiting import until

pytestmark = pytest.mark.scene
SIZE = 0.6
"""Length of the handle's arrows [m]."""


@pytest.fixture
def drawn(tmp_path: Path, drawing: Drawing) -> Iterator[tuple[Running, viser.ViserServer]]:
    """A server with the rock-step sample, without a rover; and the viser server that draws it."""
    with running_server(tmp_path, scene=True, prepare=lambda s: s.open_sample("rock-step")) as running:
        yield running, drawing.servers[0]


@pytest.fixture
def page(chromium: Browser, drawn: tuple[Running, viser.ViserServer]) -> Iterator[Page]:
    context = chromium.new_context(viewport={"width": 1280, "height": 720})
    lay_out(context)
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(f"{drawn[0].url}/?fixedDpr=0.5")
    page.get_by_text("Stepping over a rock", exact=True).wait_for()
    yield page
    context.close()
    assert not faults


def on_screen(camera: viser.CameraHandle, box: FloatRect, point: NDArray[np.float64]) -> tuple[float, float]:
    """Where a point is on the page."""
    R = rotation_from_quat_wxyz(camera.wxyz)  # x right, y down, z forward
    x, y, z = R.T @ (point - camera.position)
    focal = box["height"] / 2 / np.tan(camera.fov / 2)
    return box["x"] + box["width"] / 2 + focal * x / z, box["y"] + box["height"] / 2 + focal * y / z


def test_the_footfall_is_dragged_along_the_ground(
    page: Page, drawn: tuple[Running, viser.ViserServer], look: Callable[[str], None]
) -> None:
    running, server = drawn
    before = held(running)
    x, y, z = (before["footfall_answer"][axis] for axis in "xyz")
    until(lambda: len(server.get_clients()) == 1, "the scene's page")
    client = next(iter(server.get_clients().values()))
    page.locator("#gauge summary").click()  # it would lie over the handle
    page.locator("#hand-footfall").click()
    expect(page.locator("#hand-title")).to_have_text("In hand: footfall")
    until(lambda: client.scene.get_handle_by_name("/hand/handle"), "the handle")
    eye = np.array([x + 0.4, y + 1.9, z + 1.6])
    client.camera.position = eye
    client.camera.look_at = np.array([x + 0.3, y, z])
    box = page.locator("#scene").bounding_box()
    assert box is not None

    def turned() -> bool:
        back = rotation_from_quat_wxyz(client.camera.wxyz)[:, 2]
        ahead = np.array([x + 0.3, y, z]) - eye
        return bool(back @ ahead > 0.9999 * np.linalg.norm(ahead))

    until(turned, "the camera")

    def grasped() -> bool:
        # the frame may not have been drawn yet: tried again, from where a drag beside the handle has turned the view
        from_x, from_y = on_screen(client.camera, box, np.array([x + SIZE / 2, y, z]))
        to_x, to_y = on_screen(client.camera, box, np.array([x + SIZE / 2 + 0.2, y, z]))
        page.mouse.move(from_x + 40, from_y - 60)
        page.mouse.move(from_x, from_y)
        page.mouse.down()
        page.mouse.move((from_x + to_x) / 2, (from_y + to_y) / 2, steps=3)
        page.mouse.move(to_x, to_y, steps=3)
        moved = held(running)["hand"]["moved"]
        if not moved:
            page.mouse.up()
        return moved

    until(grasped, "the drag", period=0.5)
    expect(page.locator("#hand-read")).to_contain_text("m from where it was")
    look("dragged")
    assert held(running)["events"] == before["events"]
    assert held(running)["footfall"] == before["footfall"]
    page.mouse.up()
    until(lambda: held(running)["footfall"]["x"] != x, "the footfall let go")
    chosen = held(running)["footfall"]
    assert chosen["x"] - x == pytest.approx(0.2, abs=0.05)
    assert chosen["y"] == pytest.approx(y, abs=1e-6)
    made = held(running, "/sessions/current/log")["events"][before["events"] :]
    assert [event["type"] for event in made] == ["footfall_chosen"]
    # what is done in the scene is done by the page around it
    assert made[0]["payload"]["by"]["page"] == page.evaluate("sessionStorage.getItem('footfall-page')")
    assert page.locator("#others").text_content() == ""
    look("let-go")
    # on the page, the same goes back
    page.locator("#h-footfall").click()
    page.keyboard.press("Control+z")
    until(lambda: held(running)["footfall"] == before["footfall"], "the footfall taken back")
