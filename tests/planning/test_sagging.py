"""Joints that give way: rests are least energy and balance, and set points that hold a posture lead to it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

import footfall
from footfall.balance.balance_settings import GRAVITY
from footfall.core.errors import InvalidSequence
from footfall.core.frames import apply, rotation_rpy, transform
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.rolling import Stood, foot_turns, legs_rolled_to, ways_rolled
from footfall.planning.legged.sagging import STRIDE, SprungRest, gives_way_to, held_set_points
from footfall.planning.legged.stance import all_standing
from footfall.planning.legged.stand import stand
from footfall.planning.legged.step import plan_step
from footfall.planning.legged.whole_check import LIMIT_RESERVE, Feet
from footfall.robot.legged.posture import placed
from footfall.sequence.foot_moves import foot_moves
from footfall.terrain.generate import fractal, plane
from tests.support.described import robot_of, sprung

STIFF = 1500.0


@cache
def held(name: str | int, rough: float):
    """(robot, ground, stance, set points that hold it, the rest on them)."""
    robot = sprung(robot_of(name)[1], STIFF)
    dem = fractal(4.0, 0.05, roughness=rough, seed=4) if rough else plane(4.0, 0.05)
    state = stand(robot, dem)
    set_points = held_set_points(robot, state.q, state.T_site_base, all_standing(state))
    rest = SprungRest(state.q, state.q, state.T_site_base, np.zeros((len(robot.legs), 3)))
    return robot, dem, state, set_points, rest


def stood_of(state) -> Stood:
    return Stood(state.soles, state.contacts, state.normals)


@pytest.mark.parametrize("rough", [0.0, 0.02])
@pytest.mark.parametrize("name", [4, 6, "A1", "HyQ"])
def test_set_points_that_hold_a_stance_lead_back_to_it(name, rough):
    robot, dem, state, set_points, rest = held(name, rough)
    assert np.abs(set_points - state.q).max() > 1e-3, "they lead the joints"
    found = gives_way_to(robot, dem, set_points, rest, stood_of(state), list(robot.legs))
    assert found is not None
    there, _ = found
    np.testing.assert_allclose(there.q, state.q, atol=1e-6)
    np.testing.assert_allclose(there.T_site_base, state.T_site_base, atol=1e-6)


@given(st.integers(0, 2**32 - 1))
def test_a_rest_balances_weight_and_springs_and_its_feet_stay(seed):
    robot, dem, state, set_points, rest = held(6, 0.02)
    moved = set_points + np.random.default_rng(seed).uniform(-0.004, 0.004, len(set_points))
    found = gives_way_to(robot, dem, moved, rest, stood_of(state), list(robot.legs))
    assert found is not None
    there, stood = found
    weight = np.array([0.0, 0.0, robot.mass * GRAVITY])
    com = apply(there.T_site_base, placed(robot, there.q).com)
    soles = apply(there.T_site_base, placed(robot, there.q).soles)
    points = soles + stood.contacts - stood.soles
    np.testing.assert_allclose(there.forces.sum(axis=0), weight, atol=1e-4)
    np.testing.assert_allclose(np.cross(points - com, there.forces).sum(axis=0), 0.0, atol=1e-4)
    borne = there.forces.any(axis=1)
    np.testing.assert_allclose(soles[borne], stood.soles[borne], atol=1e-6)
    assert borne.sum() >= 3
    assert ((there.forces * stood.normals).sum(axis=1) >= -1e-4).all()


def test_a_rest_has_the_least_energy_of_all_poses_with_those_feet():
    """A second method: springs' and weight's energy, by a general minimiser over the chassis' pose with feet fixed."""
    robot, dem, state, set_points, rest = held("A1", 0.0)
    lower = set_points + np.tile([0.0, 0.01, -0.015], 4)
    there, _ = gives_way_to(robot, dem, lower, rest, stood_of(state), list(robot.legs)) or pytest.fail("nothing holds")
    turns = foot_turns(robot, placed(robot, state.q), state.T_site_base)

    def posture(pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        T = transform(rotation_rpy(*pose[3:]), pose[:3]) @ state.T_site_base
        q = state.q
        for _ in range(4):
            after = foot_turns(robot, placed(robot, q), T)
            soles = state.soles + ways_rolled(robot, state.normals, turns, after)
            q = np.concatenate(
                [
                    robot.limbs[leg].solve_from(
                        ((soles[leg] - T[:3, 3]) @ T[:3, :3])[None], state.q[None, robot.slices[leg]]
                    )[0]
                    for leg in robot.legs
                ]
            )
        return q, T

    def energy(pose: np.ndarray) -> float:
        q, T = posture(pose)
        height = apply(T, placed(robot, q).com)[2]
        return float((robot.stiffness * (q - lower) ** 2).sum() / 2 + robot.mass * GRAVITY * height)

    found = minimize(
        energy, np.zeros(6), method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-11, "maxiter": 6000}
    )
    q, T = posture(found.x)
    np.testing.assert_allclose(there.T_site_base[:3, 3], T[:3, 3], atol=2e-5)
    np.testing.assert_allclose(there.q, q, atol=2e-4)


def test_one_long_row_leads_where_many_short_ones_do():
    """By set points that hold another pose: a long row comes there too, but for how its feet rolled on the way."""
    robot, dem, state, set_points, rest = held(6, 0.0)
    legs = list(robot.legs)
    first = gives_way_to(robot, dem, set_points, rest, stood_of(state), legs)
    assert first is not None
    T = state.T_site_base @ transform(rotation_rpy(0.02, -0.05, 0.06), (0.04, 0.03, -0.02))
    q, stood = legs_rolled_to(robot, dem, state.q, state.T_site_base, T, stood_of(state))
    target = held_set_points(robot, q, T, Feet(legs, stood.contacts, stood.normals))
    assert np.abs(target - set_points).max() > 2 * STRIDE
    long = gives_way_to(robot, dem, target, *first, legs)
    assert long is not None
    np.testing.assert_allclose(long[0].T_site_base, T, atol=2e-3)
    short = first
    for share in np.arange(1, 21) / 20:
        short = gives_way_to(robot, dem, set_points + share * (target - set_points), *short, legs)
        assert short is not None
    np.testing.assert_allclose(long[0].T_site_base, short[0].T_site_base, atol=2e-4)


def test_softer_joints_let_the_chassis_sink_farther():
    sunk = []
    for stiffness in (4000.0, 2000.0, 1000.0):
        robot = sprung(robot_of("A1")[1], stiffness)
        dem = plane(4.0, 0.05)
        state = stand(robot, dem)
        rest = SprungRest(state.q, state.q, state.T_site_base, np.zeros((4, 3)))
        found = gives_way_to(robot, dem, state.q, rest, stood_of(state), list(robot.legs))
        assert found is not None
        sunk.append(float(state.T_site_base[2, 3] - found[0].T_site_base[2, 3]))
    assert 0 < sunk[0] < sunk[1] < sunk[2]
    assert sunk[1] == pytest.approx(2 * sunk[0], rel=0.1)


def test_a_foot_that_the_ground_would_have_to_pull_comes_off_and_two_hold_nothing():
    robot, dem, state, set_points, rest = held(6, 0.0)
    drawn_up = set_points.copy()
    own = robot.slices[2]
    drawn_up[own] += (0.0, -0.3, 0.0)
    found = gives_way_to(robot, dem, drawn_up, rest, stood_of(state), list(robot.legs))
    assert found is not None
    assert not found[0].forces[2].any()
    assert found[0].forces[[0, 1, 3, 4, 5], 2].min() > 0
    assert gives_way_to(robot, dem, set_points, rest, stood_of(state), [0, 3]) is None


@pytest.fixture(scope="module")
def step():
    """A step of a robot that sags: the robot, its ground, the plan and its commands."""
    robot = sprung(robot_of(4)[1], STIFF)
    dem = fractal(4.0, 0.1, roughness=0.02, seed=3)
    state = stand(robot, dem)
    result = plan_step(robot, dem, state, 1, tuple(state.soles[1, :2] + (0.05, 0.02)), LeggedSettings(time_limit=1e6))
    assert result.plan is not None, result.reason
    return robot, dem, result.plan, footfall.make_sequence(result.plan, robot, dem)


def test_commands_hold_the_chassis_where_the_plan_has_it(step):
    _, dem, plan, sequence = step
    assert sequence.valid, sequence.failures
    kinds = [(one.name, one.phase) for one in sequence.commands]
    assert kinds.count(("POSTURE_MOVE", "unload")) == 1
    assert kinds[-1] == ("POSTURE_MOVE", "load")
    assert [rows.leg for rows in foot_moves(sequence.commands)] == [1]
    np.testing.assert_allclose(sequence.poses[-1], plan.Ts_site_base[-1], atol=1e-4)
    np.testing.assert_allclose(sequence.predicted[-1], plan.waypoints[-1], atol=1e-3)
    assert sequence.at_rest is not None
    assert sequence.commanded is not None
    assert np.abs(sequence.commanded - sequence.predicted).max() > 1e-3
    # a rigid robot is commanded what was planned, row by row
    plain = footfall.make_sequence(plan, robot_of(4)[1], dem)
    assert plain.at_rest is None
    assert len(plain.commands) == len(sequence.commands) - 2


def test_commands_start_from_the_set_points_that_there_are(step):
    """Feet that lean against each other do so until the first row: its set points are those that hold the pose."""
    robot, dem, plan, sequence = step
    assert sequence.at_rest is not None
    leaning = sequence.at_rest.set_points + np.tile([0.0, 0.004, 0.0], 4)
    made = footfall.make_sequence(replace(plan, start=replace(plan.start, set_points=leaning)), robot, dem)
    assert made.valid, made.failures
    assert made.at_rest is not None
    np.testing.assert_array_equal(made.at_rest.set_points, leaning)
    np.testing.assert_array_equal(made.commanded, sequence.commanded)
    np.testing.assert_allclose(made.poses[-1], plan.Ts_site_base[-1], atol=1e-3)


def test_set_points_beyond_limits_and_efforts_of_springs_are_judged(step):
    robot, dem, plan, sequence = step
    upper = robot.upper.copy()
    row, own = np.unravel_index(np.argmax(sequence.commanded - sequence.predicted), sequence.predicted.shape)
    assert sequence.commanded[row, own] > sequence.predicted[row, own] + LIMIT_RESERVE
    tight = sprung(robot_of(4)[1], STIFF)
    upper[own] = sequence.predicted[row, own] + LIMIT_RESERVE  # the posture is inside, its set point is not
    tight.upper = upper
    failures = footfall.make_sequence(plan, tight, dem).failures
    assert any(one.rule == "joint-limits" and "the set point of" in one.text for one in failures), failures


def test_a_plan_that_nothing_holds_makes_no_commands(step):
    robot, dem, plan, _ = step
    poses = plan.Ts_site_base.copy()
    poses[-1] = poses[-1] @ transform(rotation_rpy(1.3, 0.0, 0.0))  # its feet on the ground as on a wall
    with pytest.raises(InvalidSequence, match="the plan can't be held: the feet on the ground"):
        footfall.make_sequence(replace(plan, Ts_site_base=poses), robot, dem)
