"""Laws of the robot model: masses, symmetry, derivatives, against pin and finite differences."""

import pickle

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput, NotFound
from footfall.core.frames import inverse, rotation, rotation_rpy, transform
from footfall.robot import kinematics
from footfall.robot.description import with_payload
from footfall.robot.model import Robot


def random_posture(robot, rng):
    return rng.uniform(robot.lower, robot.upper)


def test_mass_is_that_of_the_prototype(athlete):
    assert abs(athlete.mass - 850.0) < 1e-9


def test_joint_order_is_leg_by_leg(athlete):
    assert athlete.joint_names[6:9] == ("leg1_hip_yaw_joint", "leg1_hip_pitch_joint", "leg1_knee_pitch_joint")
    assert tuple(athlete.model.names)[1:] == athlete.joint_names
    np.testing.assert_allclose(athlete.model.lowerPositionLimit, athlete.lower, atol=1e-10)
    np.testing.assert_allclose(athlete.model.effortLimit, athlete.torque_limits)


def test_leg_models_agree_with_the_urdf(athlete, rng):
    for _ in range(50):
        q = random_posture(athlete, rng)
        whole = kinematics.link_poses(athlete, q)
        for leg in athlete.legs:
            for link, T_base_link in kinematics.leg_link_poses(athlete, q[6 * leg : 6 * leg + 6], leg).items():
                np.testing.assert_allclose(T_base_link, whole[link], atol=1e-10)
            np.testing.assert_allclose(kinematics.wheel_pose(athlete, q, leg), whole[f"leg{leg}_wheel"], atol=1e-10)
        np.testing.assert_allclose(
            kinematics.wheel_centers(athlete, q), [whole[f"leg{i}_wheel"][:3, 3] for i in athlete.legs], atol=1e-10
        )


def test_turning_by_sixty_degrees_is_renumbering_the_legs(athlete, rng):
    R = rotation("z", np.pi / 3)
    for _ in range(20):
        q = random_posture(athlete, rng)
        turned = np.roll(q, 6)
        np.testing.assert_allclose(
            kinematics.wheel_centers(athlete, turned),
            np.roll(kinematics.wheel_centers(athlete, q), 1, axis=0) @ R.T,
            atol=1e-9,
        )
        np.testing.assert_allclose(
            kinematics.center_of_mass(athlete, turned), R @ kinematics.center_of_mass(athlete, q), atol=1e-9
        )


@pytest.mark.parametrize("name", ["stand", "crouch", "tall"])
def test_named_postures_point_the_last_link_straight_down(athlete, name):
    for leg in athlete.legs:
        np.testing.assert_allclose(
            kinematics.wheel_pose(athlete, athlete.posture(name), leg)[:3, 0], (0, 0, -1), atol=1e-9
        )


def test_standing_height_is_just_over_two_metres(athlete):
    # published for the whole vehicle; the deck stands 1.80 m high and the tall posture reaches past 2 m
    def deck(name):
        return athlete.wheel_radius - kinematics.wheel_centers(athlete, athlete.posture(name))[0, 2]

    assert deck("crouch") < 1.5 < deck("stand") < 1.85 < 2.0 < deck("tall") < 2.1
    for pair in athlete.description.cameras:
        assert 1.5 <= deck("stand") + pair.camera_left.T_base_camera[2, 3] <= 1.7


def test_wheel_jacobian_is_the_derivative(athlete, rng):
    step = 1e-6
    for leg in athlete.legs:
        q = random_posture(athlete, rng)
        J = kinematics.wheel_jacobian(athlete, q, leg)
        for j in range(6):
            shift = np.zeros(36)
            shift[6 * leg + j] = step
            ahead = kinematics.wheel_centers(athlete, q + shift)[leg]
            behind = kinematics.wheel_centers(athlete, q - shift)[leg]
            np.testing.assert_allclose(J[:, j], (ahead - behind) / (2 * step), atol=1e-8)


def test_gravity_torques_are_the_gradient_of_potential_energy(athlete, rng):
    step = 1e-5
    loaded = Robot(with_payload(athlete.description, 300.0))
    for robot in (athlete, loaded):
        q = random_posture(robot, rng)
        R_site_base = rotation_rpy(0.2, -0.3, 1.0)

        def energy(posture, robot=robot, R_site_base=R_site_base):
            return robot.mass * 1.62 * (R_site_base @ kinematics.center_of_mass(robot, posture))[2]

        torques = kinematics.gravity_torques(robot, q, R_site_base, gravity=1.62)
        for j in range(0, 36, 5):
            shift = np.zeros(36)
            shift[j] = step
            slope = (energy(q + shift) - energy(q - shift)) / (2 * step)
            assert torques[j] == pytest.approx(slope, abs=1e-4)


def test_gravity_of_one_call_does_not_leak_into_the_next(athlete):
    q = athlete.posture("stand")
    earth = kinematics.gravity_torques(athlete, q, np.eye(3))
    kinematics.gravity_torques(athlete, q, rotation("x", 0.5), gravity=1.62)
    np.testing.assert_array_equal(kinematics.gravity_torques(athlete, q, np.eye(3)), earth)
    assert np.linalg.norm(athlete.model.gravity.vector) == 0


@given(mass=st.floats(1, 450), x=st.floats(-1, 1), y=st.floats(-1, 1), z=st.floats(-1, 1))
def test_payload_moves_the_centre_of_mass_by_its_share(athlete, mass, x, y, z):
    q = athlete.posture("stand")
    loaded = Robot(with_payload(athlete.description, mass, position=(x, y, z)))
    empty = kinematics.center_of_mass(athlete, q)
    want = empty + mass / (850 + mass) * (np.array([x, y, z]) - empty)
    np.testing.assert_allclose(kinematics.center_of_mass(loaded, q), want, atol=1e-12)
    assert loaded.mass == pytest.approx(850 + mass)
    assert loaded.digest != athlete.digest
    assert with_payload(loaded.description, 0).digest == athlete.digest


def test_inertias_are_physical(athlete):
    for inertia in list(athlete.model.inertias)[1:]:
        assert inertia.mass > 0
        principal = np.linalg.eigvalsh(inertia.inertia)
        assert principal[0] > 0
        assert principal[2] <= principal[0] + principal[1] + 1e-12


def test_robot_survives_pickling(athlete):
    again = pickle.loads(pickle.dumps(athlete))
    assert again.digest == athlete.digest
    np.testing.assert_array_equal(
        kinematics.wheel_centers(again, again.posture("tall")),
        kinematics.wheel_centers(athlete, athlete.posture("tall")),
    )


def test_misuse_is_refused(athlete):
    with pytest.raises(InvalidInput, match="36 finite"):
        kinematics.center_of_mass(athlete, np.zeros(35))
    with pytest.raises(InvalidInput, match="finite"):
        kinematics.link_poses(athlete, np.full(36, np.nan))
    with pytest.raises(NotFound, match="crouch"):
        athlete.posture("lying")
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        athlete.require_leg(6)


def test_cameras_see_the_ground_they_are_for(athlete):
    ground = athlete.wheel_radius - kinematics.wheel_centers(athlete, athlete.posture("stand"))[0, 2]
    feet = kinematics.wheel_centers(athlete, athlete.posture("stand"))
    feet[:, 2] = -ground

    def sees(camera, points):
        p = points @ inverse(camera.T_base_camera)[:3, :3].T + inverse(camera.T_base_camera)[:3, 3]
        u, v = camera.fx * p[:, 0] / p[:, 2] + camera.cx, camera.fy * p[:, 1] / p[:, 2] + camera.cy
        return (p[:, 2] > 0) & (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)

    nav = [pair for pair in athlete.description.cameras if pair.name.startswith("nav")]
    haz = [pair for pair in athlete.description.cameras if pair.name.startswith("haz")]
    assert (len(nav), len(haz)) == (6, 3)
    for pair in (*nav, *haz):
        baseline = inverse(pair.camera_left.T_base_camera) @ pair.camera_right.T_base_camera
        np.testing.assert_allclose(baseline, transform(translation=(0.2, 0, 0)), atol=1e-9)
    assert all(sum(sees(camera, feet).sum() for camera in (p.camera_left,)) == 3 for p in haz)
    under = np.array([(x, y, -ground) for x in (-0.8, 0, 0.8) for y in (-0.8, 0, 0.8)])
    assert np.any([sees(pair.camera_left, under) for pair in haz], axis=0).all()
    outward = np.array([(3.0 * np.cos(a), 3.0 * np.sin(a), -ground) for a in np.deg2rad(np.arange(30, 390, 60))])
    assert np.array([sees(pair.camera_left, outward) for pair in nav]).any(axis=0).all()


def test_urdf_kinematics_by_an_own_chain(athlete, rng):
    # written out from the published offsets, without the description
    q = random_posture(athlete, rng)
    for leg in athlete.legs:
        a = q[6 * leg : 6 * leg + 6]
        chain = transform(rotation("z", leg * np.pi / 3)) @ transform(rotation("z", a[0]), (1.229, 0, 0))
        chain = chain @ transform(rotation("y", a[1]), (0.322, 0, -0.330))
        chain = chain @ transform(rotation("y", a[2]) @ rotation("x", a[3]), (0.674, 0, 0))
        chain = chain @ transform(rotation("y", a[4]) @ rotation("x", a[5]), (0.448, 0, 0))
        chain = chain @ transform(translation=(0.506, 0, 0))
        np.testing.assert_allclose(kinematics.wheel_pose(athlete, q, leg), chain, atol=1e-9)


def test_pin_builds_the_same_geometry_from_the_committed_urdf(athlete):
    from footfall.resources import robot_assets_folder

    folder = robot_assets_folder() / "athlete"
    model = pin.buildModelFromUrdf(str(folder / "athlete.urdf"))
    shapes = pin.buildGeomFromUrdf(model, str(folder / "athlete.urdf"), pin.GeometryType.COLLISION, None, [str(folder)])
    assert shapes.ngeoms == 1 + 6 * 7
