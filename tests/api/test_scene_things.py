"""What is drawn of values: numbers in, geometry and words out; no viser."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.core.frames import apply, inverse
from footfall.maps.suggest import Suggestion, Suggestions
from footfall.maps.support_outlines import bearing
from footfall.planning.answers import Check, Status
from footfall.planning.step.problem import Footfall, PlanResult
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.make import make_sequence
from footfall_ui.scene.cameras import frusta
from footfall_ui.scene.collision import colliding
from footfall_ui.scene.forces import METRES_PER_NEWTON, OUTSIDE, force_arrows
from footfall_ui.scene.ghost import motion_of
from footfall_ui.scene.look import eye_of, followed
from footfall_ui.scene.predicted import alongside
from footfall_ui.scene.still import stands_still
from footfall_ui.scene.suggested import markers
from footfall_ui.scene.support import dashes, stance_of
from footfall_ui.scene.swept import swept_poses
from footfall_ui.scene.tape import tape_text
from footfall_ui.scene.torque import level, torque_shares, worst_joint
from tests.support.chassis_ground import wavy

LEG = 2


@pytest.fixture(scope="module")
def ground():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def stood(athlete, ground):
    state = footfall.stand(athlete, ground)
    forces = np.tile([0.0, 0.0, athlete.mass * 9.81 / 6], (6, 1))
    return replace(state, wheel_forces=forces, joint_torques=np.zeros(36))


@pytest.fixture(scope="module")
def plan(athlete, ground, stood):
    foot = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))[LEG]
    found = footfall.plan_step(athlete, ground, stood, LEG, (float(foot[0] + 0.1), float(foot[1] + 0.1)), seed=1)
    assert found.plan is not None
    return found


def worked(athlete, stood, joint, share):
    torques = 0.1 * athlete.torque_limits
    torques[joint] = -share * athlete.torque_limits[joint]
    return replace(stood, joint_torques=torques)


def test_the_worst_joint_is_told_from_70_percent_on(athlete, stood):
    assert worst_joint(athlete, worked(athlete, stood, 14, 0.69)) is None
    near = worst_joint(athlete, worked(athlete, stood, 14, 0.74))
    assert near is not None
    assert near.text == "74% leg 2 knee pitch"
    warned, over = (worst_joint(athlete, worked(athlete, stood, 14, share)) for share in (0.87, 1.12))
    assert warned is not None
    assert over is not None
    assert warned.text == "▲ 87% leg 2 knee pitch"
    assert over.text == "✕ over: 112% leg 2 knee pitch"
    # it is at the knee: a thigh's length from the hip's pitch axis
    spec = athlete.description.legs[2]
    hip = stood.T_site_base @ spec.T_base_hip
    yaw = stood.posture[12]
    offset = np.array([np.cos(yaw) * spec.hip_offset[0], np.sin(yaw) * spec.hip_offset[0], spec.hip_offset[2]])
    assert np.linalg.norm(near.point - apply(hip, offset)) == pytest.approx(spec.thigh, abs=1e-9)


def test_levels_of_torque(athlete, stood):
    assert [level(share) for share in (0.0, 0.79, 0.8, 0.99, 1.0, 3.0)] == [
        "good",
        "good",
        "warn",
        "warn",
        *["over"] * 2,
    ]
    shares = torque_shares(athlete, worked(athlete, stood, 14, 0.87))
    assert shares[14] == pytest.approx(0.87)
    assert np.delete(shares, 14) == pytest.approx(0.1)


def test_an_arrow_is_as_long_as_its_force_is_large(athlete, stood):
    forces = np.array(stood.wheel_forces)
    forces[1] = [300.0, 0.0, 400.0]
    forces[4] = 0.0
    state = replace(stood, wheel_forces=forces)
    arrows = force_arrows(athlete, state)
    assert arrows.legs == (0, 1, 2, 3, 5)
    assert arrows.newtons[1] == pytest.approx(500.0)
    start, tip = arrows.points[1]
    beside = start - contact_point(athlete, state.posture, 1, state.T_site_base)
    assert np.linalg.norm(beside) == pytest.approx(OUTSIDE)
    assert beside[2] == 0
    assert beside @ (start - state.T_site_base[:3, 3]) > 0
    assert tip - start == pytest.approx(np.array([300.0, 0.0, 400.0]) * METRES_PER_NEWTON)
    assert force_arrows(athlete, replace(stood, wheel_forces=np.zeros((6, 3)))).points.shape == (0, 2, 3)


def test_wheels_without_load_hold_nothing(athlete, stood):
    stance = stance_of(athlete, stood)
    assert 0 < stance.margins["conservative"] < stance.margins["plain"]
    # the least distance of the centre of mass from any side of the outline, the other way round
    ring = stance.ring("plain")[:, :2]
    ends = np.roll(ring, -1, axis=0)
    sides = (ends - ring) / np.linalg.norm(ends - ring, axis=1)[:, None]
    away = stance.com[:2] - ring
    distances = np.abs(sides[:, 0] * away[:, 1] - sides[:, 1] * away[:, 0])
    assert stance.margins["plain"] == pytest.approx(distances.min())
    assert stance.text == (
        f"margin {stance.margins['plain']:.2f} m, any leg lost {stance.margins['conservative']:.2f} m"
    )
    forces = np.array(stood.wheel_forces)
    forces[LEG] = 0.0
    lifted = replace(stood, wheel_forces=forces)
    assert bearing(athlete, lifted) == [0, 1, 3, 4, 5]
    assert stance_of(athlete, lifted).margins["plain"] < stance.margins["plain"]
    # where no force is known, all are taken to stand
    assert bearing(athlete, replace(stood, wheel_forces=np.zeros((6, 3)))) == [0, 1, 2, 3, 4, 5]
    one = np.zeros((6, 3))
    one[0] = [0.0, 0.0, 8000.0]
    assert stance_of(athlete, replace(stood, wheel_forces=one)).text == "margin: too few wheels stand"


def test_a_pattern_goes_round_corners():
    square = np.array([(0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (2.0, 2.0, 1.0), (0.0, 2.0, 1.0)])
    whole = dashes(square, 1.0, 0.0)
    assert np.linalg.norm(np.diff(whole, axis=1), axis=-1).ravel() == pytest.approx([2.0] * 4)
    broken = dashes(square, 0.3, 0.2)
    assert np.linalg.norm(np.diff(broken, axis=1), axis=-1).sum() == pytest.approx(8.0 * 0.3 / 0.5)
    # every piece lies on a side: none cuts a corner
    at_edge = np.isclose(broken[..., :2], 0.0) | np.isclose(broken[..., :2], 2.0)
    assert (at_edge[:, 0] & at_edge[:, 1]).any(axis=1).all()


def test_only_what_moves_a_standing_wheel_moves_its_support(athlete, stood):
    swung = np.array(stood.posture)
    swung[6 * LEG + 1] += 0.3
    moved = replace(stood, posture=swung)
    assert not stands_still(stood, moved)
    assert stands_still(stood, moved, [leg for leg in athlete.legs if leg != LEG])


def test_noise_is_no_motion(stood, rng):
    noisy = replace(stood, time=1.0, posture=stood.posture + rng.uniform(-1e-3, 1e-3, 36))
    assert stands_still(stood, noisy)
    turned = np.array(stood.posture)
    turned[3] += 0.01
    assert not stands_still(stood, replace(stood, posture=turned))
    pose = np.array(stood.T_site_base)
    pose[0, 3] += 0.01
    assert not stands_still(stood, replace(stood, T_site_base=pose))


def test_a_refusal_names_its_pair(athlete, plan):
    links = athlete.description.meshes

    def refused(reason, *checks):
        return PlanResult(Status.NO_PATH, None, reason, checks, Footfall(LEG, 0.0, 0.0), plan.provenance)

    where = "leg2_knee_roll and leg1_wheel: swing, 30% of the way to waypoint 4"
    hit = Check("self collision", False, -0.01, "m", where)
    held = Check("terrain collision in lift and lower", True, 0.1, "m", "leg2_wheel, beyond δ, at waypoint 0")
    assert colliding(refused("no way", held, hit), links) == ("leg2_knee_roll", "leg1_wheel")
    told = "no way: leg2_hip_pitch is 0.020 m from base, 0.050 m is needed; leg2_wheel cuts into the ground"
    assert colliding(refused(told), links) == ("leg2_hip_pitch", "base")
    assert colliding(refused("out of reach by 0.2 m"), links) == ()
    assert colliding(plan, links) == ()


def test_the_planner_writes_links_that_are_drawn(athlete, stood):
    """What the planner itself says of a footfall at the foot of a boulder."""
    x, y, _ = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))[LEG]
    boulder = wavy(half=4.0, rocks=[(x - 0.25, y + 0.45, 0.45, 0.9)])
    found = footfall.plan_step(athlete, boulder, stood, LEG, (float(x - 0.1), float(y + 0.1)), seed=1)
    assert found.plan is None
    pair = colliding(found, athlete.description.meshes)
    assert pair, found.reason
    assert all(link.startswith("leg2_") for link in pair), found.reason


def test_swept_samples_begin_and_end_as_the_plan_does(athlete, stood, plan):
    motion = motion_of(plan.plan)
    assert motion is not None
    poses = swept_poses(athlete, motion, 5)
    assert set(poses) == {link for link in athlete.description.meshes if link.startswith("leg2_")}
    for at, posture in ((0, plan.plan.waypoints[0]), (-1, plan.plan.waypoints[-1])):
        wheel = apply(stood.T_site_base, wheel_centers(athlete, posture))[LEG]
        assert poses["leg2_wheel"][at, :3, 3] == pytest.approx(wheel)
    assert poses["leg2_wheel"][2, 2, 3] > poses["leg2_wheel"][[0, -1], 2, 3].max()


def test_a_frustum_holds_what_its_camera_sees(athlete):
    """The corner of a frustum, by its two numbers, is the picture's corner, by the pinhole."""
    for pair, one in zip(athlete.description.cameras, frusta(athlete.description.cameras), strict=True):
        camera, up = pair.camera_left, np.tan(one.fov / 2)
        assert one.name == pair.name
        assert up == pytest.approx(camera.height / 2 / camera.fy)
        assert up * one.aspect == pytest.approx(camera.width / 2 / camera.fx, rel=1e-6)


def test_the_tape_tells_distance_and_height():
    assert tape_text(((0.0, 0.0, 0.0), (3.0, 4.0, 12.0))) == "13.000 m, level 5.000 m, height +12.000 m"
    assert tape_text(((0.0, 0.0, 1.0), (0.0, 2.0, 0.5))) == "2.062 m, level 2.000 m, height -0.500 m"
    assert tape_text(((0.0, 0.0, 0.0),)) == "click on the other end"


def test_suggestions_keep_their_rank():
    def one(score, z):
        return Suggestion(0, 0, 1.0, 2.0, z, score, {}, {}, False, ())

    found = markers(Suggestions((one(0.9, 0.1), one(0.8, None), one(0.7, 0.2)), {}, {}, ""))
    assert [marker.text for marker in found] == ["1", "3"]
    assert found[1].point[:2] == pytest.approx([1.0, 2.0])
    assert found[1].point[2] > 0.2


def test_each_look_sees_what_it_is_named_for(athlete, stood):
    wheel = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))[LEG]
    chassis = stood.T_site_base[:3, 3]
    top, along, beside = (eye_of(look, athlete, stood, LEG) for look in ("top", "leg", "wheel"))
    assert top is not None
    assert along is not None
    assert beside is not None
    down = (top.target - top.position) / np.linalg.norm(top.target - top.position)
    assert down[2] < -0.999
    assert np.linalg.norm(top.target - chassis) == 0
    # along the leg: eye, hip and wheel in one upright plane, the wheel farther than the hip
    hip = (stood.T_site_base @ athlete.description.legs[LEG].T_base_hip)[:3, 3]
    assert along.target == pytest.approx(wheel)
    assert np.linalg.norm((along.position - hip)[:2]) < np.linalg.norm((along.position - wheel)[:2])
    # the wheel, from outside: the chassis is behind it
    assert beside.target == pytest.approx(wheel)
    assert np.linalg.norm(beside.position - chassis) > np.linalg.norm(wheel - chassis)
    assert eye_of("follow", athlete, stood, LEG) is None
    assert followed("follow", athlete, stood, LEG) == pytest.approx(chassis)
    assert followed("top", athlete, stood, LEG) is None


def test_measured_is_compared_with_the_nearest_predicted_place(athlete, ground, stood, plan):
    sequence = make_sequence(plan.plan, athlete, ground)
    row = next(i for i, command in enumerate(sequence.commands) if command.phase == "swing")
    begin, end = sequence.predicted[row - 1], sequence.predicted[row]
    beside = np.zeros(36)
    free = int(np.flatnonzero(begin == end)[0])  # across the way
    beside[free] = np.deg2rad(1.5)
    pose = np.array(sequence.poses[row])
    pose[0, 3] += 0.02
    measured = replace(stood, posture=begin + 0.25 * (end - begin) + beside, T_site_base=pose)
    there = alongside(athlete, sequence, row, measured)
    assert there.posture == pytest.approx(begin + 0.25 * (end - begin), abs=1e-12)
    assert apply(inverse(sequence.T_site_base), there.T_site_base[:3, 3]) == pytest.approx(np.zeros(3), abs=1e-9)
    joint = athlete.joint_names[free].removesuffix("_joint").replace("_", " ")
    assert there.text == f"row {row + 1}: {joint} +1.50°, chassis 20 mm from predicted"
    # before its start and behind its end there is no predicted place
    late = replace(stood, posture=end + 0.5 * (end - begin))
    assert alongside(athlete, sequence, row, late).posture == pytest.approx(end)
    assert alongside(athlete, sequence, 0, stood).posture == pytest.approx(sequence.start, abs=1e-6)
