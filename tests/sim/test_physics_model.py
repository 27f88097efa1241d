"""The model in physics is the robot of the description on the ground of the Dem: masses, places, surfaces, refusals."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput, InvalidRobot
from footfall.core.frames import apply, inverse, quat_wxyz, rotation_rpy, transform
from footfall.core.value import Provenance
from footfall.robot.description import PARTS, link_name, with_payload
from footfall.robot.kinematics import center_of_mass, gravity_torques, link_poses
from footfall.robot.model import Robot
from footfall.sim.physics.model import PhysicsModel, build_model
from footfall.sim.physics.physics_settings import Noise, PhysicsSettings
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal
from footfall.terrain.ground.surface import height_at

T_SITE_BASE = transform(rotation_rpy(0.1, -0.2, 0.7), (0.3, -0.4, 5.0))


@pytest.fixture(scope="module")
def loaded(athlete) -> Robot:
    return Robot(with_payload(athlete.description, 200.0, (1.0, 0.8, 0.5), (0.1, -0.2, 0.25)))


@pytest.fixture(scope="module")
def physics(loaded, flat) -> PhysicsModel:
    return build_model(loaded, flat, PhysicsSettings())


def placed(physics: PhysicsModel, posture: np.ndarray) -> mujoco.MjData:
    data = mujoco.MjData(physics.model)
    data.qpos[:3], data.qpos[3:7] = T_SITE_BASE[:3, 3], quat_wxyz(T_SITE_BASE[:3, :3])
    data.qpos[physics.joints] = posture
    mujoco.mj_forward(physics.model, data)
    return data


postures = st.lists(st.floats(0.0, 1.0), min_size=36, max_size=36)


@settings(max_examples=20)
@given(shares=postures)
def test_links_centre_of_mass_and_weight_are_those_of_the_kinematics(loaded, physics, shares):
    posture = loaded.lower + np.array(shares) * (loaded.upper - loaded.lower)
    data = placed(physics, posture)
    for name, T_base_link in link_poses(loaded, posture).items():
        T_site_link = T_SITE_BASE @ T_base_link
        body = data.body(f"rim{name[3]}" if name.endswith("wheel") else name)
        assert np.allclose(body.xpos, T_site_link[:3, 3], atol=1e-9)
        assert np.allclose(body.xmat.reshape(3, 3), T_site_link[:3, :3], atol=1e-9)
    assert physics.model.body_mass.sum() == pytest.approx(loaded.mass, abs=1e-9)
    assert np.allclose(data.subtree_com[0], apply(T_SITE_BASE, center_of_mass(loaded, posture)), atol=1e-9)
    # hanging by its chassis with locked wheels: what gravity asks of the joints, by pin from the URDF
    held = gravity_torques(loaded, posture, T_SITE_BASE[:3, :3])
    assert np.allclose(data.qfrc_bias[physics.speeds], held, atol=1e-6)


def test_moments_of_inertia_are_those_of_the_description(loaded, physics, rng):
    posture = rng.uniform(loaded.lower, loaded.upper)
    data = placed(physics, posture)
    mass_matrix = np.zeros((physics.model.nv, physics.model.nv))
    mujoco.mj_fullM(physics.model, data, mass_matrix)
    joints = mass_matrix[np.ix_(physics.speeds, physics.speeds)] - np.diag(physics.model.dof_armature[physics.speeds])

    import pinocchio as pin

    by_pin = pin.crba(loaded.model, loaded.model.createData(), posture)
    by_pin = np.triu(by_pin) + np.triu(by_pin, 1).T
    assert np.allclose(joints, by_pin, atol=1e-8)


def test_the_payload_turns_with_the_chassis_as_a_solid_box(athlete, flat):
    bare = athlete.model.inertias[0]
    size, position = np.array([1.0, 0.8, 0.5]), np.array([0.1, -0.2, 0.25])
    robot = Robot(with_payload(athlete.description, 200.0, size, position))
    model = build_model(robot, flat, PhysicsSettings()).model
    body = model.body("base")
    R = rotation_of(body.iquat)
    about_origin = R @ np.diag(body.inertia) @ R.T + shifted(body.mass[0], body.ipos)
    box = 200 / 12 * np.diag([0.8**2 + 0.5**2, 0.5**2 + 1, 1 + 0.8**2])
    expected = bare.inertia + shifted(bare.mass, bare.lever) + box + shifted(200, position)
    assert np.allclose(about_origin, expected, atol=1e-9)


def rotation_of(quaternion: np.ndarray) -> np.ndarray:
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, quaternion)
    return R.reshape(3, 3)


def shifted(mass: float, arm: np.ndarray) -> np.ndarray:
    return mass * (np.dot(arm, arm) * np.eye(3) - np.outer(arm, arm))


@pytest.fixture(scope="module")
def rough() -> Dem:
    dem = fractal(size=(6.0, 4.0), resolution=0.1, roughness=0.3, seed=4)
    heights = np.array(dem.heights)
    heights[10:15, 20:26] = np.nan
    return Dem(heights, dem.geometry, "rough", Provenance({}))


def test_the_ground_is_the_surface_of_the_terrain(athlete, rough, rng):
    physics = build_model(athlete, rough, PhysicsSettings())
    data = placed(physics, athlete.posture("stand"))
    x, y = rng.uniform(-3.0, 3.0, 400), rng.uniform(-2.0, 2.0, 400)
    heights = height_at(rough, x, y)
    met = np.array([ground_height(physics, data, *place) for place in zip(x, y, strict=True)])
    known = np.isfinite(heights)
    assert known.sum() > 300
    # the height field keeps single precision over the whole range of heights
    assert np.allclose(met[known], heights[known], atol=1e-6)
    low, high = np.nanmin(rough.heights), np.nanmax(rough.heights)
    assert ((met[~known] >= low - 1e-6) & (met[~known] <= high + 1e-6)).all()
    assert (~known).any()


def test_past_the_edge_the_ground_goes_on_as_at_the_edge(athlete, rough):
    physics = build_model(athlete, rough, PhysicsSettings())
    data = placed(physics, athlete.posture("stand"))
    west, south, east, _ = rough.geometry.bounds
    for y in (-1.0, 0.33):
        assert ground_height(physics, data, east + 2.0, y) == pytest.approx(float(height_at(rough, east, y)), abs=1e-6)
    corner = float(rough.heights[0, 0])
    assert ground_height(physics, data, west - 3.0, south - 3.0) == pytest.approx(corner, abs=1e-6)


def ground_height(physics: PhysicsModel, data: mujoco.MjData, x: float, y: float) -> float:
    down, normal = np.array([0.0, 0.0, -1.0]), np.zeros(3)
    distance = mujoco.mj_rayHfield(physics.model, data, physics.ground, np.array([x, y, 10.0]), down, normal)
    assert distance > 0
    return 10.0 - distance


def test_only_pairs_that_the_collision_checks_watch_can_touch(loaded, physics):
    model = physics.model
    asked = {("base", part) for part in loaded.description.clearances.chassis}
    asked |= {("payload", part) for part in PARTS}
    asked |= {tuple(sorted((p.part_a, p.part_b))) for p in loaded.description.clearances.own_leg}
    explicit = {frozenset((model.pair_geom1[i], model.pair_geom2[i])) for i in range(model.npair)}

    def touch(name_a: str, name_b: str) -> bool:
        a, b = model.geom(name_a).id, model.geom(name_b).id
        if frozenset((a, b)) in explicit:
            return True
        bodies = model.geom_bodyid[[a, b]]
        # MuJoCo leaves out one body and parent with child; the world is nobody's parent here
        parents = model.body_parentid[bodies]
        if bodies[0] == bodies[1] or (bodies.all() and (parents[0] == bodies[1] or parents[1] == bodies[0])):
            return False
        types, meets = model.geom_contype, model.geom_conaffinity
        return bool(types[a] & meets[b] or types[b] & meets[a])

    for part in PARTS:
        assert touch("base", link_name(1, part)) == (("base", part) in asked)
        assert touch("payload", link_name(1, part))
        assert touch("terrain", f"tread{1}" if part == "wheel" else link_name(1, part))
        for other in PARTS:
            assert touch(link_name(1, part), link_name(2, other))
            assert touch(link_name(1, part), link_name(1, other)) == (tuple(sorted((part, other))) in asked)
    assert touch("terrain", "base")
    assert touch("terrain", "payload")
    # the ground meets a wheel's tread only, or it would be felt twice
    assert not touch("terrain", link_name(1, "wheel"))
    assert not touch("base", "payload")


def test_spreads_are_drawn_from_the_seed(athlete, flat):
    def stiffness(seed: int) -> np.ndarray:
        return build_model(
            athlete, flat, PhysicsSettings(stiffness_spread=0.2, stiffness_scale=2.0, seed=seed)
        ).stiffness

    assert np.array_equal(stiffness(1), stiffness(1))
    assert not np.array_equal(stiffness(1), stiffness(2))
    factors = stiffness(1) / athlete.stiffness
    assert (np.abs(factors / 2.0 - 1.0) <= 0.2).all()
    assert np.ptp(factors) > 0.2


def test_what_makes_no_sense_is_refused(athlete, flat):
    with pytest.raises(InvalidInput, match="friction must be above zero"):
        PhysicsSettings(friction=0.0)
    with pytest.raises(InvalidInput, match="gravity must be above zero"):
        PhysicsSettings(gravity=np.nan)
    with pytest.raises(InvalidInput, match="stiffness_spread of the physics must be from 0"):
        PhysicsSettings(stiffness_spread=1.0)
    with pytest.raises(InvalidInput, match="one of sphere, crowned"):
        PhysicsSettings(wheel_shape="square")
    with pytest.raises(InvalidInput, match="noise of encoder"):
        PhysicsSettings(noise=Noise(encoder=-1.0))
    light = athlete.description.urdf.replace('<mass value="56.185"/>', '<mass value="15"/>')
    with pytest.raises(InvalidRobot, match="heavier than the 20 kg of a wheel's rim"):
        build_model(Robot(replace(athlete.description, urdf=light)), flat, PhysicsSettings())


def test_the_base_frame_is_the_body_frame(physics, loaded):
    data = placed(physics, loaded.posture("stand"))
    T = transform(data.body("base").xmat.reshape(3, 3), data.body("base").xpos)
    assert np.allclose(inverse(T) @ T_SITE_BASE, np.eye(4), atol=1e-12)
