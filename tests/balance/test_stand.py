"""Standing on the ground: every wheel touches, the chassis is level, the forces hold."""

import numpy as np
import pytest

from footfall.core.errors import InvalidInput, NotFound
from footfall.core.frames import apply, rotation, transform
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.planning.body.stand import stand
from footfall.planning.scene.under_links import ground_near_links
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import wheel_centers, wheel_pose
from footfall.robot.meshes.collision import posture_collisions
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at, normal_at
from footfall.terrain.ground.triangulate import triangulate

RESOLUTION = 0.1
SPAN = 8.0


def ground(height):
    """Terrain from a function of x and y [m], 8 × 8 m about the origin."""
    count = round(SPAN / RESOLUTION) + 1
    grid = GridGeometry(-SPAN / 2, -SPAN / 2, RESOLUTION, count, count)
    x, y = np.moveaxis(grid.centers(), -1, 0)
    return Dem((height(x, y) + 0 * x).astype(np.float32), grid, "ground", Provenance({}))


def require_standing(robot, dem, state, yaw):
    q, T = state.posture, state.T_site_base
    assert (q >= robot.lower).all()
    assert (q <= robot.upper).all()
    assert T[:3, 2] == pytest.approx([0, 0, 1], abs=1e-12)
    assert np.arctan2(T[1, 0], T[0, 0]) == pytest.approx(yaw)
    contacts, normals = [], []
    for leg in robot.legs:
        # an upright wheel's x points along the normal into the ground
        normal = -(T @ wheel_pose(robot, q, leg))[:3, 0]
        found = contact_point(robot, q, leg, T, normal)
        assert found[2] == pytest.approx(float(height_at(dem, found[0], found[1])), abs=1e-9)
        assert normal == pytest.approx(normal_at(dem, found[0], found[1], robot.wheel_radius), abs=1e-9)
        contacts.append(found)
        normals.append(normal)
    weight = robot.mass * 9.81
    assert state.wheel_forces.sum(axis=0) == pytest.approx([0, 0, weight], abs=1e-6 * weight)
    along = np.einsum("kc,kc->k", state.wheel_forces, np.array(normals))
    assert (along > 0).all()
    assert not posture_collisions(robot, q, T, triangulate(dem))


def test_on_flat_ground_it_takes_the_named_posture(athlete):
    state = stand(athlete, ground(lambda x, y: 0.7))
    assert state.posture == pytest.approx(athlete.posture("stand"), abs=1e-9)
    assert state.T_site_base[2, 3] == pytest.approx(0.7 + 0.242 - wheel_centers(athlete, state.posture)[0, 2], abs=1e-6)
    assert state.robot == "athlete"
    assert state.mode == "idle"
    assert state.time == 0.0
    # six equal wheels share the weight; by symmetry every leg carries the same torques
    assert state.wheel_forces[:, 2] == pytest.approx(np.full(6, athlete.mass * 9.81 / 6), rel=1e-6)
    torques = state.joint_torques.reshape(6, 6)
    assert torques == pytest.approx(np.broadcast_to(torques[0], (6, 6)), abs=1e-3)
    require_standing(athlete, ground(lambda x, y: 0.7), state, 0.0)


@pytest.mark.parametrize(
    ("name", "height"),
    [
        ("slope", lambda x, y: 0.12 * x - 0.05 * y),
        ("waves", lambda x, y: 0.12 * np.sin(1.5 * x) * np.cos(1.1 * y + 0.4)),
        ("step", lambda x, y: 0.2 * np.clip((x - 0.4) / 0.3, 0, 1)),
        ("pit under one leg", lambda x, y: -0.3 * np.exp(-((x - 2.3) ** 2 + y**2) / 0.5)),
    ],
)
def test_every_wheel_touches_the_ground(athlete, name, height):
    dem = ground(height)
    state = stand(athlete, dem, yaw=0.3)
    require_standing(athlete, dem, state, 0.3)
    assert state.digest == stand(athlete, dem, yaw=0.3).digest


def test_it_raises_the_chassis_off_a_hill(athlete):
    dem = ground(lambda x, y: 1.57 * np.exp(-((x**2 + y**2) ** 2) / 0.4))
    state = stand(athlete, dem)
    usual = 0.242 - wheel_centers(athlete, athlete.posture("stand"))[0, 2]
    assert state.T_site_base[2, 3] > usual + 0.03
    require_standing(athlete, dem, state, 0.0)


def test_a_wheel_moves_aside_where_the_ground_drops_away(athlete):
    usual = wheel_centers(athlete, athlete.posture("stand"))[0, :2]
    dem = ground(lambda x, y: -1.6 * np.exp(-(((x - usual[0]) ** 2 + (y - usual[1]) ** 2) ** 2) / 0.004))
    state = stand(athlete, dem)
    require_standing(athlete, dem, state, 0.0)
    moved = np.hypot(*(apply(state.T_site_base, wheel_centers(athlete, state.posture))[0, :2] - usual))
    assert moved > 0.1


def test_other_postures_and_places(athlete):
    dem = ground(lambda x, y: 0.02 * x)
    crouch = stand(athlete, dem, x=0.4, y=-0.3, yaw=2.0, posture="crouch")
    tall = stand(athlete, dem, x=0.4, y=-0.3, yaw=2.0, posture="tall")
    assert crouch.T_site_base[:2, 3] == pytest.approx([0.4, -0.3])
    assert crouch.T_site_base[2, 3] < tall.T_site_base[2, 3]


def test_refusals_name_the_leg_and_the_reason(athlete):
    flat = ground(lambda x, y: 0.0)
    with pytest.raises(InvalidInput, match=r"unknown under leg 0 at .*the map spans"):
        stand(athlete, flat, x=3.0)
    with pytest.raises(InvalidInput, match="finite x and y"):
        stand(athlete, flat, x=float("nan"))
    with pytest.raises(NotFound, match="posture"):
        stand(athlete, flat, posture="dance")
    cliff = ground(lambda x, y: -2.5 * np.clip((x - 1.4) / 0.2, 0, 1))
    with pytest.raises(InvalidInput, match=r"no joint angles put leg 0 at|no one chassis height"):
        stand(athlete, cliff)
    steep = ground(lambda x, y: 0.85 * x)
    with pytest.raises(InvalidInput, match="leg"):
        stand(athlete, steep)
    tower = ground(lambda x, y: 2.6 * np.exp(-((x**2 + y**2) ** 2) / 0.4))
    with pytest.raises(InvalidInput, match="apart"):
        stand(athlete, tower)


def test_ground_near_the_links_answers_as_all_of_it(athlete, rng):
    free = collided = below = 0
    for _ in range(40):
        roughness = rng.uniform(0.0, 0.3)
        phase = rng.uniform(0, 6, 4)
        dem = ground(lambda x, y, r=roughness, p=phase: r * np.sin(2 * x + p[0]) * np.cos(3 * y + p[1]) + 0.05 * x)
        holes = np.where(rng.random(dem.heights.shape) < 0.03, np.nan, dem.heights).astype(np.float32)
        dem = Dem(holes, dem.geometry, "holes", Provenance({}))
        q = np.clip(athlete.posture("stand") + rng.uniform(0, 0.2) * rng.normal(size=36), athlete.lower, athlete.upper)
        T = transform(rotation("z", rng.uniform(-3, 3)), (*rng.uniform(-3, 3, 2), rng.uniform(-1.0, 3.5)))
        found = posture_collisions(athlete, q, T, ground_near_links(athlete, dem, q, T))
        whole = posture_collisions(athlete, q, T, triangulate(dem))
        assert [(c.link_a, c.link_b, c.required) for c in found] == [(c.link_a, c.link_b, c.required) for c in whole]
        assert [c.distance for c in found] == pytest.approx([c.distance for c in whole], abs=1e-9)
        hits = [c for c in whole if c.link_b == "terrain"]
        free, collided, below = (
            free + (not hits),
            collided + any(c.distance >= 0 for c in hits),
            below + any(c.distance < 0 for c in hits),
        )
    assert min(free, collided, below) > 5


def test_the_ground_near_the_links_is_a_small_part(athlete):
    dem = ground(lambda x, y: 0.02 * x)
    state = stand(athlete, dem)
    near = ground_near_links(athlete, dem, state.posture, np.asarray(state.T_site_base))
    # under six wheels, seen from above, and nothing under the chassis, which is higher than it must be
    assert 6 * 2 * 9 <= len(near.triangles) < len(triangulate(dem).triangles) / 10
    assert not (np.hypot(*near.vertices[:, :2].T) < 1.0).any()
