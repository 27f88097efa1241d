"""What is drawn of a route: a line that follows the ground, or where the way ends; nothing on other ground."""

import numpy as np
import pytest
import viser

import footfall
from footfall.planning.route.plan import plan_route
from footfall.planning.route.problem import NoGo, RouteResult, RouteSettings
from footfall.session.jobs.local import InlineJobs
from footfall.session.jobs.requests import RouteRequest
from footfall.session.products.kinds import ROUTE
from footfall.session.registry import Sessions
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.ground.surface import height_at
from footfall_ui.scene.route import LABEL, LINE, OVER_GROUND, STEP, RouteDrawing, on_ground, route_line
from tests.support.chassis_ground import wavy

ROUND = tuple(NoGo(3.0 * np.cos(a), 3.0 * np.sin(a), 0.6) for a in np.linspace(0.0, 2 * np.pi, 24, endpoint=False))
"""Nothing leads out of it."""


@pytest.fixture(scope="module")
def ground():
    return wavy(half=6.0)


def test_the_line_follows_the_ground(ground):
    points = np.array([[-2.0, -1.0], [0.3, 0.4], [2.0, 0.5]])
    line = route_line(ground, points)
    flat = np.linalg.norm(line[:, 1, :2] - line[:, 0, :2], axis=1)
    assert flat.max() <= STEP + 1e-9
    assert flat.sum() == pytest.approx(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    np.testing.assert_array_equal(line[1:, 0], line[:-1, 1])
    np.testing.assert_allclose(line[0, 0, :2], points[0])
    np.testing.assert_allclose(line[-1, 1, :2], points[-1])
    over = line[:, 1, 2] - height_at(ground, line[:, 1, 0], line[:, 1, 1])
    np.testing.assert_allclose(over, OVER_GROUND, atol=1e-6)


def test_over_unknown_ground_it_stays_as_high_as_it_was():
    heights = np.full((21, 21), 0.5, np.float32)
    heights[:, 8:12] = np.nan
    dem = from_heights(heights, 0.1, 0.0, 0.0, "a gap")
    xy = np.column_stack([np.linspace(0.1, 1.9, 30), np.full(30, 1.0)])
    np.testing.assert_allclose(on_ground(dem, xy)[:, 2], 0.5 + OVER_GROUND, atol=1e-6)


def test_the_latest_route_is_drawn_on_its_ground_alone(tmp_path, athlete, ground):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with Sessions(tmp_path, InlineJobs(), robot=athlete) as sessions:
        live = sessions.create("routes")
        live.terrains.load(ground)
        state = footfall.stand(athlete, ground)
        live.stances.set(state)
        drawing = RouteDrawing(server)
        drawing.draw(live)
        assert server.scene.get_handle_by_name(LINE) is None

        live.stances.ask(ROUTE, RouteRequest((2.0, 0.5))).finish()
        drawing.draw(live)
        line, label = server.scene.get_handle_by_name(LINE), server.scene.get_handle_by_name(LABEL)
        assert isinstance(label, viser.LabelHandle)
        found = plan_route(athlete, ground, state, (2.0, 0.5)).plan
        assert found is not None
        assert label.text == f"route: {found.length:.1f} m"
        np.testing.assert_allclose(label.position, route_line(ground, found.points)[-1, 1])
        drawing.draw(live)
        assert server.scene.get_handle_by_name(LINE) is line  # as it was

        refused = live.get(live.stances.ask(ROUTE, RouteRequest((5.0, 0.0), RouteSettings(no_go=ROUND))).finish())
        assert isinstance(refused, RouteResult)
        assert refused.plan is None
        drawing.draw(live)
        label = server.scene.get_handle_by_name(LABEL)
        assert isinstance(label, viser.LabelHandle)
        assert label.text == "✕ the route ends here"
        np.testing.assert_allclose(label.position[:2], refused.cut_off)

        live.terrains.load(wavy(half=5.0))
        drawing.draw(live)
        assert server.scene.get_handle_by_name(LINE) is None
    server.stop()
