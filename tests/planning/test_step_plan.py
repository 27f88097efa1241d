"""One step of the real rover: found plans are good by a second look, refusals say why."""

import itertools
import re
from functools import partial

import numpy as np
import pytest

from footfall.core.errors import Cancelled, InvalidInput
from footfall.core.value import flatten, unflatten
from footfall.planning.answers import No, Status
from footfall.planning.body.stand import stand
from footfall.planning.scene.ground import Nearby, footfall_contact, nearby
from footfall.planning.scene.leg_over_ground import LegOverGround
from footfall.planning.scene.lift import raised_poses, vertical
from footfall.planning.scene.solids import LegAlongPath, part_poses
from footfall.planning.step import start as start_module
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.situation import Situation
from footfall.planning.step.start import start_objection
from footfall.planning.step.target import candidates
from footfall.planning.step.verify import recheck
from footfall.robot.description import PARTS, link_name
from footfall.robot.ik import contact_point, solve_leg
from footfall.robot.kinematics import link_poses, wheel_pose
from footfall.robot.meshes.collision import CollisionScene, posture_collisions
from footfall.robot.meshes.depth import overlap
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import crop
from tests.support.chassis_ground import wavy, with_posture
from tests.support.wheel_depth import require_depth

NAMES = ("line", "fast", "astar", "sbl", "rrtconnect")
ground = partial(wavy, half=4.0, resolution=0.05)
OPEN_TARGET = (2.05, 0.45)
ROCK_TARGET = (1.95, 0.55)


@pytest.fixture(scope="module")
def open_ground(athlete):
    dem = ground()
    return dem, stand(athlete, dem)


@pytest.fixture(scope="module")
def rocky(athlete):
    dem = ground([(2.15, 0.33, 0.12, 0.4)])
    return dem, stand(athlete, dem)


@pytest.fixture(scope="module")
def rock_plan(athlete, rocky):
    dem, state = rocky
    return plan_step(athlete, dem, state, 0, ROCK_TARGET, seed=1)


def around_leg_0(dem):
    whole = nearby(dem, np.array([1.2, 0.0]), 2.9, np.zeros((0, 3)))
    assert isinstance(whole, Nearby)
    return whole


def moved(state, leg, q):
    posture = np.array(state.posture)
    posture[6 * leg : 6 * leg + 6] = q
    return with_posture(state, posture)


def assert_good(robot, dem, state, leg, target, result):
    """Every law of a plan, by means that planning does not use."""
    assert result.status is Status.FOUND, result.reason
    assert result.plan is not None
    plan, q = result.plan, result.plan.waypoints
    own = slice(6 * leg, 6 * leg + 6)
    assert np.array_equal(q[0], state.posture)
    others = np.delete(q, np.arange(36)[own], axis=1)
    assert (others == others[0]).all()
    assert (q >= robot.lower).all()
    assert (q <= robot.upper).all()
    assert len(plan.phases) == len(q)
    assert [name for name, _ in itertools.groupby(plan.phases)] == ["lift", "swing", "lower"]
    # where it lands
    expected = (*target, height_at(dem, *target))
    assert np.allclose(plan.contact, expected, atol=1e-12)
    assert np.allclose(contact_point(robot, q[-1], leg, state.T_site_base, plan.normal), expected, atol=1e-9)
    # lift and lower: straight, 0.2 m
    up = np.linalg.inv(state.T_site_base)[:3, 2]
    tops = {"lift": plan.phases.index("swing") - 1, "lower": plan.phases.index("lower") - 1}
    for phase, foot in (("lift", 0), ("lower", -1)):
        bottom = wheel_pose(robot, q[foot], leg)
        assert np.allclose(wheel_pose(robot, q[tops[phase]], leg)[:3, 3], bottom[:3, 3] + 0.2 * up, atol=1e-9)
        for i in range(1, len(q)):
            if plan.phases[i] == phase:
                for t in (0.25, 0.5, 0.75):
                    away = wheel_pose(robot, q[i - 1] + t * (q[i] - q[i - 1]), leg)[:3, 3] - bottom[:3, 3]
                    assert np.linalg.norm(away - (away @ up) * up) < 0.002
    # no collision of the whole rover on the true ground
    near = crop(dem, (0, 0), 5.0)
    for i in range(0, len(q) - 1, 3):
        middle = 0.5 * (q[i] + q[i + 1])
        assert posture_collisions(robot, middle, state.T_site_base, near) == []
    assert all(check.holds for check in result.checks)
    assert all(np.isnan(check.margin) or check.margin >= 0 for check in result.checks)


@pytest.mark.parametrize("name", NAMES)
def test_every_planner_steps_on_open_ground(athlete, open_ground, name):
    dem, state = open_ground
    result = plan_step(athlete, dem, state, 0, OPEN_TARGET, planner=name, seed=2)
    assert_good(athlete, dem, state, 0, OPEN_TARGET, result)
    assert result.plan is not None
    assert result.plan.planner == name
    assert isinstance(result.provenance.settings, StepSettings)
    assert result.provenance.settings.seed == result.provenance.seed == 2


@pytest.mark.parametrize("name", NAMES[1:])
def test_the_searching_planners_step_over_a_rock(athlete, rocky, name):
    dem, state = rocky
    assert_good(athlete, dem, state, 0, ROCK_TARGET, plan_step(athlete, dem, state, 0, ROCK_TARGET, name, seed=1))


def test_the_line_meets_the_rock_and_says_where_and_by_how_much(athlete, rocky):
    dem, state = rocky
    result = plan_step(athlete, dem, state, 0, ROCK_TARGET, "line")
    assert result.status is Status.NO_PATH
    assert "blocked after" in result.reason
    assert "raised by 0.15 m" in result.reason
    assert "m is needed" in result.reason or "must stay clear" in result.reason


def test_auto_goes_on_to_the_next_planner(rock_plan):
    assert rock_plan.plan.planner == "fast"


def test_the_swing_keeps_above_the_raised_rock(athlete, rocky, rock_plan):
    dem, state = rocky
    own = slice(0, 6)
    plan = rock_plan.plan
    swing = [i for i, phase in enumerate(plan.phases) if phase == "swing"]
    for i in swing:
        for t in np.linspace(0, 1, 9):
            q = plan.waypoints[i - 1] + t * (plan.waypoints[i] - plan.waypoints[i - 1])
            center = (state.T_site_base @ wheel_pose(athlete, q, 0))[:3, 3]
            clear = center[2] - athlete.wheel_radius - float(height_at(dem, center[0], center[1]))
            assert clear > 0.15, q[own]


def test_same_arguments_same_plan_and_it_survives_a_file(athlete, rocky, rock_plan):
    dem, state = rocky
    again = plan_step(athlete, dem, state, 0, ROCK_TARGET, seed=1)
    assert again.digest == rock_plan.digest
    assert unflatten(*flatten(again)).digest == again.digest
    assert rock_plan.plan.parents == {"dem": dem.digest, "state": state.digest, "robot": athlete.digest}


def test_legs_are_alike_under_rotation(athlete, open_ground):
    dem, state = open_ground
    for leg in (2, 5):
        turn = leg * np.pi / 3
        target = (
            np.cos(turn) * OPEN_TARGET[0] - np.sin(turn) * OPEN_TARGET[1],
            np.sin(turn) * OPEN_TARGET[0] + np.cos(turn) * OPEN_TARGET[1],
        )
        assert_good(athlete, dem, state, leg, target, plan_step(athlete, dem, state, leg, target))


# --- refusals -------------------------------------------------------------------------------------------------------


def test_off_the_map(athlete, open_ground):
    dem, state = open_ground
    result = plan_step(athlete, dem, state, 0, (4.5, 0.0))
    assert result.status is Status.OFF_MAP
    assert "0.5 m off the map" in result.reason


def test_too_far(athlete, open_ground):
    dem, state = open_ground
    result = plan_step(athlete, dem, state, 0, (3.7, 0.0))
    assert result.status is Status.GOAL_INVALID
    assert "farther than the" in result.reason


def test_onto_the_other_leg(athlete, open_ground):
    dem, state = open_ground
    far = np.array(state.leg(1))
    far[0] = -0.9
    turned = moved(state, 1, far)
    other = contact_point(athlete, turned.posture, 1, state.T_site_base)
    result = plan_step(athlete, dem, turned, 0, (other[0] + 0.05, other[1] - 0.2))
    assert result.status is Status.GOAL_INVALID
    assert "leg1" in result.reason


def test_unknown_ground_is_refused(athlete, open_ground):
    _, state = open_ground
    result = plan_step(athlete, ground(hole=(2.05, 0.7, 0.1)), state, 0, (2.05, 0.5))
    assert result.status is Status.UNKNOWN_GROUND
    assert "unknown" in result.reason


def test_unknown_ground_under_the_swing_is_told(athlete, open_ground):
    _, state = open_ground
    dem = ground(hole=(1.7, 0.2, 0.1))
    result = plan_step(athlete, dem, state, 0, OPEN_TARGET)
    assert result.status is Status.FOUND
    told = next(check for check in result.checks if check.name.startswith("unknown ground"))
    assert "cells" in told.where


@pytest.mark.parametrize("turned", [{1: 0.2}, {1: 0.35}, {1: 0.3, 2: 0.3}])
def test_a_start_in_collision_names_the_deepest_pair_and_the_depth(athlete, open_ground, turned):
    """Turned by more, the foot is too near to the ground as well; the wheel is still what is worst."""
    dem, state = open_ground
    q = np.array(state.leg(0))
    for joint, by in turned.items():
        q[joint] += by
    result = plan_step(athlete, dem, moved(state, 0, q), 0, OPEN_TARGET)
    assert result.status is Status.START_INVALID
    told = re.search(r"leg0_wheel cuts (\d\.\d{3}) m into terrain \(0\.030 m is allowed\)", result.reason)
    assert told, result.reason
    require_depth(float(told[1]), athlete, dem, moved(state, 0, q).posture, state.T_site_base, 0)


def towards_each_other(state, turned):
    """Hips of legs 2 and 3 turned so far towards each other [rad]."""
    posture = np.array(state.posture)
    posture[12] += turned
    posture[18] -= turned
    return with_posture(state, posture)


@pytest.mark.parametrize("turned", [0.926, 0.95, 1.0])
def test_standing_legs_that_cut_each_other_are_no_start(athlete, open_ground, turned):
    dem, state = open_ground
    wrong = towards_each_other(state, turned)
    assert any(hit.distance == 0 for hit in posture_collisions(athlete, wrong.posture, wrong.T_site_base))
    result = plan_step(athlete, dem, wrong, 0, OPEN_TARGET)
    assert result.status is Status.START_INVALID
    told = re.search(r"(leg2_\w+) cuts up to (\d\.\d{3}) m into (leg3_\w+)", result.reason)
    assert told, result.reason
    assert "correct the encoders" in result.reason
    assert float(told[2]) == pytest.approx(overlap(athlete, wrong.posture, told[1], told[3]), abs=0.0006)


def test_a_posture_is_looked_at_once_for_all_steps_from_it(athlete, open_ground, monkeypatch):
    dem, state = open_ground
    asked = []

    def counted(robot, posture, T_site_base):
        asked.append(posture)
        return posture_collisions(robot, posture, T_site_base)

    monkeypatch.setattr(start_module, "posture_collisions", counted)
    now = towards_each_other(state, 0.0123)
    for leg in (0, 1, 4):
        assert start_objection(athlete, dem, now, leg) == ""
        assert start_objection(athlete, dem, now, leg) == ""
    assert len(asked) == 1


def test_standing_legs_that_are_only_near_each_other_are_a_start(athlete, open_ground):
    dem, state = open_ground
    near = towards_each_other(state, 0.9)
    hits = posture_collisions(athlete, near.posture, near.T_site_base)
    assert hits
    assert min(hit.distance for hit in hits) > 0
    assert "cuts" not in start_objection(athlete, dem, near, 0)


def test_a_start_outside_the_limits_names_the_joint(athlete, open_ground):
    dem, state = open_ground
    q = np.array(state.leg(0))
    q[3] = 3.0
    result = plan_step(athlete, dem, moved(state, 0, q), 0, OPEN_TARGET)
    assert result.status is Status.START_INVALID
    assert "leg0_knee_roll_joint" in result.reason


def test_balance_is_asked_of_the_feet_that_stay(athlete, open_ground):
    dem, state = open_ground
    result = plan_step(athlete, dem, state, 0, OPEN_TARGET, settings=StepSettings(least_margin=3.0))
    assert result.status is Status.START_INVALID
    assert "support polygon" in result.reason


def test_smooth_ground_without_friction_holds_but_a_slope_does_not(athlete):
    x = np.arange(-4, 4.01, 0.1)
    slope = from_heights((0.25 * np.meshgrid(x, x)[0]).astype(np.float32), 0.1, -4, -4, "slope")
    state = stand(athlete, slope)
    leg, target = 1, tuple(contact_point(athlete, state.posture, 1, state.T_site_base)[:2] - (0.1, 0.2))
    result = plan_step(athlete, slope, state, leg, target, settings=StepSettings(friction=0.05))
    assert result.status is Status.START_INVALID
    assert "friction" in result.reason
    assert [check.name for check in result.checks if not check.holds] == ["torque"]


def test_no_time_is_a_status(athlete, open_ground):
    dem, state = open_ground
    result = plan_step(athlete, dem, state, 0, OPEN_TARGET, settings=StepSettings(time_limit=1e-6))
    assert result.status is Status.TIME_LIMIT
    assert result.plan is None


def test_cancel_is_heard_soon(athlete, rocky):
    dem, state = rocky
    calls = []

    def progress(fraction, text):
        calls.append(fraction)
        if len(calls) > 6:
            raise Cancelled("stop")

    with pytest.raises(Cancelled):
        plan_step(athlete, dem, state, 0, ROCK_TARGET, progress=progress)
    assert calls == sorted(calls)


def test_misuse_raises(athlete, open_ground):
    dem, state = open_ground
    for leg, target in ((6, OPEN_TARGET), (0, (np.nan, 0.0)), (0, (1.0, 2.0, 3.0))):
        with pytest.raises(InvalidInput):
            plan_step(athlete, dem, state, leg, target)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput):
        plan_step(athlete, dem, state, 0, OPEN_TARGET, planner="teleport")


# --- parts ----------------------------------------------------------------------------------------------------------


def test_the_recheck_finds_what_the_planner_would_not_do(athlete, rocky, rock_plan):
    """A path dragged through the rock, one through the ground and one that jumps its limits all fail."""
    dem, state = rocky
    whole = around_leg_0(dem)
    situation = Situation(athlete, dem, state, 0, whole, StepSettings())
    q, phases = rock_plan.plan.waypoints, rock_plan.plan.phases
    first, last = phases.index("swing") - 1, phases.index("lower") - 1

    def failed(waypoints, its_phases):
        return {check.name.split(",")[0] for check in recheck(situation, dem, waypoints, its_phases) if not check.holds}

    assert failed(q, phases) == set()
    straight = np.concatenate([q[: first + 1], q[last:]])
    assert "terrain collision in swing" in failed(straight, (*phases[: first + 1], "swing", *phases[last + 1 :]))
    deep = q.copy()
    deep[first + 1 : last, 1] += 0.5
    assert "terrain collision in swing" in failed(deep, phases)
    beyond = q.copy()
    beyond[first - 1, 0] = 3.0
    assert {"joint limits", "straight lift and lower"} <= failed(beyond, phases)


def test_the_recheck_kinematics_equal_pin(athlete, rng):
    qs = rng.uniform(athlete.lower, athlete.upper, (20, 36))
    for leg in (0, 4):
        poses = part_poses(athlete, leg, qs[:, 6 * leg : 6 * leg + 6])
        for i, q in enumerate(qs):
            expected = link_poses(athlete, q)
            for part in PARTS:
                assert np.allclose(poses[part][i], expected[link_name(leg, part)], atol=1e-12)


def test_scene_and_recheck_agree_about_single_postures(athlete, rocky, rng):
    """Two implementations of the same clearances: no posture may be free for one and blocked for the other."""
    dem, state = rocky
    whole = around_leg_0(dem)
    situation = Situation(athlete, dem, state, 0, whole, StepSettings())
    solids = LegAlongPath(athlete, np.asarray(state.posture), 0, 0.0)
    over_ground = LegOverGround(athlete, 0, np.asarray(state.T_site_base), whole, 0.0)
    scene = CollisionScene(athlete, state.posture, 0, state.T_site_base, whole.mesh, 0.0, 0.15)
    base = np.array(state.leg(0))
    disagreements = blocked = 0
    for q in base + rng.normal(0, 0.5, (250, 6)):
        q = np.clip(q, situation.lower, situation.upper)
        for terrain, lift in (("true", 0.0), ("raised", 0.15)):
            own = solids.own_collision(q[None]) or over_ground.collision(q[None], lift, terrain == "true")
            mine = scene.collides(q, terrain)
            blocked += mine
            disagreements += mine != (own is not None)
    assert 50 < blocked < 450
    assert disagreements == 0


def test_the_centre_of_mass_of_the_situation_is_that_of_kinematics(athlete, open_ground, rng):
    from footfall.balance.support import margin
    from footfall.core.frames import apply
    from footfall.robot.kinematics import center_of_mass

    dem, state = open_ground
    whole = around_leg_0(dem)
    situation = Situation(athlete, dem, state, 0, whole, StepSettings())
    for q in state.leg(0) + rng.normal(0, 0.3, (5, 6)):
        com = apply(state.T_site_base, center_of_mass(athlete, situation.posture(q)))
        assert situation.margin(q) == pytest.approx(margin(situation.footing.feet.points, com[:2]), abs=1e-9)


def test_a_lift_passes_the_straight_wrist_without_a_jump(athlete, open_ground):
    """The shank gets vertical on the way: the branch id changes, the joints don't jump."""
    _, state = open_ground
    contact = footfall_contact(athlete, open_ground[0], *OPEN_TARGET)
    assert not isinstance(contact, No)
    T_site_base, q_start = np.asarray(state.T_site_base), np.array(state.leg(0))
    possible = candidates(athlete, 0, contact, T_site_base, q_start, 0)
    upright = next(one for one in possible if one.branch == 0 and one.lean == 0)
    leaning = next(one for one in possible if one.branch in (0, 1) and one.lean > 0)
    assert isinstance(vertical(athlete, 0, T_site_base, upright.q, 0.2), str)
    up = vertical(athlete, 0, T_site_base, leaning.q, 0.2)
    assert not isinstance(up, str)
    assert up[0, 4] * up[-1, 4] < 0
    assert np.abs(np.diff(up, axis=0)).max() < 0.2
    heights = np.linspace(0, 0.2, len(up))
    Ts = raised_poses(T_site_base, wheel_pose(athlete, moved(state, 0, leaning.q).posture, 0), heights)
    assert np.nanmin(np.abs(solve_leg(athlete, 0, Ts).q - up[:, None]).max(axis=2), axis=1).max() < 1e-9


def test_a_leaning_wheel_touches_the_same_point_and_leans_into_the_plane(athlete, open_ground):
    dem, state = open_ground
    contact = footfall_contact(athlete, dem, 2.05, 0.45)
    assert not isinstance(contact, No)
    possible = candidates(athlete, 0, contact, np.asarray(state.T_site_base), np.array(state.leg(0)), 0)
    assert {one.lean > 0 for one in possible} == {True, False}
    for one in possible:
        posture = moved(state, 0, one.q).posture
        assert np.allclose(
            contact_point(athlete, posture, 0, state.T_site_base, contact.normal), contact.point, atol=1e-6
        )
        if one.lean > 0:
            roll = abs(one.q[3]) % np.pi
            assert min(roll, np.pi - roll) < 1e-5


def test_a_lift_beyond_reach_says_where_it_ends(athlete, open_ground):
    _, state = open_ground
    found = vertical(athlete, 0, np.asarray(state.T_site_base), np.array(state.leg(0)), 3.0)
    assert isinstance(found, str)
    assert "m above it" in found


def test_holes_are_as_high_as_their_highest_neighbour():
    dem = ground([(0.5, 0.0, 0.2, 0.5)], hole=(0.9, 0.0, 0.35))
    whole = nearby(dem, np.array([0.9, 0.0]), 0.8, np.zeros((0, 3)))
    assert isinstance(whole, Nearby)
    assert np.isfinite(whole.dem.heights).all()
    seen = ~whole.filled
    grid = whole.dem.geometry
    rows, cols = dem.geometry.cell(*np.meshgrid(grid.xs, grid.ys))
    assert np.array_equal(whole.dem.heights[seen], dem.heights[rows, cols][seen])
    # beside the rock's cut flank the hole is as high as what is seen of the rock
    flank = float(np.nanmax(dem.heights[rows, cols]))
    assert whole.dem.heights[whole.filled].max() <= flank
    assert float(height_at(whole.dem, 0.62, 0.0)) > 0.2


def test_ground_beyond_the_map_is_not_free():
    dem = ground(half=1.0)
    whole = nearby(dem, np.array([1.0, 0.0]), 0.5, np.zeros((0, 3)))
    assert isinstance(whole, Nearby)
    assert np.isfinite(height_at(whole.dem, 1.4, 0.0))
    assert whole.filled.any()
    assert isinstance(nearby(dem, np.array([50.0, 0.0]), 0.5, np.zeros((0, 3))), No)


def test_a_standing_wheel_tells_the_height_of_unseen_ground():
    dem = ground(hole=(0.0, 0.0, 0.4))
    whole = nearby(dem, np.zeros(2), 0.8, np.array([[0.0, 0.0, -0.2]]))
    assert isinstance(whole, Nearby)
    assert float(height_at(whole.dem, 0.0, 0.0)) == pytest.approx(-0.2)
