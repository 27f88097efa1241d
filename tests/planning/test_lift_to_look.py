"""Which leg is worth lifting to look, and when a walk in a closed loop lifts it."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.frames import apply
from footfall.planning.body.stand import stand
from footfall.planning.looking.how_to_see import unknown_around, with_leg_up
from footfall.planning.looking.in_view import in_view
from footfall.planning.looking.lift_to_look import AROUND, WORTH, leg_to_lift
from footfall.planning.walk.problem import WalkGoal
from footfall.planning.walk_execution.decision import Act, SoFar, WayOnSettings
from footfall.planning.walk_execution.way_on import MOST_LIFTED, VAIN, way_on
from footfall.robot.kinematics import wheel_centers
from tests.support.chassis_ground import wavy

GOAL = WalkGoal(1.5, 0.0)


@pytest.fixture(scope="module")
def ground():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def stood(athlete, ground):
    return stand(athlete, ground)


@pytest.fixture(scope="module")
def holes(athlete, ground, stood):
    """The ground with a hole at each wheel, on the side away from the chassis, of another size for each."""
    wheels = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))
    east, north = np.meshgrid(ground.geometry.xs, ground.geometry.ys)
    heights = ground.heights.copy()
    for leg, (x, y, _) in enumerate(wheels):
        out = np.array([x, y]) / np.hypot(x, y)
        heights[np.hypot(east - x - 0.1 * out[0], north - y - 0.1 * out[1]) <= 0.14 + 0.03 * leg] = np.nan
    return replace(ground, heights=heights)


def share(athlete, dem, state, leg):
    """What lifting a leg shows of the unknown ground at its wheel."""
    wheel = apply(state.T_site_base, wheel_centers(athlete, state.posture))[leg]
    unknown = unknown_around(dem, wheel[:2], AROUND)
    lifted = with_leg_up(athlete, state, leg)
    assert lifted is not None
    assert len(unknown)
    return float((in_view(athlete, dem, lifted, unknown) & ~in_view(athlete, dem, state, unknown)).mean())


def test_it_is_the_leg_that_shows_most(athlete, holes, stood):
    shares = [share(athlete, holes, stood, leg) for leg in range(6)]
    found = leg_to_lift(athlete, holes, stood)
    assert found is not None
    assert found.share == max(shares) >= WORTH
    assert found.leg == int(np.argmax(shares))
    other = leg_to_lift(athlete, holes, stood, but=[found.leg])
    assert other is not None
    assert other.share == max(one for leg, one in enumerate(shares) if leg != found.leg)
    assert leg_to_lift(athlete, holes, stood, but=range(6)) is None


def test_where_nothing_is_hidden_no_leg_is_lifted(athlete, ground, stood):
    assert leg_to_lift(athlete, ground, stood) is None


def test_a_leg_that_bears_nothing_is_not_lifted(athlete, holes, stood):
    found = leg_to_lift(athlete, holes, stood)
    assert found is not None
    forces = np.tile((0.0, 0.0, 1500.0), (6, 1))
    forces[found.leg] = 0.0
    other = leg_to_lift(athlete, holes, replace(stood, wheel_forces=forces))
    assert other is None or other.leg != found.leg


@pytest.mark.parametrize("looked", [False, True])
@pytest.mark.parametrize("anew", range(6))
@pytest.mark.parametrize("lifted", [(), (0,), (0, 5)])
def test_a_leg_is_lifted_only_after_a_look_and_plans_in_vain_and_not_for_ever(
    athlete, holes, stood, looked, anew, lifted
):
    so_far = SoFar(looked=looked, anew=anew, refused="no walk is found", lifted=lifted)
    found = way_on(athlete, holes, stood, GOAL, None, 0, so_far, WayOnSettings())
    due = looked and anew >= VAIN and len(lifted) < MOST_LIFTED
    assert (found.act is Act.LIFT) == due
    if due:
        hidden = leg_to_lift(athlete, holes, stood, lifted)
        assert hidden is not None
        assert found.leg == hidden.leg not in lifted
        assert found.reason == f"{hidden}; before: no walk is found"
    else:
        assert found.leg == -1


def test_on_known_ground_it_stops_as_before(athlete, ground, stood):
    so_far = SoFar(looked=True, anew=5, refused="no walk is found")
    assert way_on(athlete, ground, stood, GOAL, None, 0, so_far, WayOnSettings()).act is Act.STOP
