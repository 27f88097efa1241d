"""`footfall view` in a real Chromium: a robot that others described walks over its ground, by keys and buttons."""

from collections.abc import Callable

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from footfall.planning.any_robot import plan_walk, stand
from footfall.planning.legged.problem import LeggedResult, LeggedSettings
from footfall.terrain.generate import fractal
from footfall_ui.viser_door import open_on_this_computer
from footfall_ui.walk_viewer import WalkViewer
from tests.browser.pictures import OUTPUTS
from tests.support.described import robot_of

UNHURRIED = LeggedSettings(time_limit=1e6)


@pytest.mark.scene
def test_a_walk_is_looked_at_foot_move_by_foot_move(
    chromium: Browser, look_at: Callable[[Page, str], None], request: pytest.FixtureRequest
) -> None:
    _, robot = robot_of("A1")
    dem = fractal(4.0, 0.05, roughness=0.01, seed=1)
    result = plan_walk(robot, dem, stand(robot, dem, settings=UNHURRIED), (0.2, 0.0), settings=UNHURRIED)
    assert isinstance(result, LeggedResult)
    assert result.plan is not None, result.reason
    moves = len(result.plan.moves)
    server = open_on_this_computer(0)
    viewer = WalkViewer(server, robot, dem, result)
    context = chromium.new_context(viewport={"width": 1280, "height": 720})
    try:
        page = context.new_page()
        page.goto(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=0.5")
        expect(page.get_by_text(f"Walk of {robot.name}")).to_be_visible()
        expect(page.get_by_text(f"● {moves} foot moves, the base goes")).to_be_visible()
        expect(page.get_by_text("Nothing here moves a robot.")).to_be_visible()
        page.get_by_role("button", name="Next foot move").click()
        page.get_by_role("button", name="Next foot move").click()
        expect(page.get_by_text(f"foot move 2 of {moves}: leg ")).to_be_visible()
        page.keyboard.press("ArrowLeft")
        expect(page.get_by_text(f"foot move 1 of {moves}: leg ")).to_be_visible()
        page.keyboard.press("Space")
        expect(page.get_by_role("button", name="Hold")).to_be_visible()
        page.keyboard.press("Space")
        expect(page.get_by_role("button", name="Play")).to_be_visible()
        look_at(page, "walk")
        picture = np.asarray(Image.open(OUTPUTS / f"{request.node.name}-walk.png").convert("RGB"), float)
        ground = picture[360:660, 200:800]
        assert ground.std() > 5.0  # neither black nor one grey: ground and robot are there
    finally:
        context.close()
        viewer.close()
        server.stop()
