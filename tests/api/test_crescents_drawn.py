"""`footfall view` of a robot with stacks: crescents on the ground that go with its feet, and none of another robot."""

import numpy as np
import pytest

from footfall.core.frames import apply
from footfall.io.any_robot import load_legged
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.stacks import ring_margins, stacks_of
from footfall.planning.legged.stand import stand
from footfall.planning.legged.step import plan_step
from footfall.robot.legged.posture import placed
from footfall.terrain.generate import plane
from footfall_ui.scene.crescents import CrescentDrawing
from footfall_ui.viser_door import open_on_this_computer
from footfall_ui.walk_viewer import WalkViewer
from tests.support.described import robot_of

LEG = 1


@pytest.fixture(scope="module")
def stepped():
    robot, dem = load_legged("ambler"), plane((14, 10), 0.5)
    state = stand(robot, dem)
    x, y, _ = state.soles[LEG]
    return robot, dem, plan_step(robot, dem, state, LEG, (x + 0.4, y), LeggedSettings(time_limit=1e5))


@pytest.fixture
def server():
    server = open_on_this_computer(0)
    yield server
    server.stop()


def drawn(server, number):
    """Points (n, 3) of a crescent in site."""
    handle = server.scene._handle_from_node_name[f"/crescents/{number}"]
    return np.asarray(handle.points, float).reshape(-1, 3) + handle.position


def test_crescents_bound_where_the_stacks_may_be_over_the_feet_that_stand(server, stepped):
    robot, dem, result = stepped
    viewer = WalkViewer(server, robot, dem, result)
    try:
        seen = []
        for row, lifted in ((0, -1), (int(np.argmax(result.plan.legs >= 0)) + 8, LEG)):
            assert result.plan.legs[row] == lifted
            viewer._scrubber.value = int(np.ceil(1000 * viewer._moments[row]))
            soles = apply(result.plan.Ts_site_base[row], placed(robot, result.plan.waypoints[row]).soles)
            standing = tuple(leg for leg in robot.legs if leg != lifted)
            for number, stack in enumerate(stacks_of(robot)):
                points = drawn(server, number)
                margins = ring_margins(stack, soles, points[:, :2], standing)
                # on the rim of one ring, and in none of the others' outside
                np.testing.assert_allclose(margins, 0.0, atol=0.02)
                np.testing.assert_allclose(points[:, 2], 0.0, atol=0.02)
            seen.append(drawn(server, 0))
        assert len(seen[0]) != len(seen[1]) or np.abs(seen[0] - seen[1]).max() > 0.1
    finally:
        viewer.close()


def test_a_robot_without_stacks_has_none(server):
    robot = robot_of(6)[1]
    CrescentDrawing(server, robot).show(np.zeros((6, 3)), tuple(robot.legs))
    assert not [name for name in server.scene._handle_from_node_name if name.startswith("/crescents")]
