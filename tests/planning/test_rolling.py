"""Feet that stand roll as balls do: by arcs that a second method measures, on the ground that is there."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from footfall.core.frames import transform
from footfall.planning.answers import Status
from footfall.planning.legged.foot_move import ChassisWay, chassis_way
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.rolling import Stood, foot_turns, legs_rolled_to, rested, ways_rolled
from footfall.planning.legged.stance import Ground
from footfall.planning.legged.stand import stand
from footfall.planning.legged.walk import plan_walk
from footfall.planning.legged.whole_check import Refusal, Tally
from footfall.robot.legged.posture import placed
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import plane, slope
from tests.support.described import robot_of

UP = np.array([0.0, 0.0, 1.0])


def turned(angle: float, axis: np.ndarray) -> np.ndarray:
    return Rotation.from_rotvec(angle * axis).as_matrix()


@given(st.floats(-0.3, 0.3), st.floats(-np.pi, np.pi))
def test_a_ball_that_tips_goes_by_its_arc_and_one_that_spins_stays(angle, heading):
    _, robot = robot_of(4)
    normals, still = np.tile(UP, (4, 1)), np.tile(np.eye(3), (4, 1, 1))
    axis = np.array([np.cos(heading), np.sin(heading), 0.0])
    ahead = np.cross(axis, UP)
    tipped = np.tile(turned(angle, axis), (4, 1, 1))
    np.testing.assert_allclose(
        ways_rolled(robot, normals, still, tipped), angle * robot.radii[:, None] * ahead, atol=1e-12
    )
    spun = np.tile(turned(angle, UP), (4, 1, 1))
    np.testing.assert_allclose(ways_rolled(robot, normals, still, spun), 0.0, atol=1e-12)


def test_points_stay_where_they_are():
    from footfall.io.any_robot import load_legged

    ambler = load_legged("ambler")
    dem = plane(20.0, 0.2)
    state = stand(ambler, dem)
    stood = Stood(state.soles, state.contacts, state.normals)
    T = transform(translation=(0.1, 0.05, 0.0)) @ state.T_site_base
    _, now = legs_rolled_to(ambler, dem, state.q, state.T_site_base, T, stood)
    assert now is stood


@pytest.mark.parametrize("kind", ["level", "slope"])
def test_a_foot_comes_down_again_a_leg_s_turn_farther_on(kind):
    """By material points: what touched lies, seen from the centre, where the ball's turn has brought it."""
    _, robot = robot_of("A1")
    dem = plane(4.0, 0.05) if kind == "level" else slope(4.0, 0.05, 0.15, 0.4)
    state = stand(robot, dem)
    ground = Ground(robot, dem, LeggedSettings())
    T = transform(translation=(0.03, 0.0, 0.0)) @ state.T_site_base
    way = chassis_way(ground, state, T, Tally())
    assert isinstance(way, ChassisWay)
    rolled = np.zeros_like(state.soles)
    for one, other in zip(way.samples, way.samples[1:], strict=False):
        before, after = (foot_turns(robot, placed(robot, at.q), at.T_site_base) for at in (one, other))
        for leg in robot.legs:
            arm = -robot.radii[leg] * state.normals[leg]
            rolled[leg] += arm - after[leg] @ before[leg].T @ arm
    np.testing.assert_allclose((way.end.soles - state.soles)[:, :2], rolled[:, :2], atol=5e-6)
    np.testing.assert_allclose((way.end.soles - state.soles)[:, 2], rolled[:, 2], atol=5e-5)  # on chords, not on arcs
    assert np.linalg.norm(rolled, axis=1).min() > 1e-3, "they rolled"
    # they are where the legs have them, and on the ground
    soles = placed(robot, way.end.q).soles @ T[:3, :3].T + T[:3, 3]
    np.testing.assert_allclose(soles, way.end.soles, atol=1e-9)
    off = ((way.end.soles - way.end.contacts) ** 2).sum(axis=1) ** 0.5
    np.testing.assert_allclose(off, robot.radii, atol=2e-4)


def test_feet_that_would_roll_onto_unknown_ground_refuse_the_way():
    _, robot = robot_of("A1")
    dem = plane(2.4, 0.005)
    state = stand(robot, dem)
    heights = dem.heights.copy()
    geometry = dem.geometry
    front = int(np.argmax(state.soles[:, 0]))
    x, y = np.meshgrid(geometry.xs, geometry.ys)
    heights[(np.abs(y - state.soles[front, 1]) < 0.1) & (x > state.soles[front, 0] + 0.026)] = np.nan
    hole = from_heights(heights, geometry.resolution, geometry.x0, geometry.y0, "hole")
    assert np.isfinite(rested(robot, hole, _stood(state), state.soles, robot.legs).soles).all()
    T = transform(translation=(0.12, 0.0, 0.0)) @ state.T_site_base
    free = LeggedSettings(least_margin=0.0)
    found = chassis_way(Ground(robot, hole, free), state, T, Tally())
    assert isinstance(found, Refusal)
    assert found.name == "foot"
    assert "rolls onto unknown ground" in found.where
    beyond = state.soles + np.array([0.02, 0.0, 0.0])
    rolled = rested(robot, hole, _stood(state), beyond, robot.legs)
    assert np.isnan(rolled.soles[front]).all()
    assert np.isfinite(np.delete(rolled.soles, front, axis=0)).any()


def _stood(state) -> Stood:
    return Stood(state.soles, state.contacts, state.normals)


def test_a_walk_begins_each_stance_where_the_last_one_rolled_to():
    _, robot = robot_of(4)
    dem: Dem = plane(6.0, 0.05)
    result = plan_walk(robot, dem, stand(robot, dem), (0.3, 0.0), LeggedSettings(time_limit=1e6))
    assert result.status is Status.FOUND
    plan = result.plan
    assert plan is not None
    soles = placed(robot, plan.waypoints[-1]).soles
    T = plan.Ts_site_base[-1]
    np.testing.assert_allclose(soles @ T[:3, :3].T + T[:3, 3], plan.end.soles, atol=1e-9)
