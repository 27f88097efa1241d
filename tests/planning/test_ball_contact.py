"""A rim that comes down stands on the highest bump under it: against closed forms, and no ground is inside it."""

import numpy as np
import pytest

from footfall.planning.compliance.ball_contact import APART, ball_contacts, second_gaps
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, slope
from footfall.terrain.ground.surface import height_at

RADIUS = 0.35


def test_on_a_slope_it_touches_uphill(rng):
    angle, uphill = 0.3, 0.7
    ground = slope(size=4.0, resolution=0.05, angle=angle, uphill=uphill)
    centers = np.column_stack([rng.uniform(-1, 1, (20, 2)), rng.uniform(0, 2, 20)])
    points, normals, known = ball_contacts(ground, centers, RADIUS)
    assert known.all()
    normal = np.array([-np.sin(angle) * np.cos(uphill), -np.sin(angle) * np.sin(uphill), np.cos(angle)])
    assert np.abs(normals - normal).max() < 2e-3
    assert np.abs(points[:, :2] - (centers - RADIUS * normal)[:, :2]).max() < 1e-3
    assert np.abs(points[:, 2] - height_at(ground, points[:, 0], points[:, 1])).max() < 1e-9


def test_beside_a_boulder_it_touches_the_boulder():
    x = np.arange(-2.0, 2.001, 0.01)
    X, Y = np.meshgrid(x, x)
    boulder, top = 0.5, 0.3
    heights = np.maximum(0.0, np.sqrt(np.maximum(boulder**2 - X**2 - Y**2, 0.0)) - (boulder - top))
    ground = from_heights(heights.astype(np.float32), 0.01, -2.0, -2.0, "boulder")
    away = 0.35
    points, normals, _ = ball_contacts(ground, np.array([[away, 0.0, 1.0]]), RADIUS)
    # the centres of both balls and the contact are on one line
    across = away / (boulder + RADIUS)
    assert normals[0] == pytest.approx([across, 0.0, np.sqrt(1 - across**2)], abs=5e-3)
    assert points[0, 0] == pytest.approx(boulder * across, abs=2e-3)


def test_no_ground_is_inside_the_ball_that_came_down(rng):
    ground = fractal(size=4.0, resolution=0.05, roughness=0.05, seed=3)
    centers = np.column_stack([rng.uniform(-1.2, 1.2, (30, 2)), np.zeros(30)])
    points, normals, known = ball_contacts(ground, centers, RADIUS)
    assert known.all()
    down = points + RADIUS * normals
    assert np.abs(down[:, :2] - centers[:, :2]).max() < 1e-9
    offsets = rng.uniform(-RADIUS, RADIUS, (20000, 2))
    offsets = offsets[np.hypot(*offsets.T) < RADIUS]
    x, y = down[:, :1] + offsets[:, 0], down[:, 1:2] + offsets[:, 1]
    bottom = down[:, 2:] - np.sqrt(RADIUS**2 - np.sum(offsets**2, axis=1))
    assert (height_at(ground, x, y) - bottom).max() < 5e-4


def test_unknown_ground_below_the_middle_is_told():
    heights = np.zeros((81, 81), np.float32)
    heights[40, 40] = np.nan
    ground = from_heights(heights, 0.05, -2.0, -2.0, "hole")
    centers = np.array([[0.0, 0.0, 0.3], [0.3, 0.0, 0.3], [1.0, 0.0, 0.3]])
    points, normals, known = ball_contacts(ground, centers, RADIUS)
    assert known.tolist() == [False, True, True]
    assert np.isnan(points[0]).all()
    assert np.isnan(normals[0]).all()
    assert normals[1:] == pytest.approx(np.tile([0.0, 0.0, 1.0], (2, 1)))


def standing(ground, centers):
    """Balls that stand there and where they touch."""
    points, normals, _ = ball_contacts(ground, centers, RADIUS)
    return points + RADIUS * normals, points


def test_on_a_plane_there_is_one_side_only(rng):
    ground = slope(size=4.0, resolution=0.05, angle=0.3, uphill=0.7)
    balls, points = standing(ground, np.column_stack([rng.uniform(-1, 1, (20, 2)), np.zeros(20)]))
    gaps = second_gaps(ground, balls, points, RADIUS)
    assert gaps == pytest.approx(RADIUS * (1 / np.cos(APART) - 1), abs=3e-3)


@pytest.mark.parametrize("away", [0.0, 0.002, 0.01, -0.004])
def test_beside_a_step_it_leans_by_how_far_the_edge_is(away):
    x = np.arange(-2.0, 2.001, 0.005)
    X, _ = np.meshgrid(x, x)
    height = 0.12
    heights = np.where(X >= 0, height, 0.0).astype(np.float32)
    ground = from_heights(heights, 0.005, -2.0, -2.0, "step")
    # where a ball on the lower floor touches the edge, and that much farther off
    reach = np.sqrt(RADIUS**2 - (RADIUS - height) ** 2)
    along = np.linspace(-0.1, 0.1, 4001)
    edge = along[height_at(ground, along, 0 * along) > height - 1e-6].min()
    ball = np.array([[edge - reach - away, 0.0, RADIUS]])
    gap = second_gaps(ground, ball, np.array([[ball[0, 0], 0.0, 0.0]]), RADIUS)[0]
    assert gap == pytest.approx(np.hypot(reach + away, RADIUS - height) - RADIUS, abs=2e-3)


def test_ground_that_nobody_saw_is_no_side():
    heights = np.zeros((81, 81), np.float32)
    heights[:, 50:] = np.nan
    ground = from_heights(heights, 0.05, -2.0, -2.0, "edge")
    balls, points = standing(ground, np.array([[0.2, 0.0, 0.0]]))
    assert second_gaps(ground, balls, points, RADIUS)[0] == pytest.approx(RADIUS * (1 / np.cos(APART) - 1), abs=3e-3)
