"""Collision checks against an independent second method, and their laws.

The second method knows nothing of hierarchies: every shape is convex, so the distance of two is the least norm of
their vertex differences' hull, found by non-negative least squares (Lawson & Hanson 1974, least distance programming).
"""

import numpy as np
import pytest
from scipy.optimize import nnls

from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation_rpy, transform
from footfall.core.mesh import Mesh
from footfall.robot import ik, kinematics
from footfall.robot.description import PARTS, link_name, with_payload
from footfall.robot.meshes import shapes
from footfall.robot.meshes.collision import CollisionScene, posture_collisions
from footfall.robot.meshes.ground import GroundHeights, crop
from footfall.robot.model import Robot


def convex_distance(a, b):
    """Distance of the hulls of two vertex sets [m]; 0 where they overlap."""
    differences = (a[:, None] - b[None]).reshape(-1, 3)
    system = np.vstack([differences.T, np.ones(len(differences))])
    weights, _ = nnls(system, np.array([0.0, 0.0, 0.0, 1.0]))
    return float(np.linalg.norm(differences.T @ weights) / weights.sum())


def closer_than(a, b, required):
    """Whether two convex vertex sets are closer than required; bounding balls answer the easy ones."""
    centers, sizes = zip(
        *((v.mean(axis=0), np.linalg.norm(v - v.mean(axis=0), axis=1).max()) for v in (a, b)), strict=True
    )
    if np.linalg.norm(centers[0] - centers[1]) > sum(sizes) + required:
        return False
    return convex_distance(a, b) < required


def flat_ground(size=6.0, cells=6):
    return wavy_ground(size, cells, lambda x, y: 0.0 * x)


def wavy_ground(size, cells, height):
    edge = np.linspace(-size, size, cells + 1)
    x, y = (a.ravel() for a in np.meshgrid(edge, edge))
    i = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel()
    triangles = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    return Mesh(np.stack([x, y, height(x, y)], axis=1), triangles.astype(np.int32))


def standing(robot, posture="stand"):
    q = robot.posture(posture)
    return q, transform(translation=(0.0, 0.0, robot.wheel_radius - kinematics.wheel_centers(robot, q)[0, 2]))


def brute_force(robot, posture, leg, T_site_base, ground, clearance, lift, mode):
    """The second method: the same question as CollisionScene.collides."""
    deltas = robot.description.clearances
    world = {
        link: apply(T, robot.description.meshes[link].vertices)
        for link, T in kinematics.link_poses(robot, posture).items()
    }
    mine = {part: world[link_name(leg, part)] for part in PARTS}
    for pair in deltas.own_leg:
        if closer_than(mine[pair.part_a], mine[pair.part_b], pair.distance + clearance):
            return True
    for part in PARTS:
        if part in deltas.chassis and closer_than(mine[part], world["base"], deltas.chassis[part] + clearance):
            return True
        if robot.description.payload is not None:
            box = shapes.box(robot.description.payload.size, robot.description.payload.position).vertices
            if closer_than(mine[part], box, deltas.payload + clearance):
                return True
        for other in robot.legs:
            for other_part in PARTS:
                theirs = world[link_name(other, other_part)]
                if other != leg and closer_than(mine[part], theirs, deltas.other_leg + clearance):
                    return True
    if mode == "none":
        return False
    T_base_ground = np.linalg.inv(T_site_base) @ transform(translation=(0.0, 0.0, lift if mode == "raised" else 0.0))
    corners = apply(T_base_ground, ground.vertices)[ground.triangles]
    for part in PARTS:
        required, points = deltas.terrain[part] + clearance, mine[part]
        if part == "wheel" and mode == "true":
            required, sink = 0.0, deltas.wheel_sink
            small = shapes.cylinder_y(robot.wheel_radius - sink, robot.description.wheel_width - 2 * sink, 24)
            points = apply(kinematics.wheel_pose(robot, posture, leg), small.vertices)
        if any(closer_than(points, triangle, max(required, 1e-9)) for triangle in corners):
            return True
        middle = apply(T_site_base, points.mean(axis=0))
        if middle[2] < height_at(ground, middle) + (lift if mode == "raised" else 0.0):
            return True
    return False


def height_at(ground, point):
    corners = ground.vertices[ground.triangles]
    for a, b, c in corners:
        weights = np.linalg.solve(np.vstack([np.stack([a, b, c])[:, :2].T, np.ones(3)]), [*point[:2], 1.0])
        if (weights >= -1e-12).all():
            return weights @ np.array([a[2], b[2], c[2]])
    return -np.inf


@pytest.mark.parametrize(
    ("mode", "payload", "clearance"),
    [("none", 0.0, 0.0), ("none", 200.0, 0.02), ("true", 0.0, 0.0), ("raised", 0.0, 0.03)],
)
def test_same_answers_as_the_second_method(athlete, rng, mode, payload, clearance):
    # the box hangs under the chassis, where the legs can reach it
    robot = Robot(with_payload(athlete.description, payload, (1.0, 1.0, 0.5), (0.0, 0.0, -0.5)))
    posture, T_site_base = standing(robot)
    T_site_base = T_site_base @ transform(rotation_rpy(0.03, -0.05, 0.7))
    ground = wavy_ground(6.0, 6, lambda x, y: 0.15 * np.sin(x) * np.cos(y) - 0.1)
    leg = 4
    scene = CollisionScene(robot, posture, leg, T_site_base, ground, clearance=clearance, raise_terrain=0.15)
    answers = []
    for i in range(120):
        spread = 0.35 if i % 2 else 1.2
        q_leg = np.clip(
            posture[:6] - (0, 0.3, 0, 0, 0, 0) + spread * rng.normal(size=6), robot.lower[:6], robot.upper[:6]
        )
        whole = np.array(posture)
        whole[6 * leg : 6 * leg + 6] = q_leg
        want = brute_force(robot, whole, leg, T_site_base, ground, clearance, 0.15, mode)
        assert scene.collides(q_leg, mode) == want, (i, scene.contacts(q_leg, mode))
        assert bool(scene.contacts(q_leg, mode)) == want
        answers.append(want)
    assert 0.05 < np.mean(answers) < 0.95


def test_reported_distances_are_exact(athlete, rng):
    posture, T_site_base = standing(athlete)
    scene = CollisionScene(athlete, posture, 1, T_site_base, clearance=0.3)
    seen = 0
    for _ in range(40):
        q_leg = np.clip(posture[:6] + 0.8 * rng.normal(size=6), athlete.lower[:6], athlete.upper[:6])
        whole = np.array(posture)
        whole[6:12] = q_leg
        poses = kinematics.link_poses(athlete, whole)
        for found in scene.contacts(q_leg, "none"):
            a, b = (
                apply(poses[link], athlete.description.meshes[link].vertices) for link in (found.link_a, found.link_b)
            )
            assert found.distance <= found.required + 1e-9
            if found.distance > 1e-6:
                assert found.distance == pytest.approx(convex_distance(a, b), abs=1e-6)
                seen += 1
    assert seen > 20


@pytest.mark.parametrize("name", ["stand", "crouch", "tall"])
def test_named_postures_are_free(athlete, name):
    posture, T_site_base = standing(athlete, name)
    ground = flat_ground()
    assert posture_collisions(athlete, posture, T_site_base, ground) == []
    for leg in athlete.legs:
        assert not CollisionScene(athlete, posture, leg, T_site_base, ground).collides(posture[:6], "true")


def test_whole_robot_check_agrees_with_the_scenes(athlete, rng):
    ground = flat_ground()
    collided = 0
    for _ in range(25):
        posture, T_site_base = standing(athlete)
        posture = np.clip(
            posture - np.tile([0, 0.3, 0, 0, 0, 0], 6) + 0.3 * rng.normal(size=36), athlete.lower, athlete.upper
        )
        found = posture_collisions(athlete, posture, T_site_base, ground)
        scenes = [
            CollisionScene(athlete, posture, leg, T_site_base, ground).collides(posture[6 * leg : 6 * leg + 6], "true")
            for leg in athlete.legs
        ]
        assert bool(found) == any(scenes)
        collided += bool(found)
    assert 3 < collided < 25


def test_wheel_may_touch_but_not_sink(athlete):
    posture, T_site_base = standing(athlete)
    ground = flat_ground()
    for sink, allowed in ((0.0, True), (0.025, True), (0.035, False), (0.2, False)):
        lower = transform(translation=(0, 0, -sink)) @ T_site_base
        assert CollisionScene(athlete, posture, 0, lower, ground).collides(posture[:6], "true") is not allowed
    raised = CollisionScene(athlete, posture, 0, T_site_base, ground, raise_terrain=0.15)
    assert [c.link_a for c in raised.contacts(posture[:6], "raised")] == ["leg0_wheel"]
    assert raised.contacts(posture[:6], "none") == []


def lifted(robot, posture, leg, T_site_base, height):
    """The leg with its wheel straight up by ``height``."""
    T = np.array(kinematics.wheel_pose(robot, posture, leg))
    T[2, 3] += height
    solutions = ik.solve_leg(robot, leg, T[None])
    return solutions.q[0, 0]


def test_raised_ground_keeps_the_clearance_of_the_wheel(athlete):
    posture, T_site_base = standing(athlete)
    scene = CollisionScene(athlete, posture, 3, T_site_base, flat_ground(), raise_terrain=0.15)
    needed = 0.15 + athlete.description.clearances.terrain["wheel"]
    assert not scene.collides(lifted(athlete, posture, 3, T_site_base, needed + 0.0005), "raised")
    assert scene.collides(lifted(athlete, posture, 3, T_site_base, needed - 0.0005), "raised")
    assert not scene.collides(lifted(athlete, posture, 3, T_site_base, needed - 0.0005), "true")
    stricter = CollisionScene(athlete, posture, 3, T_site_base, flat_ground(), clearance=0.05, raise_terrain=0.15)
    assert stricter.collides(lifted(athlete, posture, 3, T_site_base, needed + 0.0495), "raised")
    # so the default lift of 0.20 m clears the ground raised by 0.15 m
    assert needed < 0.2


@pytest.mark.parametrize("cells", [4, 600])
def test_what_is_wholly_below_the_ground_collides(athlete, cells):
    posture, T_site_base = standing(athlete)
    buried = transform(translation=(0.0, 0.0, -6.0)) @ T_site_base
    ground = wavy_ground(5.0, cells, lambda x, y: 0.1 * np.sin(3 * x))
    scene = CollisionScene(athlete, posture, 2, buried, ground)
    assert scene.collides(posture[:6], "true")
    assert scene.collides(posture[:6], "raised")
    assert not scene.collides(posture[:6], "none")
    found = scene.contacts(posture[:6], "true")
    assert {c.link_a for c in found} == {link_name(2, part) for part in PARTS}
    assert all(c.link_b == "terrain" and c.distance < -3 for c in found)
    assert len(posture_collisions(athlete, posture, buried, ground)) == 43


def test_a_single_link_below_thin_ground_collides(athlete):
    # a shelf above the wheel alone: nothing touches it, and the wheel is under it
    posture, T_site_base = standing(athlete)
    foot = apply(T_site_base, kinematics.wheel_centers(athlete, posture)[0])
    corners = np.array([(0.35, -1.0, 1.0), (2.0, -1.0, 1.0), (2.0, 1.0, 1.0), (0.35, 1.0, 1.0)])
    shelf = Mesh(corners + foot, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    scene = CollisionScene(athlete, posture, 0, T_site_base, shelf)
    assert not scene.collides(posture[:6], "true")
    under = posture[:6] + np.array([0, -0.25, 0, 0, -0.6, 0])
    center = apply(T_site_base, kinematics.leg_wheel_pose(athlete, under, 0)[:3, 3])
    assert center[0] > foot[0] + 0.35
    assert scene.collides(under, "true")
    assert any(c.link_a == "leg0_wheel" and c.distance < -0.5 for c in scene.contacts(under, "true"))


def test_scene_ground_is_cropped_to_what_the_leg_can_reach(athlete, rng):
    # nothing that is cut away could have been touched
    posture, T_site_base = standing(athlete)
    ground = wavy_ground(6.0, 120, lambda x, y: 0.3 * np.sin(2 * x) * np.cos(2 * y))
    hip = athlete.description.legs[1].T_base_hip[:2, 3]
    reach = 0.0
    for q_leg in rng.uniform(athlete.lower[:6], athlete.upper[:6], (500, 6)):
        for link, T in kinematics.leg_link_poses(athlete, q_leg, 1).items():
            points = apply(T, athlete.description.meshes[link].vertices)
            reach = max(reach, np.linalg.norm(points[:, :2] - hip, axis=1).max())
    kept = crop(ground, hip, 2.5)
    distance = np.linalg.norm(kept.vertices[:, :2] - hip, axis=1)
    assert reach < 2.5
    assert 2.5 < distance.max() < 2.9
    assert len(kept.triangles) < len(ground.triangles) / 3
    assert CollisionScene(athlete, posture, 1, T_site_base, ground)._ground is not None


def test_heights_beside_a_point_decide_like_the_exact_height(rng):
    ball = 0.075
    ground = wavy_ground(2.0, 30, lambda x, y: 0.3 * np.sin(3 * x) + 0.2 * np.cos(5 * y))
    heights = GroundHeights(ground, ball)
    points = rng.uniform((-1.9, -1.9, -1.0), (1.9, 1.9, 1.0), (120, 3))
    checked = 0
    for point, above in zip(points, heights.above(points), strict=True):
        if min(convex_distance(point[None], t) for t in ground.vertices[ground.triangles][_near(ground, point)]) > ball:
            assert (above > 0) == (point[2] > height_at(ground, point))
            checked += 1
    assert checked > 60
    assert np.isinf(heights.above(np.array([[9.0, 0.0, 0.0]]))).all()


def _near(ground, point):
    middle = ground.vertices[ground.triangles].mean(axis=1)
    return np.argsort(np.linalg.norm(middle - point, axis=1))[:12]


def test_unknown_ground_is_no_obstacle_and_no_ground_is_allowed(athlete):
    posture, T_site_base = standing(athlete)
    far = wavy_ground(0.5, 4, lambda x, y: 0.0 * x)
    away = Mesh(far.vertices + np.array([50.0, 0.0, 0.0]), far.triangles)
    for ground in (None, away):
        scene = CollisionScene(athlete, posture, 0, T_site_base, ground, raise_terrain=0.15)
        assert not scene.collides(posture[:6], "raised")
        assert scene.contacts(posture[:6], "true") == []


def test_misuse_is_refused(athlete):
    posture, T_site_base = standing(athlete)
    scene = CollisionScene(athlete, posture, 0, T_site_base)
    with pytest.raises(InvalidInput, match="none, true, raised"):
        scene.collides(posture[:6], "soft")
    with pytest.raises(InvalidInput, match="six joint angles"):
        scene.collides(posture)
    with pytest.raises(InvalidInput, match="clearance"):
        CollisionScene(athlete, posture, 0, T_site_base, clearance=-0.1)
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        CollisionScene(athlete, posture, 6, T_site_base)
