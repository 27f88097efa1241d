"""Robots that others described in physics: those of their URDFs, in balance, under a referee that sees faults."""

import json
from dataclasses import asdict, replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import footfall
from footfall.api.bodies.jsonable import dumps
from footfall.balance.balance_settings import GRAVITIES, GRAVITY
from footfall.balance.legged_effort import effort_ratio
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, quat_wxyz, rotation_rpy, transform
from footfall.io.urdf.read import read_urdf
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.stand import stand
from footfall.planning.legged.step import plan_step
from footfall.planning.legged.walk import THIN
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.sim.physics.legged_model import ARMATURE_TIME, SERVO_GIVE, TICK, assumed_stiffness, build_legged
from footfall.sim.physics.legged_referee import REST, LeggedBody, legged_referee
from footfall.sim.physics.legged_verdict import LeggedLimits
from footfall.sim.physics.physics_settings import PhysicsSettings
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane
from tests.support.described import robot_of, sprung
from tests.support.urdf import written
from tests.support.walkers import ring

LEG = 1
MOON = GRAVITIES["moon"]
T_SITE_BASE = transform(rotation_rpy(0.1, -0.2, 0.7), (0.3, -0.2, 1.0))


@pytest.fixture(scope="module")
def made():
    """Four legs on level ground, and the commands of one step."""
    _, robot = robot_of(4)
    dem = plane(4.0, 0.1)
    state = stand(robot, dem)
    # the weight well inside of the feet: physics rocks a robot that stands on the edge of its support
    settings = LeggedSettings(time_limit=1e6, least_margin=0.1)
    result = plan_step(robot, dem, state, LEG, tuple(state.soles[LEG, :2] + (0.05, 0.02)), settings)
    assert result.plan is not None, result.reason
    return robot, dem, footfall.make_sequence(result.plan, robot, dem)


@pytest.fixture(scope="module", params=[4, "A1"])
def at_rest(request):
    """A robot that came to rest on rough ground, and what touches what then."""
    _, robot = robot_of(request.param)
    dem = fractal(3.0, 0.05, roughness=0.02, seed=2)
    state = stand(robot, dem)
    body = LeggedBody(robot, dem, state.q, state.T_site_base)
    for _ in range(round(2 * REST / TICK)):
        touching = body.tick()
    return robot, body, touching


@pytest.mark.parametrize("name", [4, "A1"])
def test_masses_and_inertias_are_those_that_pin_reads_from_the_urdf(name):
    """The joint-space inertia of the floating robot, from MuJoCo and by pin's own reader of the file."""
    path, robot = robot_of(name)
    physics = build_legged(robot, plane(2.0, 0.1), PhysicsSettings())
    data, model = mujoco.MjData(physics.model), pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    own = [model.joints[model.getJointId(joint)].idx_q for joint in robot.joint_names]
    rates = [model.joints[model.getJointId(joint)].idx_v for joint in robot.joint_names]
    rng = np.random.default_rng(3)
    for _ in range(3):
        q = rng.uniform(robot.lower, robot.upper)
        quat = quat_wxyz(T_SITE_BASE[:3, :3])
        data.qpos[:3], data.qpos[3:7], data.qpos[physics.joints] = T_SITE_BASE[:3, 3], quat, q
        mujoco.mj_forward(physics.model, data)
        full = pin.neutral(model)
        full[:3], full[3:7], full[own] = T_SITE_BASE[:3, 3], np.roll(quat, -1), q
        whole = pin.crba(model, model.createData(), full)
        whole = np.triu(whole) + np.triu(whole, 1).T
        inertia = np.zeros((physics.model.nv, physics.model.nv))
        mujoco.mj_fullM(physics.model, data, inertia)
        # pin tells the base's velocity in the base, MuJoCo its linear part in the site
        turn = np.eye(physics.model.nv)
        turn[:3, :3] = T_SITE_BASE[:3, :3].T
        order = [*range(6), *rates]
        expected = turn.T @ whole[np.ix_(order, order)] @ turn
        found = inertia[np.ix_([*range(6), *physics.speeds], [*range(6), *physics.speeds])]
        motors = np.concatenate([np.zeros(6), ARMATURE_TIME**2 * physics.stiffness])
        np.testing.assert_allclose(found - np.diag(motors), expected, atol=1e-6)
        where = placed(robot, q)
        np.testing.assert_allclose(data.geom_xpos[physics.soles], apply(T_SITE_BASE, where.soles), atol=1e-9)


@pytest.mark.parametrize(("old", "name"), [("base", "world"), ("l1_coxa", "sole"), ("l1_yaw", "free")])
def test_any_names_of_links_and_joints_can_be_simulated(old, name, tmp_path):
    path = written(tmp_path, ring(4).replace(f'"{old}"', f'"{name}"'))
    robot = LeggedRobot(legged_model(read_urdf(path)))
    assert name in (*robot.body_names, *robot.joint_names)
    named, plain = (
        build_legged(one, plane(2.0, 0.1), PhysicsSettings()).model.body_mass for one in (robot, robot_of(4)[1])
    )
    np.testing.assert_array_equal(named, plain)


def test_what_no_urdf_says_is_told():
    _, robot = robot_of("A1")
    physics = build_legged(robot, plane(2.0, 0.1), PhysicsSettings(stiffness_scale=2.0))
    np.testing.assert_allclose(physics.stiffness * SERVO_GIVE, 2.0 * robot.efforts)
    assert any(f"gives {SERVO_GIVE:g} rad" in text for text in physics.assumed)
    _, solo = robot_of("Solo-12")
    told = " ".join(build_legged(solo, plane(2.0, 0.1), PhysicsSettings()).assumed)
    assert "balls stand for discs" in told


def test_hulls_that_overlap_as_built_press_on_nothing():
    """Solo's thighs lie beside its trunk, and in the trunk's hull; its efforts of 1000 N·m are no motor's."""
    _, solo = robot_of("Solo-12")
    dem = plane(2.0, 0.1)
    state = stand(solo, dem)
    body = LeggedBody(solo, dem, state.q, state.T_site_base)
    assert any("hulls that overlap" in text and "base_link" in text for text in body.physics.assumed)
    for _ in range(20):
        touching = body.tick()
        assert (body.legs_on_ground(touching) >= 0).all(), [body.named(*pair) for pair in touching.geoms]
    np.testing.assert_allclose(body.physics.stiffness * SERVO_GIVE, solo.mass * GRAVITY * solo.length)
    assert "hulls that overlap" not in " ".join(build_legged(robot_of(4)[1], dem, PhysicsSettings()).assumed)


def test_forces_on_the_feet_balance_the_weight(at_rest):
    robot, body, touching = at_rest
    legs = body.legs_on_ground(touching)
    assert set(legs.tolist()) == set(robot.legs)
    upward = np.where((touching.forces[:, 2] > 0)[:, None], touching.forces, -touching.forces)
    com = apply(body.T_site_base, placed(robot, body.posture).com)
    weight = robot.mass * GRAVITY
    np.testing.assert_allclose(upward.sum(axis=0), (0.0, 0.0, weight), atol=2e-3 * weight)
    moments = np.cross(touching.points - com, upward).sum(axis=0)
    np.testing.assert_allclose(moments, 0.0, atol=2e-3 * weight * robot.length)


def test_the_motors_bear_no_less_than_the_best_forces_ask_for(at_rest):
    """The planner's linear program takes the best of all forces; physics has those that its springs make."""
    robot, body, touching = at_rest
    legs = body.legs_on_ground(touching)
    contacts, normals = np.zeros((len(robot.legs), 3)), np.zeros((len(robot.legs), 3))
    for leg in robot.legs:
        mine = np.flatnonzero(legs == leg)
        pushes = np.abs((touching.forces[mine] * touching.normals[mine]).sum(axis=1))
        contacts[leg] = pushes @ touching.points[mine] / pushes.sum()
        normal = touching.normals[mine[np.argmax(pushes)]]
        normals[leg] = normal * np.sign(normal[2])
    least = effort_ratio(robot, body.posture, body.T_site_base, tuple(robot.legs), contacts, normals)
    found = float((np.abs(body.data.actuator_force) / robot.efforts).max())
    assert 0 < least <= found * 1.02
    # and what a motor bears strains its joint as was assumed
    strain = body.commanded - body.posture
    np.testing.assert_allclose(
        body.physics.stiffness * strain, body.data.actuator_force, atol=2e-2 * robot.efforts.max()
    )


def test_a_planned_step_is_carried_out(made):
    robot, dem, sequence = made
    found = legged_referee(robot, sequence, dem)
    assert found.passed, found.failures
    assert found.commands == len(sequence.commands)
    assert 0 < found.effort < 1
    assert found.touch[LEG] < 0.02
    assert np.isnan(np.delete(found.touch, LEG)).all()
    assert 0 < found.settled <= found.sink < 0.02
    told = json.loads(dumps(asdict(found)))
    assert told["slip"] == pytest.approx(found.slip.tolist())
    assert told["assumed"] == list(found.assumed)


def test_commands_that_hold_the_pose_put_the_foot_where_it_was_planned(made):
    robot, dem, rigid = made
    soft = sprung(robot, assumed_stiffness(robot))
    state = stand(soft, dem)
    settings = LeggedSettings(time_limit=1e6, least_margin=0.1)
    result = plan_step(soft, dem, state, LEG, tuple(state.soles[LEG, :2] + (0.05, 0.02)), settings)
    assert result.plan is not None, result.reason
    held = legged_referee(soft, footfall.make_sequence(result.plan, soft, dem), dem)
    assert held.passed, held.failures
    as_planned = legged_referee(robot, rigid, dem)
    assert held.touch[LEG] < 5e-4
    assert held.touch[LEG] < as_planned.touch[LEG] / 2
    assert abs(held.settled) < abs(as_planned.settled) / 2, "it stands where it is to from the start"
    assert not any("whole effort" in one for one in held.assumed)
    assert any("whole effort" in one for one in as_planned.assumed)


def test_the_default_margin_keeps_feet_on_the_ground_that_a_thin_one_takes_off():
    _, robot = robot_of("A1")
    dem = plane(2.0, 0.05)
    state, leg = stand(robot, dem), robot.leg_names.index("RR")
    usual = LeggedSettings(time_limit=1e6)
    found = []
    for settings in (usual, replace(usual, least_margin=THIN)):
        result = plan_step(robot, dem, state, leg, tuple(state.soles[leg, :2] + (0.04, 0.0)), settings)
        assert result.plan is not None, result.reason
        found.append(legged_referee(robot, footfall.make_sequence(result.plan, robot, dem), dem))
    kept, thin = found
    assert kept.passed, kept.failures
    assert thin.air.max() > LeggedLimits().air > 2 * kept.air.max()
    assert any("which stands, was off the ground" in text for text in thin.failures)


def test_on_the_moon_the_same_step_strains_the_joints_less(made):
    robot, dem, sequence = made
    earth, moon = (
        legged_referee(robot, sequence, dem, PhysicsSettings(gravity=gravity)) for gravity in (GRAVITY, MOON)
    )
    assert moon.passed, moon.failures
    assert moon.settled == pytest.approx(earth.settled * MOON / GRAVITY, rel=0.1)
    assert moon.effort < earth.effort


def test_without_the_chassis_over_the_feet_it_does_not_hold(made):
    robot, dem, sequence = made
    legs = tuple(command for command in sequence.commands if command.leg is not None)
    rows = [row for row, command in enumerate(sequence.commands) if command.leg is not None]
    # the leg goes from the posture before the shift: its joints are moved by as much as planned
    before = sequence.predicted[rows[0] - 1][robot.slices[LEG]] - sequence.start[robot.slices[LEG]]
    commands = tuple(replace(one, joints=one.joints - before) for one in legs)
    predicted = np.tile(sequence.start, (len(legs), 1))
    predicted[:, robot.slices[LEG]] = [one.joints for one in commands]
    poses = np.tile(sequence.T_site_base, (len(legs), 1, 1))
    unshifted = replace(sequence, commands=commands, predicted=predicted, Ts_site_base=poses, rules=())
    found = legged_referee(robot, unshifted, dem)
    assert not found.passed
    assert found.tipped or (found.air > 0.1).any() or found.stayed, found.failures


def test_ground_that_the_plan_did_not_know_is_touched(made):
    robot, dem, sequence = made
    heights = np.array(dem.heights)
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    # a post under the drum, higher than its lower side
    heights[np.hypot(x, y) < 0.08] = sequence.T_site_base[2, 3] - 0.03
    other = from_heights(heights, 0.1, dem.geometry.x0, dem.geometry.y0)
    found = legged_referee(robot, sequence, other)
    assert any("the ground" in what and "base" in what for what, _, _ in found.contacts), found.failures
    assert any("touched with" in text for text in found.failures)


def test_joints_that_give_way_let_it_fall(made):
    """A hundredth of the stiffness does not carry the robot through the step."""
    robot, dem, sequence = made
    found = legged_referee(robot, sequence, dem, PhysicsSettings(stiffness_scale=0.01))
    assert "it tipped" in found.tipped
    assert found.commands < len(sequence.commands)
    assert found.sink > 0.1 * robot.length
    assert any("below where the plan has it" in text for text in found.failures), found.failures


def test_commands_of_another_robot_are_refused(made):
    _, dem, sequence = made
    with pytest.raises(InvalidInput, match="the sequence is for ring"):
        legged_referee(robot_of("A1")[1], sequence, dem)
