"""The mask against robots that are not where their encoders say."""

import numpy as np
import pytest

from footfall.core import frames
from footfall.core.mesh import Mesh
from footfall.robot.kinematics import wheel_jacobian
from footfall.robot.meshes.shapes import box
from footfall.sim.raycast import RayScene
from footfall.telemetry.images import Camera
from footfall.telemetry.state import RobotState
from footfall.terrain.rover_mask.leg_errors import encoder_and_sag_errors
from footfall.terrain.rover_mask.selfmask import displacements, mesh_depths, robot_depths, robot_parts

SAG = 0.03


def state_of(robot, posture) -> RobotState:
    return RobotState(robot.name, 0.0, posture, np.eye(4), np.zeros((6, 3)), np.zeros(36), "idle")


def seen_depth(robot, posture, camera) -> np.ndarray:
    """Depth of the robot at each pixel by ray casting, infinite where it isn't; an independent method."""
    T = frames.inverse(camera.T_base_camera)
    parts = [Mesh(frames.apply(T @ T_part, m.vertices), m.triangles) for m, T_part in robot_parts(robot, posture)]
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], -1).reshape(-1, 3)
    hits = RayScene(parts).first_hits(np.zeros(3), rays)
    shown = (hits.body >= 0) & (hits.distance > 0.051)
    return np.where(shown, hits.distance, np.inf).reshape(u.shape)


def test_displacements_are_the_derivative_of_the_kinematics(athlete, rng):
    posture = athlete.posture("stand") + rng.uniform(-0.3, 0.3, 36)
    step = 1e-6
    spread = [one for one, _, _ in displacements(athlete, posture, encoder_and_sag_errors(athlete, posture, 1.0, 0.0))]
    for joint in (6, 8, 11):
        moved = np.array(posture)
        moved[joint] += step
        before, after = robot_parts(athlete, posture), robot_parts(athlete, moved)
        for name, (mesh, T0), (_, T1), d in zip(athlete.description.meshes, before, after, spread, strict=False):
            if not name.startswith("leg1"):
                continue
            difference = (frames.apply(T1, mesh.vertices) - frames.apply(T0, mesh.vertices)) / step
            assert np.allclose(difference, d[:, :, joint - 6], atol=1e-5)


def test_sag_brings_the_wheel_nearer_to_the_chassis_by_just_so_much(athlete):
    posture = athlete.posture("stand")
    displaced = displacements(athlete, posture, encoder_and_sag_errors(athlete, posture, 0.0, SAG))
    bends = dict(zip(athlete.description.meshes, displaced, strict=False))
    for leg in athlete.legs:
        assert bends[f"leg{leg}_wheel"][1][:, 2].mean() == pytest.approx(SAG, abs=1e-6)
        assert np.abs(bends[f"leg{leg}_hip_yaw"][1]).max() < 1e-6
    assert wheel_jacobian(athlete, posture, 0).shape == (3, 6)


def test_a_robot_with_wrong_encoders_and_sagging_legs_is_covered(athlete):
    """Ninety-nine in a hundred of its pixels or more, in every image, and of those in the rim none by its depth."""
    rng = np.random.default_rng(3)
    told = athlete.posture("stand")
    true = told + rng.normal(0.0, np.deg2rad(0.5), 36)
    for leg in athlete.legs:
        lift = wheel_jacobian(athlete, told, leg)[2]
        bent = lift / athlete.stiffness[6 * leg : 6 * leg + 6]
        true[6 * leg : 6 * leg + 6] += SAG * bent / (lift @ bent)
    for name in ("nav0", "haz0", "haz1"):
        camera = athlete.description.camera_pair(name).camera_left
        depth = seen_depth(athlete, true, camera)
        shown = np.isfinite(depth)
        kept = depth[shown] > robot_depths(athlete, state_of(athlete, told), camera)[shown]
        assert kept.mean() < 0.002
        exact = encoder_and_sag_errors(athlete, told, 0.0, 0.0)
        plain = robot_depths(athlete, state_of(athlete, told), camera, 0.0, 0, errors=exact)[shown] == 0
        assert plain.mean() > kept.mean()


def test_ground_behind_the_rim_stays_and_what_is_as_near_goes():
    camera = Camera("test", 80, 60, 50.0, 50.0, 39.5, 29.5, np.eye(4))
    depths = mesh_depths([box((0.4, 0.4, 0.2), (0.0, 0.0, 2.1))], camera, 0.2, 0, [0.0], [0.05])
    row = depths[30]
    assert np.isinf(row[39])
    rim = np.isfinite(row) & (row > 0)
    assert rim.sum() == 10  # 0.2 m at 2 m are five pixels on each side
    assert row[rim] == pytest.approx(2.25)
    assert (row[~rim & np.isfinite(row)] == 0).all()


def test_a_leg_that_images_showed_takes_its_own_margin(athlete):
    told = athlete.posture("stand")
    camera = athlete.description.camera_pair("haz0").camera_left
    exact = encoder_and_sag_errors(athlete, told, 0.0, 0.0)
    fitted = [error._replace(fitted=True) for error in exact]
    wide, narrow, none = (
        robot_depths(athlete, state_of(athlete, told), camera, margin, 0, errors=errors, fitted_margin=0.0) > 0
        for margin, errors in ((0.05, exact), (0.05, fitted), (0.0, exact))
    )
    assert (narrow <= wide).all()
    assert (none <= narrow).all()
    assert wide.sum() > narrow.sum() > none.sum()  # the chassis keeps its margin
