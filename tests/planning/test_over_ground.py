"""The point of a legged robot that is lowest over the ground: held against every point, one numpy array a body."""

import numpy as np
import pytest

from footfall.io.any_robot import load_legged
from footfall.planning.legged.over_ground import FINEST, Surfaces
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal
from footfall.terrain.ground.surface import height_at
from tests.support.described import robot_of

AMBLER = load_legged("ambler")


def lowest(surfaces: Surfaces, dem, where, T) -> tuple[float, int]:
    """Height and body, of all points of all bodies but those around the soles."""
    soles = where.soles @ T[:3, :3].T + T[:3, 3]
    found = np.inf, -1
    for body, own in enumerate(surfaces._points):
        Tb = T @ where.Ts_base_body[body]
        points = own @ Tb[:3, :3].T + Tb[:3, 3]
        for leg in AMBLER.legs:
            if AMBLER.slices[leg].stop == body:
                points = points[np.linalg.norm(points - soles[leg], axis=1) > surfaces._near[leg]]
        over = points[:, 2] - height_at(dem, points[:, 0], points[:, 1])
        if len(over) and over.min() < found[0]:
            found = float(over.min()), body
    return found


@pytest.mark.parametrize("seed", range(3))
def test_it_is_the_lowest_of_all_points(seed):
    dem = fractal(20.0, 0.1, roughness=0.3, seed=seed)
    surfaces, rng = Surfaces(AMBLER), np.random.default_rng(seed)
    near = 0
    for q in rng.uniform(np.maximum(AMBLER.lower, -3.0), np.minimum(AMBLER.upper, 3.0), (20, len(AMBLER.lower))):
        where, T = placed(AMBLER, q), np.eye(4)
        T[:3, 3] = *rng.uniform(-2, 2, 2), rng.uniform(2.0, 5.0)
        height, body = lowest(surfaces, dem, where, T)
        told = surfaces.lowest(dem, where, T)
        if height > 2 * surfaces.clearance:
            assert told.height > 2 * surfaces.clearance - 1e-9  # those that are higher are not told apart
            continue
        near += 1
        assert told.height == pytest.approx(height, abs=1e-9)
        assert told.body == body
        assert told.place[2] - height_at(dem, *told.place[:2]) == pytest.approx(height, abs=1e-9)
    assert near > 5


def test_over_unknown_ground_nothing_is_told():
    heights = np.zeros((80, 80))
    heights[:, 60:] = np.nan
    dem = from_heights(heights, 0.1, x0=-4.0, y0=-4.0)
    where, T = placed(AMBLER, (AMBLER.lower + AMBLER.upper) / 2), np.eye(4)
    T[:3, 3] = 1.5, 0.0, 2.2
    assert np.isnan(Surfaces(AMBLER).lowest(dem, where, T).height)


def test_points_are_no_nearer_to_each_other_than_a_share_of_the_leg():
    model, length = robot_of(4)[1].model, robot_of(4)[1].length
    surfaces = [Surfaces(LeggedRobot(model, clearances={"ground": one})) for one in (0.0, 1e-4, FINEST * length)]
    counts = [sum(map(len, one._points)) for one in surfaces]
    assert counts[0] == counts[1] == counts[2]
