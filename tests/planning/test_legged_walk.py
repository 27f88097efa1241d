"""Robots that others described stand, step and walk; every plan is judged by means it was not made with."""

from copy import copy
from dataclasses import replace
from functools import cache
from itertools import count
from pathlib import Path
from tempfile import mkdtemp
from types import SimpleNamespace

import numpy as np
import pytest

from footfall.balance.support import margin
from footfall.core.errors import InvalidInput, InvalidRobot
from footfall.core.frames import apply
from footfall.io.urdf.read import read_urdf
from footfall.planning.answers import Status
from footfall.planning.any_robot import plan_step, plan_walk, stand
from footfall.planning.legged.at_ease import at_ease
from footfall.planning.legged.foot_move import LEAP
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.step import tally_in_words
from footfall.planning.legged.walk import BACK, THIN
from footfall.planning.legged.whole_check import Refusal, Tally
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane, slope
from footfall.terrain.ground.surface import height_at
from tests.support.described import robot_of
from tests.support.legged_recheck import Recheck, faults
from tests.support.walkers import ring

REAL = ["A1", "Go2", "HyQ", "ANYmal B", "Solo-12"]
UNHURRIED = LeggedSettings(time_limit=1e6)
EVERY = 30


@cache
def ground_for(name: str | int, kind: str) -> Dem:
    length = robot_of(name)[1].length
    size = round(8 * length, 1)
    made = {
        "smooth": lambda: plane(size, 0.05),
        "rough": lambda: fractal(size, 0.05, roughness=0.05 * length, seed=1),
        "slope": lambda: slope(size, 0.05, 0.2, 0.7),
    }
    return made[kind]()


def judged(name: str | int, dem: Dem, plan) -> list[str]:
    path, robot = robot_of(name)
    return faults(Recheck(path, robot, list(path.parents[2:5])).walk(dem, plan, EVERY))


@pytest.mark.parametrize("name", [3, 4, 6, 8, (4, 5), (6, 7), *REAL])
def test_a_stance_at_ease_leaves_every_foot_its_stroke(name):
    _, robot = robot_of(name)
    ease = at_ease(robot)
    assert ease.stroke >= 0.06 * robot.length - 1e-9
    ways = ease.stroke * np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)], float)
    for leg in robot.legs:
        near = np.repeat(ease.q[None, robot.slices[leg]], 4, axis=0)
        there = robot.limbs[leg].solve_from(ease.soles[leg] + ways, near)
        assert np.isfinite(there).all()
    assert (ease.q > robot.lower).all()
    assert (ease.q < robot.upper).all()


def test_a_posture_named_stand_is_the_stance_at_ease():
    model = robot_of(6)[1].model
    names, q = robot_of(6)[1].joint_names, at_ease(robot_of(6)[1]).q.copy()
    q[2::3] += 0.1
    own = LeggedRobot(model, {"stand": dict(zip(names, q, strict=True))})
    np.testing.assert_array_equal(at_ease(own).q, q)
    np.testing.assert_allclose(stand(own, ground_for(6, "smooth")).q, q, atol=1e-6)
    q[3:6] = 0.0, 0.0, 0.3  # a leg that is stretched out
    with pytest.raises(InvalidRobot, match="in its posture 'stand' the foot of leg 1 does not get"):
        at_ease(LeggedRobot(model, {"stand": dict(zip(names, q, strict=True))}))


def test_a_posture_named_stand_outside_its_limits_is_told_by_its_joint():
    """It was said that a foot does not get far enough, which no other height or place would have cured."""
    names, q = robot_of(6)[1].joint_names, at_ease(robot_of(6)[1]).q.copy()
    q[5] = 0.0  # a knee that bends from 0.3 rad on
    with pytest.raises(InvalidRobot, match=r"its posture 'stand' has l1_knee at 0, outside of 0\.3 … 2\.6"):
        at_ease(LeggedRobot(robot_of(6)[1].model, {"stand": dict(zip(names, q, strict=True))}))


def test_a_clearance_of_zero_is_told_as_such():
    """It was said that bodies touch, which are far apart."""
    with pytest.raises(InvalidRobot, match=r"have a clearance of 0 in the robot\.toml"):
        at_ease(LeggedRobot(robot_of(6)[1].model, None, {"other_leg": 0.0}))


@pytest.mark.parametrize("kind", ["smooth", "rough", "slope"])
@pytest.mark.parametrize("name", [3, 6, "A1", "HyQ"])
def test_who_stands_has_all_feet_on_the_ground_and_the_weight_over_them(name, kind):
    path, robot = robot_of(name)
    dem = ground_for(name, kind)
    state = stand(robot, dem, 0.1, -0.1, 0.6)
    other = Recheck(path, robot, list(path.parents[2:5]))
    soles = other.soles_at(state.q, state.T_site_base)
    np.testing.assert_allclose(soles, state.soles, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(soles - state.contacts, axis=1), robot.radii, atol=1e-6)
    share = other.least_share(state.q, state.T_site_base, list(robot.legs), state.contacts, state.normals)
    assert share <= 0.9 + 1e-6
    assert np.hypot(*(state.T_site_base[:2, 3] - (0.1, -0.1))) < 0.2 * robot.length


@pytest.mark.parametrize("name", [4, 5, 6, (4, 5), (6, 7), "A1", "Go2", "HyQ", "ANYmal B"])
def test_a_walk_holds_before_judges_of_its_own(name):
    _, robot = robot_of(name)
    dem = ground_for(name, "rough")
    goal = 0.5 * robot.length, 0.05 * robot.length
    result = plan_walk(robot, dem, stand(robot, dem), goal, UNHURRIED)
    assert result.status is Status.FOUND, result.reason
    assert result.plan is not None
    assert np.hypot(*(result.plan.end.T_site_base[:2, 3] - goal)) <= 0.15
    assert len(result.plan.moves) >= len(robot.legs)
    assert judged(name, dem, result.plan) == []


@pytest.fixture(scope="module")
def short_walk():
    _, robot = robot_of(6)
    dem = ground_for(6, "smooth")
    state = stand(robot, dem)
    result = plan_walk(robot, dem, state, (0.15, 0.0, 0.3), UNHURRIED)
    assert result.plan is not None, result.reason
    return robot, dem, state, result


def test_a_walk_ends_where_and_as_it_was_asked_to(short_walk):
    robot, _dem, _, result = short_walk
    plan = result.plan
    np.testing.assert_allclose(plan.end.T_site_base[:2, 3], (0.15, 0.0), atol=0.02)
    assert np.arctan2(plan.end.T_site_base[1, 0], plan.end.T_site_base[0, 0]) == pytest.approx(0.3, abs=1e-6)
    homes = apply(plan.end.T_site_base, at_ease(robot).soles)
    assert np.linalg.norm(plan.end.soles - homes, axis=1).max() < 0.15 * robot.length


def test_waypoints_are_without_gaps_and_in_the_order_of_a_foot_move(short_walk):
    _robot, _, state, result = short_walk
    plan = result.plan
    assert np.abs(np.diff(plan.waypoints, axis=0)).max() <= LEAP
    np.testing.assert_array_equal(plan.waypoints[0], state.q)
    legs = [leg for k, leg in enumerate(plan.legs) if leg >= 0 and (k == 0 or plan.legs[k - 1] != leg)]
    assert tuple(legs) == plan.moves
    order = {
        "body": {"body", "lift"},
        "lift": {"lift", "swing"},
        "swing": {"swing", "lower"},
        "lower": {"lower", "body", "lift"},
    }
    for one, other in zip(plan.phases, plan.phases[1:], strict=False):
        assert other in order[one]


def test_the_same_request_gives_the_same_walk(short_walk):
    robot, dem, state, result = short_walk
    assert plan_walk(robot, dem, state, (0.15, 0.0, 0.3), UNHURRIED).digest == result.digest


def test_the_judge_sees_a_foot_that_is_dragged_and_a_body_that_sinks(short_walk):
    _, dem, _, result = short_walk
    plan = result.plan
    dragged = plan.waypoints.copy()
    dragged[len(dragged) // 2 :, 1] += 0.02
    assert any("drifts" in fault for fault in judged(6, dem, replace(plan, waypoints=dragged)))
    sunk = plan.Ts_site_base.copy()
    sunk[:, 2, 3] -= 0.3
    told = judged(6, dem, replace(plan, Ts_site_base=sunk))
    assert any("meets the ground" in fault for fault in told)
    shifted = plan.Ts_site_base.copy()
    shifted[:, 0, 3] += 0.5
    assert any("outside the feet" in fault for fault in judged(6, dem, replace(plan, Ts_site_base=shifted)))


def test_the_judge_weighs_every_waypoint(short_walk):
    """Its margin is the least that the planner's own polygon has at any waypoint, however seldom forces are asked."""
    robot, dem, _, result = short_walk
    plan, path = result.plan, robot_of(6)[0]
    found = Recheck(path, robot, []).walk(dem, plan, len(plan.waypoints))
    spares = []
    for k, leg in enumerate(plan.legs):
        where = placed(robot, plan.waypoints[k])
        contacts = apply(plan.Ts_site_base[k], where.soles) - [0.0, 0.0, robot.radii[0]]  # on level ground
        center = apply(plan.Ts_site_base[k], where.com)
        spares.append(margin(contacts[[one for one in robot.legs if one != leg]], center[:2]))
    assert found.margin == pytest.approx(min(spares), abs=1e-4)
    assert min(spares[::EVERY]) > found.margin + 1e-3, "every so many would have missed it"


def test_a_step_goes_where_it_was_asked_to_and_other_feet_only_roll():
    _, robot = robot_of("A1")
    dem = ground_for("A1", "smooth")
    state = stand(robot, dem)
    target = state.soles[1, :2] + (0.05, 0.0)
    result = plan_step(robot, dem, state, 1, tuple(target), settings=UNHURRIED)
    assert result.plan is not None, result.reason
    np.testing.assert_allclose(result.plan.end.soles[1, :2], target, atol=1e-6)
    rolled = np.delete(result.plan.end.soles - state.soles, 1, axis=0)
    np.testing.assert_array_equal(rolled[:, 2], 0.0)
    assert 0 < np.linalg.norm(rolled, axis=1).max() < robot.radii[0] / 2
    assert judged("A1", dem, result.plan) == []


def beside_limit(excess):
    """A robot that stands with one joint past its limit by ``excess`` [rad], its ground, and that joint."""
    _, robot = robot_of("A1")
    dem = ground_for("A1", "smooth")
    state = stand(robot, dem)
    joint = robot.slices[1].stop - 1
    limited, q = copy(robot), state.q[joint]
    limited.upper = robot.upper.copy()
    limited.upper[joint] = q - excess
    return limited, dem, state, joint


@pytest.mark.parametrize("excess", [1e-9, -1e-9, 5e-4])
def test_a_joint_measured_past_its_limit_by_rounding_is_led_back_inside(excess):
    robot, dem, state, joint = beside_limit(excess)
    result = plan_step(robot, dem, state, 0, tuple(state.soles[0, :2] + (0.03, 0.0)), settings=UNHURRIED)
    assert result.plan is not None, result.reason
    assert (result.plan.waypoints[:, joint] < robot.upper[joint]).all()
    assert abs(result.plan.waypoints[0, joint] - state.q[joint]) <= 2e-3
    assert result.provenance.parents["state"] == state.digest


def test_a_joint_farther_past_its_limit_is_no_start():
    robot, dem, state, joint = beside_limit(0.01)
    for result in (
        plan_step(robot, dem, state, 0, tuple(state.soles[0, :2]), settings=UNHURRIED),
        plan_walk(robot, dem, state, (0.2, 0.0), UNHURRIED),
    ):
        assert result.status is Status.START_INVALID
        assert result.reason == f"it can't begin: limits -0.011, {robot.joint_names[joint]}"


def test_three_legs_stand_but_cannot_lift_one():
    _, robot = robot_of(3)
    dem = ground_for(3, "smooth")
    result = plan_walk(robot, dem, stand(robot, dem), (0.2, 0.0), UNHURRIED)
    assert result.status is Status.NO_PATH
    assert "no pose of the chassis keeps the weight over the other feet" in result.reason
    assert result.reason.endswith("none is found either")
    thin = plan_walk(robot, dem, stand(robot, dem), (0.2, 0.0), replace(UNHURRIED, least_margin=THIN))
    assert "none is found either" not in thin.reason, "nothing thinner was tried"


def test_a_walk_that_a_margin_forbids_tells_whether_a_thin_one_allows_it():
    _, robot = robot_of(4)
    dem, goal = ground_for(4, "smooth"), (0.02, 0.0)
    state, wide = stand(robot, dem), replace(UNHURRIED, least_margin=0.3)
    result = plan_walk(robot, dem, state, goal, wide)
    assert result.status is Status.NO_PATH
    thin, asked = f"{THIN * robot.length:.3f} m (2% of the longest leg)", f"{0.3 * robot.length:.3f} m"
    assert f"; with a margin of {thin} in place of {asked} a walk is found, in which feet" in result.reason
    assert result.provenance.settings == wide
    assert plan_walk(robot, dem, state, goal, replace(wide, least_margin=THIN)).status is Status.FOUND


def test_a_dead_end_is_left_by_foot_moves_taken_back(monkeypatch):
    """So much margin leaves the chassis so few places that the first choice of foot moves leads nowhere."""
    _, robot = robot_of(4)
    dem, goal = ground_for(4, "smooth"), (0.4, 0.0)
    state, wide = stand(robot, dem), replace(UNHURRIED, least_margin=0.194)
    result = plan_walk(robot, dem, state, goal, wide)
    assert result.plan is not None, result.reason
    assert judged(4, dem, result.plan) == []
    monkeypatch.setattr("footfall.planning.legged.walk.BACK", 0)
    ended = plan_walk(robot, dem, state, goal, wide)
    assert ended.status is Status.NO_PATH
    assert "m from the goal, no foot can go on" in ended.reason
    assert "other ways" not in ended.reason
    assert ended.partial is not None
    assert 0 < len(ended.partial.moves) < len(result.plan.moves)


def test_time_that_runs_out_behind_a_dead_end_tells_how_far_the_walk_came(monkeypatch):
    _, robot = robot_of(4)
    dem, clock = ground_for(4, "smooth"), count()
    # the clock goes on by 1 s for each foot move: after ten there is a dead end, and one of them is taken back
    for module in ("legged.walk", "watch"):
        monkeypatch.setattr(f"footfall.planning.{module}.time", SimpleNamespace(monotonic=lambda: float(next(clock))))
    late = LeggedSettings(time_limit=11.5, least_margin=0.194)
    result = plan_walk(robot, dem, stand(robot, dem), (0.4, 0.0), late)
    assert result.status is Status.TIME_LIMIT
    assert result.reason.startswith("no walk within 11.5 s; after 10 foot moves")
    assert result.partial is not None
    assert len(result.partial.moves) == 10


def test_what_refuses_is_named_with_its_size():
    _, robot = robot_of(6)
    flat = ground_for(6, "smooth")
    state = stand(robot, flat)
    far = plan_walk(robot, flat, state, (50.0, 0.0), UNHURRIED)
    east = flat.geometry.bounds[2]
    assert far.status is Status.OFF_MAP
    assert far.reason.startswith(f"the goal (50.00, 0.00) m lies {50 - east:.2g} m off the map; the map spans x ")
    off = plan_step(robot, flat, state, 0, (50.0, 0.0), settings=UNHURRIED)
    assert off.status is Status.OFF_MAP
    assert off.reason == far.reason.replace("the goal", "the footfall")
    out = plan_step(robot, flat, state, 0, (float(state.soles[0, 0]) + 0.6, 0.0), settings=UNHURRIED)
    assert out.status is Status.NO_PATH
    assert "limits refused" in out.reason
    heights = np.array(flat.heights)
    east = flat.geometry.x0 + 0.05 * np.arange(flat.geometry.cols)
    heights[:] = np.maximum(3 * (east - 0.45), 0.0)
    bank = from_heights(heights, 0.05, flat.geometry.x0, flat.geometry.y0)
    stopped = plan_walk(robot, bank, state, (1.2, 0.0), UNHURRIED)
    assert stopped.status is Status.NO_PATH
    assert "m from the goal, no foot can go on" in stopped.reason
    assert "footfall refused" in stopped.reason
    assert f"; {BACK} other ways, from up to {BACK} foot moves before, lead no farther" in stopped.reason
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        plan_step(robot, flat, state, 6, (0.0, 0.0))
    with pytest.raises(InvalidInput, match="a goal needs x and y"):
        plan_walk(robot, flat, state, (1.0,))
    with pytest.raises(InvalidInput, match="the state is one of ring"):
        plan_walk(robot_of("A1")[1], flat, state, (0.1, 0.0))


def test_tries_are_told_by_the_nearest_one_and_where_it_was():
    tally = Tally()
    tally.refuse(Refusal("limits", float("nan"), "leg a does not reach"))
    assert tally_in_words(tally) == "limits refused 1 tries (leg a does not reach)"
    for margin_left, where in ((-0.2, "knee"), (-0.1, "hip"), (float("nan"), "leg b does not reach")):
        tally.refuse(Refusal("limits", margin_left, where))
    assert tally_in_words(tally) == "limits refused 4 tries (at best -0.1: hip)"


def test_unknown_ground_is_neither_stood_on_nor_stepped_on():
    _, robot = robot_of(6)
    level = ground_for(6, "smooth")
    heights = np.array(level.heights)
    heights[:, heights.shape[1] // 2 + 12 :] = np.nan  # from x = 0.6 m on
    dem = from_heights(heights, 0.05, level.geometry.x0, level.geometry.y0)
    state = stand(robot, dem)
    told = plan_step(robot, dem, state, 0, (0.65, 0.1), settings=UNHURRIED)
    assert told.status is Status.UNKNOWN_GROUND
    assert plan_walk(robot, dem, state, (0.8, 0.0), UNHURRIED).status is Status.UNKNOWN_GROUND
    with pytest.raises(InvalidInput, match="no ground is known"):
        stand(robot, dem, 1.0, 0.0)


def test_motors_that_are_too_weak_do_not_stand():
    path = Path(mkdtemp()) / "robot.urdf"
    path.write_text(ring(6, effort=1.5), encoding="utf-8")
    weak = LeggedRobot(legged_model(read_urdf(path)))
    with pytest.raises(InvalidInput, match="effort -"):
        stand(weak, plane(4.0, 0.05))


def test_a_state_in_the_air_is_no_start():
    _, robot = robot_of(6)
    dem = ground_for(6, "smooth")
    state = stand(robot, dem)
    lower = state.T_site_base.copy()
    lower[2, 3] -= 0.35
    result = plan_walk(robot, dem, replace(state, T_site_base=lower), (0.2, 0.0), UNHURRIED)
    assert result.status is Status.START_INVALID
    assert result.reason.startswith("it can't begin: feet -")


def test_a_walk_over_rough_ground_keeps_every_swing_above_it():
    _, robot = robot_of(4)
    dem = ground_for(4, "rough")
    result = plan_walk(robot, dem, stand(robot, dem), (0.2, 0.0), UNHURRIED)
    assert result.plan is not None, result.reason
    plan = result.plan
    for k in range(len(plan.legs)):
        leg = int(plan.legs[k])
        if plan.phases[k] == "swing":
            center = apply(plan.Ts_site_base[k], placed(robot, plan.waypoints[k]).soles[leg])
            ground = float(height_at(dem, *center[:2]))
            assert center[2] - robot.radii[leg] - ground >= 0.05 * robot.length
