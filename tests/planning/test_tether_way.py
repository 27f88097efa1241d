"""The way of a tether: what is told is never more than the distance by coal's meshes, and what is in it is seen."""

import numpy as np
import pytest

from footfall.balance.tether import Tether
from footfall.core.frames import rotation_rpy, transform
from footfall.planning.scene.rover_kernel import place_rover
from footfall.planning.scene.rover_tables import rover_tables
from footfall.planning.scene.tether_kernel import DECK, GROUND, REEL, segments_apart, tether_spare
from footfall.planning.scene.tether_tables import beside_tether, tether_tables
from footfall.planning.walk.recheck.apart import MovingBody
from footfall.planning.walk.recheck.tethering import apart_from, line_between
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.bvh import robot_meshes
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.rocks import add_rocks
from tests.support.chassis_ground import wavy

EDGE = np.array([-1.05, 0.615, -0.1])
"""The middle of the chassis' edge between legs 2 and 3."""


@pytest.fixture(scope="module")
def ground():
    return wavy([(1.0, 1.2, 0.3, 0.2)])


@pytest.fixture(scope="module")
def rover(athlete, ground):
    return rover_tables(athlete, ground.heights, ground.geometry)


def spare_of(robot, dem, rover, tether, q, T):
    poses = np.empty((7 * robot.leg_count, 3, 4))
    place_rover(q, np.ascontiguousarray(T[:3]), rover, poses)
    return tether_spare(poses, np.ascontiguousarray(T[:3]), tether_tables(robot, dem, tether))


def test_segments_are_as_far_apart_as_their_points(rng):
    """A second method: the least over a fine grid of both, and its bound."""
    for _ in range(200):
        p, q, a, b = rng.normal(size=(4, 3))
        if rng.random() < 0.2:
            b = a + (q - p) * rng.normal()
        s = np.linspace(0, 1, 201)
        one, other = p + s[:, None] * (q - p), a + s[:, None] * (b - a)
        least = np.linalg.norm(one[:, None] - other[None], axis=2).min()
        found = segments_apart(p, q, a, b)
        assert found <= least + 1e-12
        assert found >= least - 0.005 * (np.linalg.norm(q - p) + np.linalg.norm(b - a))


def test_nothing_is_nearer_than_told(athlete, ground, rover, rng):
    """Legs and ground by coal's exact meshes."""
    meshes = robot_meshes(athlete.description)
    bodies = {part: MovingBody(meshes[part]).shape for part in PARTS}
    surface = MovingBody(triangulate(ground)).shape
    free = 0
    for _ in range(60):
        q = athlete.posture("stand") + 0.15 * rng.normal(size=36)
        tilt = 0.1 * rng.normal(), 0.1 * rng.normal()
        T = transform(rotation_rpy(*tilt, rng.uniform(-3, 3)), (0, 0, rng.uniform(1.3, 1.8)))
        end = T[:3, :3] @ EDGE + T[:3, 3]
        out = T[:3, :3] @ np.array([-1.0, 0.58, rng.uniform(-0.4, 0.4)])
        tether = Tether(end + out * rng.uniform(1.0, 3.0), EDGE, clearance=0.05, bare=0.3)
        told, what = spare_of(athlete, ground, rover, tether, q, T)
        line = line_between(end, tether.anchor)
        links = link_poses(athlete, q)
        least = min(
            apart_from(line, bodies[part], T @ links[link_name(leg, part)]) for leg in athlete.legs for part in PARTS
        )
        toward = (tether.anchor - end) / np.linalg.norm(tether.anchor - end)
        low = apart_from(line_between(end, tether.anchor - 0.3 * toward), surface, np.eye(4))
        if what != DECK:
            assert told <= min(least, low) - tether.clearance + 1e-3, beside_tether(what)
        free += told > 0
    assert free > 10


def test_what_is_in_the_way_is_told(athlete, ground, rover):
    q, T = athlete.posture("stand"), transform(translation=(0.0, 0.0, 1.6))
    anchor = np.array([-4.0, 2.35, 1.4])
    free, _ = spare_of(athlete, ground, rover, Tether(anchor, EDGE), q, T)
    assert free > 0
    rocky = add_rocks(ground, np.array([[-2.6, 1.5, 1.4, 1.6]]))
    spare, what = spare_of(athlete, rocky, rover, Tether(anchor, EDGE), q, T)
    assert spare < 0
    assert what == GROUND
    assert beside_tether(what) == "the terrain"
    # across the chassis, along a leg, and longer than there is
    assert spare_of(athlete, ground, rover, Tether(-anchor + [0, 0, 3.0], EDGE), q, T)[1] == DECK
    leg = np.append(2.2 * np.array([-1.0, 0.0]), 1.4)
    spare, what = spare_of(athlete, ground, rover, Tether(leg, EDGE), q, T)
    assert spare < 0
    assert what // 7 == 3
    assert beside_tether(what).startswith("leg 3")
    spare, what = spare_of(athlete, ground, rover, Tether(anchor, EDGE, free_length=3.0), q, T)
    assert what == REEL
    assert spare == pytest.approx(3.0 - np.linalg.norm(anchor - EDGE - [0, 0, 1.6]))


def test_without_a_tether_there_is_always_room(athlete, ground, rover):
    assert spare_of(athlete, ground, rover, None, athlete.posture("stand"), np.eye(4))[0] == np.inf
