"""A wave as a walk: as strict as the walk is asked to be, refused for what no gait heeds, with the check and size."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.gait.as_walk import SHARED, plan_wave, wave_like
from footfall.planning.gait.problem import TRIPOD, WAVE, GaitSettings
from footfall.planning.walk.problem import Place, WalkGoal, WalkSettings
from footfall.planning.walk_execution.plan import plan_walk_execution
from footfall.planning.walk_execution.unpressed import unpressed
from footfall.robot.kinematics import wheel_centers
from footfall.session.jobs.requests import WalkRequest
from tests.support.chassis_ground import wavy

GOAL = WalkGoal(0.3, 0.1)
WIDE = GaitSettings(WAVE, 0.6)


@pytest.fixture(scope="module")
def place(athlete):
    dem = wavy(half=4.0)
    return dem, footfall.stand(athlete, dem)


@pytest.fixture(scope="module")
def wave(athlete, place):
    dem, state = place
    found = plan_wave(athlete, dem, state, GOAL, WIDE, WalkSettings())
    assert found.status is Status.FOUND, found.reason
    return found.plan


def test_it_is_the_gait_and_moves_one_foot_at_a_time(athlete, place, wave):
    """Second method: the gait planned by itself, with its settings written out."""
    dem, state = place
    gait = footfall.plan_gait(athlete, dem, state, GOAL, settings=GaitSettings(WAVE, 0.6)).plan
    assert gait is not None
    np.testing.assert_array_equal(wave.waypoints, gait.waypoints)
    assert [(leg,) for leg in wave.legs] == list(gait.groups)
    np.testing.assert_allclose(wave.Ts_site_base[-1, :2, 3], (GOAL.x, GOAL.y), atol=1e-6)


def test_it_keeps_to_the_settings_of_the_walk():
    walk = WalkSettings(
        steepest=0.4,
        least_margin=0.2,
        friction=0.3,
        most_torque=0.6,
        clearance=0.03,
        reach_reserve=0.04,
        joint_reserve=0.07,
        lift=0.15,
        raise_terrain=0.02,
        height=1.3,
        longest=0.5,
    )
    made = wave_like(walk, GaitSettings(TRIPOD, 0.6, tolerance=0.1, clearance=0.0))
    assert (made.gait, made.stride, made.tolerance) == (WAVE, 0.5, 0.1)
    for name in SHARED:
        assert getattr(made, name) == getattr(walk, name) != getattr(GaitSettings(), name), name


def test_a_margin_that_it_lacks_refuses_it_with_the_check_and_the_size(athlete, place, wave):
    dem, state = place
    least = float(wave.margins.min())
    found = plan_wave(athlete, dem, state, GOAL, WIDE, WalkSettings(least_margin=least + 0.05))
    assert (found.status, found.plan) == (Status.NO_PATH, None)
    [blocked] = found.blocked
    assert blocked.check_name.startswith("balance")
    assert blocked.lacks is not None
    assert blocked.move is not None
    assert 0.0 < blocked.lacks <= 0.05 + 1e-6
    assert blocked.unit == "m"
    assert f"step {blocked.move + 1}" in found.reason


@pytest.mark.parametrize("others", [False, True])
def test_a_footfall_on_a_forbidden_place_refuses_it_but_not_one_of_another_leg(athlete, place, wave, others):
    dem, state = place
    leg = wave.legs[0]
    x, y = wave.stances[1].contacts[leg, :2]
    barred = Place(x + 0.06, y, 0.1, leg=(leg + 1) % 6 if others else leg)
    found = plan_wave(athlete, dem, state, GOAL, WIDE, WalkSettings(forbidden=(barred,)))
    if others:
        assert found.plan is not None
        return
    [blocked] = found.blocked
    assert (found.plan, blocked.move, blocked.leg, blocked.check_name) == (None, 0, leg, "forbidden place")
    assert blocked.lacks == pytest.approx(0.04)
    assert "0.04 m inside the forbidden place" in found.reason


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        (WalkSettings(support="required"), "`support`"),
        (WalkSettings(pinned=(Place(1.0, 0.0),)), "`pinned`"),
        (WalkSettings(payload_mass=20.0), "`payload_mass`"),
    ],
    ids=["support", "pinned", "payload"],
)
def test_what_no_gait_heeds_is_said_and_nothing_is_planned(athlete, place, settings, named):
    dem, state = place
    found = plan_wave(athlete, dem, state, GOAL, WIDE, settings)
    assert (found.plan, found.partial, found.blocked) == (None, None, ())
    assert named in found.reason


def test_a_foot_move_that_is_longer_than_one_may_be_refuses_it(athlete, place):
    """Its stride is not longer, but feet are put beside their ideal places."""
    dem, state = place
    found = plan_wave(athlete, dem, state, GOAL, WIDE, WalkSettings(longest=0.25))
    assert (found.status, found.plan) == (Status.NO_PATH, None)
    [blocked] = found.blocked
    assert (blocked.check_name, blocked.unit) == ("longest foot move", "m")
    assert blocked.lacks is not None
    assert 0.0 < blocked.lacks < 0.15
    assert "at most 0.25 m are allowed" in found.reason


def test_a_request_for_a_walk_in_a_gait_is_for_a_wave():
    asked = WalkRequest(GOAL, WalkSettings())
    assert replace(asked, gait=None).digest == asked.digest != replace(asked, gait=WIDE).digest
    with pytest.raises(InvalidInput, match="one foot at a time"):
        replace(asked, gait=GaitSettings(TRIPOD))


def test_a_rover_that_gives_way_carries_it_out_like_any_walk(athlete):
    """The first two foot moves, the pose held; feet end where the wave has them."""
    dem = wavy()
    standing = footfall.stand(athlete, dem)
    rover = CompliantRover(athlete, dem)
    rest = rover.let_down(standing.posture, standing.T_site_base)
    state = rover.state(rest)
    wave = plan_wave(athlete, dem, unpressed(athlete, state), GOAL, WIDE, WalkSettings()).plan
    assert wave is not None
    settings = ExecutionSettings(mode="pose_held")
    found = plan_walk_execution(athlete, dem, state, wave, settings, rest.commanded, count=2)
    assert found.status is Status.FOUND, found.reason
    assert all(check.holds for check in found.checks)
    assert found.execution is not None
    steps = [one.step for one in found.execution.moves if one.step is not None]
    assert [step.leg for step in steps] == list(wave.legs[:2])
    for step, stance in zip(steps, wave.stances[1:], strict=False):
        hubs = apply(step.Ts_site_base[-1], wheel_centers(athlete, step.predicted[-1]))
        np.testing.assert_allclose(hubs[step.leg], stance.Ts_site_wheel[step.leg, :3, 3], atol=0.06)
