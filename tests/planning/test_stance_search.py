"""Standing on steep ground: judged by meshes, forces and the recheck's own means, not by the search's kernels."""

import numpy as np
import pytest

from benchmarks.walks.terrains import start_of, terrain
from footfall.planning.stance.stand import stand
from footfall.planning.walk.stance_search import LEANS, TURNED, WITHIN
from footfall.robot.collision import posture_collisions
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import wheel_pose
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate

STEEP = 10_019
"""Ground on which no level stance was found."""


@pytest.fixture(scope="module")
def dem():
    return terrain("steep", STEEP)


def test_it_stands_near_the_place_where_a_level_chassis_can_not(athlete, dem):
    x, y = start_of(2.75)
    state = stand(athlete, dem, x, y)
    q, T = state.posture, state.T_site_base
    roll, pitch = np.arctan2(T[2, 1], T[2, 2]), -np.arcsin(T[2, 0])
    assert 0.02 < max(abs(roll), abs(pitch)) <= LEANS
    assert np.hypot(T[0, 3] - x, T[1, 3] - y) <= WITHIN
    assert abs(np.arctan2(T[1, 0], T[0, 0])) <= TURNED
    assert (q >= athlete.lower).all()
    assert (q <= athlete.upper).all()
    assert not posture_collisions(athlete, q, T, triangulate(dem))
    contacts = []
    for leg in athlete.legs:
        normal = -(T @ wheel_pose(athlete, q, leg))[:3, 0]
        contacts.append(contact_point(athlete, q, leg, T, normal))
        assert contacts[-1][2] == pytest.approx(float(height_at(dem, *contacts[-1][:2])), abs=1e-6)
    weight = athlete.mass * 9.81
    assert state.wheel_forces.sum(axis=0) == pytest.approx([0, 0, weight], abs=1e-6 * weight)
    assert state.digest == stand(athlete, dem, x, y).digest
