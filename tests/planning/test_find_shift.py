"""The smallest shift of the chassis for a footfall: answers hold by other means, refusals say what is short."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import footfall
from footfall.balance.support import margin
from footfall.core.errors import Cancelled, InvalidInput
from footfall.io.artifacts import decode, encode
from footfall.maps.standing import contacts
from footfall.planning.answers import Status
from footfall.planning.body.body_move import plan_body_move
from footfall.planning.body.body_shift import BodyShift, PredictedState
from footfall.planning.body.find_problem import FindShiftSettings
from footfall.planning.body.find_shift import find_shift
from footfall.planning.body.shift import shifted_state
from footfall.planning.body.shift_search import search
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import StepSettings
from footfall.robot.ik import solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import center_of_mass
from footfall.terrain.ground.surface import height_at, normal_at
from tests.support.chassis_ground import lifted, wavy

OUT_OF_REACH = ((0, (2.6, 0.1)), (2, (-1.6, 2.1)), (4, (-1.2, -2.3)))


@pytest.fixture(scope="module")
def scene(athlete):
    dem = wavy([(3.2, 2.2, 0.25, 0.3)])
    return dem, footfall.stand(athlete, dem)


def reached(robot, dem, T_site_base, leg, target):
    """Whether some heading of an upright wheel on the target is inside all limits."""
    x, y = target
    contact = np.array([x, y, float(height_at(dem, x, y))])
    normal = normal_at(dem, x, y, robot.wheel_radius)
    headings = np.linspace(-np.pi, np.pi, 73)
    return solve_leg(robot, leg, wheel_pose_for_contact(robot, contact, normal, headings, T_site_base)).valid.any()


def shift_of(result):
    """The answer's shift; the test fails with the reason where there is none."""
    assert result.status is Status.FOUND, result.reason
    assert result.shift is not None
    return result.shift


@pytest.mark.parametrize(("leg", "target"), OUT_OF_REACH)
def test_a_footfall_out_of_reach_comes_within_reach(athlete, scene, leg, target):
    dem, state = scene
    assert not reached(athlete, dem, state.T_site_base, leg, target)
    result = find_shift(athlete, dem, state, leg, target)
    shift = shift_of(result)
    assert result.plan is not None
    there = shifted_state(athlete, dem, state, shift)
    assert isinstance(there, PredictedState)
    assert np.array_equal(result.plan.waypoints[-1], there.posture)
    assert result.plan.parents["state"] == state.digest
    assert all(check.holds for check in result.checks)
    assert reached(athlete, dem, there.T_site_base, leg, target)
    # the other feet carry it: hull of their contacts, by qhull
    others = [i for i in athlete.legs if i != leg]
    feet = contacts(athlete, dem, state.posture, state.T_site_base, others).points
    com = there.T_site_base[:3, :3] @ center_of_mass(athlete, there.posture) + there.T_site_base[:3, 3]
    assert (ConvexHull(feet[:, :2]).equations @ (*com[:2], 1.0)).max() < 0
    # the step planner, asked anew, finds the step; as the rover stands it refuses
    assert plan_step(athlete, dem, there, leg, target, seed=1).status is Status.FOUND
    assert plan_step(athlete, dem, state, leg, target, seed=1).status is Status.GOAL_INVALID
    # not far more than is needed
    half = shifted_state(athlete, dem, state, BodyShift(*(0.5 * shift.vector)))
    assert not isinstance(half, PredictedState) or not reached(athlete, dem, half.T_site_base, leg, target)
    vector, lever = shift.vector, FindShiftSettings().lever
    assert result.cost == pytest.approx(np.linalg.norm(vector * (1, 1, 1, lever, lever, lever)))


def test_a_footfall_that_is_fine_needs_no_shift(athlete, scene):
    dem, state = scene
    result = find_shift(athlete, dem, state, 0, (2.1, 0.3))
    assert not shift_of(result).vector.any()
    assert result.plan is None
    assert result.cost == 0.0
    assert "no shift is needed" in result.reason
    assert plan_step(athlete, dem, state, 0, (2.1, 0.3), seed=1).status is Status.FOUND


def test_the_loss_of_another_leg_is_paid_for_by_a_shift(athlete, scene):
    dem, state = scene
    wanted = FindShiftSettings(conservative=True, least_margin=0.05)
    step = StepSettings(conservative=True, least_margin=0.05, seed=1)
    assert plan_step(athlete, dem, state, 1, (1.1, 1.6), settings=step).status is Status.START_INVALID
    result = find_shift(athlete, dem, state, 1, (1.1, 1.6), wanted)
    there = shifted_state(athlete, dem, state, shift_of(result))
    assert isinstance(there, PredictedState)
    others = [0, 2, 3, 4, 5]
    feet = contacts(athlete, dem, state.posture, state.T_site_base, others).points
    com = there.T_site_base[:3, :3] @ center_of_mass(athlete, there.posture) + there.T_site_base[:3, 3]
    for lost in range(5):
        assert margin(np.delete(feet, lost, axis=0), com[:2]) >= 0.05
    assert plan_step(athlete, dem, there, 1, (1.1, 1.6), settings=step).status is Status.FOUND


def test_the_same_question_has_the_same_answer(athlete, scene):
    dem, state = scene
    leg, target = OUT_OF_REACH[0]
    first, again = (find_shift(athlete, dem, state, leg, target) for _ in range(2))
    assert first.digest == again.digest
    assert decode(encode(first)).digest == first.digest


def test_too_far_says_what_is_short_and_by_how_much(athlete, scene):
    dem, state = scene
    result = find_shift(athlete, dem, state, 0, (3.6, 0.0))
    assert result.status is Status.NO_PATH
    assert result.shift is None
    assert "out of reach" in result.reason
    assert "leg" in result.reason
    result = find_shift(athlete, dem, state, 0, (-4.2, 0.0), FindShiftSettings(most_shift=0.1))
    assert result.status is Status.GOAL_INVALID
    assert "reaches no farther than" in result.reason


def test_ground_that_no_wheel_can_stand_on_is_refused_at_once(athlete):
    dem = wavy([(2.85 + x, y, 0.12, 0.3) for x, y in ((0.2, 0), (-0.2, 0), (0, 0.2), (0, -0.2))], resolution=0.05)
    state = footfall.stand(athlete, dem)
    result = find_shift(athlete, dem, state, 0, (2.85, 0.0))
    assert result.status is Status.GOAL_INVALID
    assert "too rough" in result.reason


def test_the_chassis_shifts_past_a_rock_before_it(athlete):
    """A rock between two legs, as high as the chassis, stands where the smallest shift would lead."""
    target, free = (2.8, 0.1), wavy(resolution=0.05)
    state = shifted_state(athlete, free, footfall.stand(athlete, free), BodyShift(dz=-0.4))
    assert isinstance(state, PredictedState)
    shift = shift_of(find_shift(athlete, free, state, 0, target))
    top = float(state.T_site_base[2, 3] - 0.1)
    rocky = wavy([(1.4 * np.cos(np.pi / 6), 0.7, 0.12, top)], resolution=0.05)
    blocked = plan_body_move(athlete, rocky, state, shift)
    assert blocked.status is Status.GOAL_INVALID
    assert "base and the terrain" in blocked.reason
    result = find_shift(athlete, rocky, state, 0, target)
    around = shift_of(result)
    assert plan_body_move(athlete, rocky, state, around).status is Status.FOUND
    assert result.cost > np.linalg.norm(shift.vector)
    there = shifted_state(athlete, rocky, state, around)
    assert isinstance(there, PredictedState)
    assert plan_step(athlete, rocky, there, 0, target, seed=1).status not in (Status.START_INVALID, Status.GOAL_INVALID)


def test_what_cannot_be_asked_is_told(athlete, scene):
    dem, state = scene
    assert find_shift(athlete, dem, state, 0, (9.0, 0.0)).status is Status.OFF_MAP
    hole = wavy(hole=(2.6, 0.1, 0.4))
    assert find_shift(athlete, hole, state, 0, (2.6, 0.1)).status is Status.UNKNOWN_GROUND
    up = lifted(athlete, state, [3])
    result = find_shift(athlete, dem, up, 0, (2.6, 0.1))
    assert result.status is Status.START_INVALID
    assert "leg 3 is in the air" in result.reason
    # the leg that is to step may be in the air
    assert find_shift(athlete, dem, lifted(athlete, state, [0]), 0, (2.1, 0.3)).status is Status.FOUND


def test_senseless_questions_raise(athlete, scene):
    dem, state = scene
    with pytest.raises(InvalidInput, match="finite x and y"):
        find_shift(athlete, dem, state, 0, (np.nan, 0.0))
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        find_shift(athlete, dem, state, 6, (2.6, 0.1))
    with pytest.raises(InvalidInput, match="x and y"):
        find_shift(athlete, dem, state, 0, (2.6, 0.1, 0.0))  # pyright: ignore[reportArgumentType]
    for bad in ({"lever": 0.0}, {"most_shift": 3.0}, {"least_margin": -0.1}, {"friction": np.nan}):
        with pytest.raises(InvalidInput, match=next(iter(bad))):
            FindShiftSettings(**bad)  # pyright: ignore[reportArgumentType]


def test_the_caller_can_stop_it_and_time_can_run_out(athlete, scene):
    dem, state = scene
    leg, target = OUT_OF_REACH[0]

    def stop(fraction, text):
        if fraction >= 0.1:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        find_shift(athlete, dem, state, leg, target, progress=stop)
    result = find_shift(athlete, dem, state, leg, target, FindShiftSettings(time_limit=1e-6))
    assert result.status is Status.TIME_LIMIT


def test_the_search_finds_a_known_minimum():
    """The nearest point of a half-space to the origin, with one coordinate twice as dear."""
    normal = np.array([1.0, 0.5, 0.0, 0.3, 0.0, -0.4])
    scale = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    bounds = np.full(6, 1.0)
    ranked = search(lambda x: np.maximum(0.5 - x @ normal, 0.0), scale, bounds, np.zeros((1, 6)), lambda: None)
    least = 0.5 / np.linalg.norm(normal / scale)
    assert ranked.short[0] == 0.0
    assert least <= ranked.cost[0] <= 1.1 * least
    kept = ranked.alternatives(scale, 5)
    assert len(kept) == 5
    assert np.array_equal(kept[0], ranked.shifts[0])
