"""Legs with joints that follow others, as a pantograph's do: they stand, step and walk, and leaders bear for both."""

import re
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import footfall
from footfall.balance.balance_settings import GRAVITY
from footfall.balance.legged_effort import efforts_under
from footfall.core.errors import InvalidRobot
from footfall.core.frames import apply
from footfall.io.urdf.read import read_urdf
from footfall.planning.legged.at_ease import at_ease
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.stance import Ground, all_standing
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import chassis_pose, placed
from footfall.sequence.edit import Edit, apply_edit
from footfall.sim.physics.legged_model import build_legged
from footfall.sim.physics.legged_referee import legged_referee
from footfall.sim.physics.physics_settings import PhysicsSettings
from footfall.terrain.generate import fractal, plane
from tests.support.urdf import written
from tests.support.walkers import ring

RATIO, OFFSET, TOE = -0.3, 0.4, 0.5
FAR, FROM = -0.8, 0.9
"""An ankle goes with its knee, and the toe behind it with the ankle; knees turn from 0.3 to 2.6, ankles by ±0.7 rad.
FAR, FROM: by another rod an ankle is at its limit before the knee is."""
UNHURRIED = LeggedSettings(time_limit=1e6)
SAMPLES = 5


def pantograph(ratio: float = RATIO, offset: float = OFFSET, chained: bool = True) -> str:
    """chained: whether toes follow ankles, else what ankles follow, to the same angle: pin reads no others."""
    toe = (
        ("ankle", f'multiplier="{TOE}"') if chained else ("knee", f'multiplier="{TOE * ratio}" offset="{TOE * offset}"')
    )
    text = ring(4, joints=7)
    for name in ("thigh_roll", "shank_roll"):
        text = re.sub(rf'(<joint name="l\d_{name}" type=)"revolute"', r'\1"fixed"', text)
    for leg in range(4):
        for name, leader, rod in (
            (f"l{leg}_ankle", f"l{leg}_knee", f'multiplier="{ratio}" offset="{offset}"'),
            (f"l{leg}_toe", f"l{leg}_{toe[0]}", toe[1]),
        ):
            head, tail = text.split(f'<joint name="{name}"')
            text = f'{head}<joint name="{name}"' + tail.replace(
                "</joint>", f'<mimic joint="{leader}" {rod}/></joint>', 1
            )
    return text


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = written(tmp_path_factory.mktemp("pantograph"), pantograph())
    return path, LeggedRobot(legged_model(read_urdf(path)))


@pytest.fixture(scope="module")
def walked(made):
    robot = made[1]
    dem = fractal(3.0, 0.02, roughness=0.005, seed=1)
    state = footfall.stand(robot, dem)
    return dem, state, footfall.plan_walk(robot, dem, state, (0.2, 0.0), UNHURRIED)


def postures(robot: LeggedRobot) -> np.ndarray:
    rng = np.random.default_rng(3)
    return robot.coupling.followed(rng.uniform(robot.lower, robot.upper, (SAMPLES, len(robot.lower))))


def knee_ankle_toe(robot: LeggedRobot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    def of(part: str) -> np.ndarray:
        return q[..., [robot.joint_names.index(f"l{leg}_{part}") for leg in robot.legs]]

    return of("knee"), of("ankle"), of("toe")


def test_feet_and_mass_are_where_pinocchio_has_them_of_the_leaders_alone(made, tmp_path):
    robot = made[1]
    model = pin.buildModelFromUrdf(str(written(tmp_path, pantograph(chained=False))), mimic=True)
    data = model.createData()
    assert model.nq == len(robot.joint_names) - 8
    for q in postures(robot):
        by_themselves = pin.neutral(model)
        for name, angle in zip(robot.joint_names, q, strict=True):
            if "ankle" not in name and "toe" not in name:
                by_themselves[model.joints[model.getJointId(name)].idx_q] = angle
        pin.framesForwardKinematics(model, data, by_themselves)
        where = placed(robot, q)
        feet = [data.oMf[model.getFrameId(f"l{leg}_foot")].translation for leg in robot.legs]
        np.testing.assert_allclose(where.soles, feet, atol=1e-9)


def test_joints_go_no_farther_than_their_followers_may(tmp_path):
    robot = LeggedRobot(legged_model(read_urdf(written(tmp_path, pantograph(FAR, FROM)))))
    knee, ankle, toe = knee_ankle_toe(robot, np.stack([robot.lower, robot.upper]))
    np.testing.assert_allclose(knee.T, np.tile([0.3, 2.0], (4, 1)), atol=1e-12)
    np.testing.assert_allclose(ankle.T, np.tile([-0.7, 0.66], (4, 1)), atol=1e-12)
    np.testing.assert_allclose(toe, TOE * ankle, atol=1e-12)


def test_a_solved_leg_is_at_its_place_with_its_followers(made):
    robot = made[1]
    for q in postures(robot):
        sole = placed(robot, q).soles[1]
        found = robot.limbs[1].solve(sole[None])
        each = found.q[0][np.isfinite(found.left[0])]
        assert len(each)
        np.testing.assert_allclose(robot.limbs[1].feet(each)[:, :3, 3], np.tile(sole, (len(each), 1)), atol=1e-9)
        np.testing.assert_allclose(each, robot.coupling.part(robot.slices[1]).followed(each), atol=1e-9)
        assert ((each >= robot.lower[robot.slices[1]] - 1e-8) & (each <= robot.upper[robot.slices[1]] + 1e-8)).all()


def test_leaders_bear_what_virtual_work_asks_of_them(made):
    """The energy of the weight, less the work of the ground's forces, changes with a joint by its effort."""
    robot = made[1]
    rng = np.random.default_rng(5)
    T, step = chassis_pose(0.1, 0.2, 0.4, 0.7, (0.1, -0.05, 1.0)), 1e-5
    free = np.flatnonzero(robot.coupling.free)
    for q in postures(robot):
        forces, contacts = rng.normal(size=(4, 3)), apply(T, placed(robot, q).soles)

        def energy(posture: np.ndarray, forces: np.ndarray = forces) -> float:
            where = placed(robot, posture)
            return robot.mass * GRAVITY * apply(T, where.com)[2] - float((forces * apply(T, where.soles)).sum())

        wanted = np.zeros(len(q))
        for joint in free:
            more, less = (q + way * step * np.eye(len(q))[joint] for way in (1, -1))
            wanted[joint] = energy(robot.coupling.followed(more)) - energy(robot.coupling.followed(less))
        found = efforts_under(robot, q, T, list(robot.legs), contacts, forces)
        np.testing.assert_allclose(found, wanted / (2 * step), atol=1e-6)


def test_it_walks_with_every_follower_where_its_leader_has_it(made, walked):
    robot, (dem, _, result) = made[1], walked
    assert result.plan is not None, result.reason
    knee, ankle, toe = knee_ankle_toe(robot, result.plan.waypoints)
    np.testing.assert_allclose(ankle, RATIO * knee + OFFSET, atol=1e-9)
    np.testing.assert_allclose(toe, TOE * ankle, atol=1e-9)
    assert not any("effort" in one for one in result.unchecked)
    sequence = footfall.make_sequence(result.plan, robot, dem)
    assert sequence.valid, sequence.failures


def test_a_row_that_turns_a_follower_alone_breaks_its_limits(made, walked):
    robot, (dem, _, result) = made[1], walked
    sequence = footfall.make_sequence(result.plan, robot, dem)
    row, joints = next((at, one.joints) for at, one in enumerate(sequence.commands) if one.leg is not None)
    assert joints is not None
    at = [name.split("_", 1)[1] for name in robot.model.legs[0].joints].index("ankle")
    turned = apply_edit(robot, sequence, Edit("joint", row, joint=at, number=float(joints[at]) + 0.02), dem)
    told = [one.text for one in turned.failures if one.row == row and one.rule == "joint-limits"]
    leg = sequence.commands[row].leg
    assert len(told) == 1
    assert f"l{leg}_ankle away from where l{leg}_knee has it" in told[0]


@pytest.mark.parametrize(("off", "begins"), [(0.0, True), (0.005, True), (0.02, False)])
def test_a_measured_follower_may_be_off_a_little(made, walked, off, begins):
    robot, (dem, state, _) = made[1], walked
    ankle = robot.joint_names.index("l2_toe")
    measured = replace(state, q=state.q + off * np.eye(len(state.q))[ankle])
    x, y = state.soles[1, :2].tolist()
    result = footfall.plan_step(robot, dem, measured, 1, (x + 0.02, y), UNHURRIED)
    assert (result.plan is not None) == begins, result.reason
    if not begins:
        assert "l2_toe away from where l2_knee has it" in result.reason


def test_physics_moves_followers_by_their_rods(made):
    robot = made[1]
    dem = plane(3.0, 0.05)
    physics = build_legged(robot, dem, PhysicsSettings())
    assert physics.model.neq == 8
    gains = physics.model.actuator_gainprm[:, 0]
    assert (gains[robot.coupling.free] > 0).all()
    assert (gains[~robot.coupling.free] == 0).all()
    state = footfall.stand(robot, dem)
    x, y = state.soles[1, :2].tolist()
    result = footfall.plan_step(robot, dem, state, 1, (x + 0.03, y), UNHURRIED)
    assert result.plan is not None, result.reason
    found = legged_referee(robot, footfall.make_sequence(result.plan, robot, dem), dem)
    assert found.tipped == ""
    assert found.contacts == ()
    assert found.stayed == ()
    assert found.drift < 0.1 * robot.length


def test_limits_that_leave_a_joint_and_its_follower_no_place_are_refused(tmp_path):
    path = written(tmp_path, pantograph(ratio=3.0))
    with pytest.raises(InvalidRobot, match="l0_ankle follows l0_knee, and at no place do both keep their limits"):
        LeggedRobot(legged_model(read_urdf(path)))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (('multiplier="-0.3"', 'multiplier="0"'), "by a multiplier of 0: a fixed joint would be right"),
        (('joint="l0_knee"', 'joint="l1_knee"'), "follows l1_knee, which is no joint of it"),
    ],
)
def test_followers_that_no_leg_moves_are_refused_by_name(tmp_path, change, told):
    said, instead = change
    path = written(tmp_path, pantograph().replace(said, instead, 1))
    with pytest.raises(InvalidRobot, match=f"leg 0 can't walk: l0_ankle follows .*{told.split(' ', 1)[1]}"):
        LeggedRobot(legged_model(read_urdf(path)))


def test_the_stance_at_ease_is_one_that_the_rods_allow(made):
    robot = made[1]
    ease = at_ease(robot)
    np.testing.assert_allclose(ease.q, robot.coupling.followed(ease.q), atol=1e-9)
    ground = Ground(robot, plane(3.0, 0.05), LeggedSettings())
    state = footfall.stand(robot, ground.dem)
    margins = ground.check.margins(state.q, state.T_site_base, all_standing(state))
    assert isinstance(margins, dict)
