"""Standing on steep ground: judged by meshes, forces and the recheck's own means, not by the search's kernels."""

import numpy as np
import pytest

from benchmarks.walks.terrains import start_of, terrain
from footfall.core.errors import InvalidInput
from footfall.planning.walk.stance_search import LEANS, TURNED, WITHIN
from footfall.planning.walk.stand_to_walk import stand
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import wheel_pose
from footfall.robot.meshes.collision import posture_collisions
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


def test_another_posture_is_not_replaced_by_one_that_nobody_asked_for(athlete, dem):
    with pytest.raises(InvalidInput, match=r"can't stand|no joint angles|no one height"):
        stand(athlete, dem, *start_of(2.75), posture="crouch")


def test_where_the_ground_is_unknown_nothing_is_searched(athlete, dem):
    west, south, _, _ = dem.geometry.bounds
    with pytest.raises(InvalidInput, match="the ground is unknown under leg 0") as refused:
        stand(athlete, dem, west - 5.0, south - 5.0)
    assert "nor was a stance found" not in refused.value.message


def test_where_the_search_finds_nothing_either_both_are_told(athlete, dem, monkeypatch):
    monkeypatch.setattr("footfall.planning.walk.stand_to_walk.search_stance", lambda *asked: None)
    with pytest.raises(InvalidInput, match=r"nor was a stance found with the chassis up to 0\.15 m"):
        stand(athlete, dem, *start_of(2.75))
