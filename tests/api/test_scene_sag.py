"""What the scene draws of an execution: the predicted rover, the way of its wheel, where that touches down."""

import numpy as np
import pytest
import viser

import footfall
from footfall.core.frames import apply
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.execution.plan import plan_execution
from footfall.robot.kinematics import wheel_centers
from footfall_ui.scene.sag import SagDrawing
from tests.support.chassis_ground import wavy

LEG = 2


@pytest.fixture(scope="module")
def done(athlete):
    """An executed step of a rover that sags on gentle waves."""
    ground = wavy(half=4.0)
    stood = footfall.stand(athlete, ground)
    rover = CompliantRover(athlete, ground)
    state = rover.state(rover.let_down(stood.posture, stood.T_site_base))
    foot = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    step = footfall.plan_step(athlete, ground, state, LEG, (float(foot[0] + 0.1), float(foot[1] + 0.1)), seed=1).plan
    assert step is not None
    found = plan_execution(athlete, ground, state, step).execution
    assert found is not None
    return found


def test_the_rover_goes_as_predicted_and_the_lines_stay(athlete, done):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        drawing, there = SagDrawing(server), server.scene.get_handle_by_name
        for moment, at in ((0.0, 0), (1.0, -1)):
            drawing.show(athlete, done, moment)
            rover = there("/sag")
            assert rover is not None
            assert rover.visible
            np.testing.assert_allclose(rover.position, done.Ts_site_base[at][:3, 3], atol=1e-9)
        way = there("/execution/way")
        assert isinstance(way, viser.LineSegmentsHandle)
        points = np.asarray(way.points) + way.position
        count = len(done.phases) - 1
        first, last = (apply(done.Ts_site_base[at], wheel_centers(athlete, done.predicted[at])[LEG]) for at in (0, -1))
        np.testing.assert_allclose(points[0, 0], first, atol=1e-6)
        np.testing.assert_allclose(points[count - 1, 1], last, atol=1e-6)
        # a cross at the touch-down, and a line to it from the planned contact
        np.testing.assert_allclose(points[count : count + 2].mean(axis=1), [done.touch_down] * 2, atol=1e-6)
        np.testing.assert_allclose(points[-1], [done.plan.contact, done.touch_down], atol=1e-6)
        # while the ghost of its commands plays the same motion, only the lines stay
        drawing.show(athlete, done, None)
        assert not rover.visible
        assert there("/execution/way") is way
        drawing.hide()
        assert there("/execution/way") is None
        assert there("/execution/text") is None
        drawing.remove()
        assert there("/sag") is None
    finally:
        server.stop()
