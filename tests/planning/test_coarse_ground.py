"""Ground with cells as large as the rover: steps and maps are answered as on small cells of that surface."""

import numpy as np
import pytest

import footfall
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.robot.kinematics import wheel_centers
from footfall.terrain.generate import slope


@pytest.mark.parametrize("resolution", [5.0, 20.0])
def test_a_step_is_planned_as_on_small_cells_of_the_same_surface(athlete, resolution):
    coarse, fine = (slope(size=size, resolution=cell, angle=0.05) for size, cell in ((200.0, resolution), (10.0, 0.1)))
    state = footfall.stand(athlete, fine)
    wheel = apply(np.asarray(state.T_site_base), wheel_centers(athlete, state.posture))[2]
    for out, status in ((0.93, Status.FOUND), (1.6, Status.GOAL_INVALID)):
        target = (out * wheel[0], out * wheel[1])
        answers = [footfall.plan_step(athlete, dem, state, leg=2, target=target, seed=1) for dem in (coarse, fine)]
        assert [answer.status for answer in answers] == [status, status], answers[0].reason
    maps = footfall.compute_maps(athlete, coarse, state, leg=2)
    assert set(maps.layers) == set(footfall.compute_maps(athlete, fine, state, leg=2).layers)
