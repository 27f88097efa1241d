"""Lines over images: on the ground, in the image, and only where nothing nearer hides them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core import frames
from footfall.core.errors import InvalidInput
from footfall.sim.raycast import RayScene
from footfall.telemetry.images import Camera
from footfall.telemetry.projection import in_image, sight
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import plane
from footfall.terrain.ground.drape import draped_grid
from footfall.terrain.ground.image_lines import seen, seen_lines
from footfall.terrain.ground.line_of_sight import TOLERANCE, in_sight
from footfall.terrain.ground.surface import height_at, pick
from footfall.terrain.ground.triangulate import triangulate


def looking(x: float, y: float, z: float, heading: float, down: float) -> np.ndarray:
    """T_site_camera of a camera at a place, with level image rows; angles [rad]."""
    level = frames.transform(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]))
    T = frames.transform(frames.rotation("z", heading)) @ frames.transform(frames.rotation("y", down)) @ level
    T[:3, 3] = x, y, z
    return T


CAMERA = Camera("test", 320, 240, 200.0, 200.0, 159.5, 119.5, np.eye(4))
X, Y = np.meshgrid(np.linspace(-4.0, 4.0, 161), np.linspace(-4.0, 4.0, 161))
WAVES = from_heights(0.12 * np.sin(2 * X) * np.cos(1.7 * Y), 0.05, -4.0, -4.0)
STEEPEST = max(float(np.abs(slope).max()) for slope in np.gradient(WAVES.heights, WAVES.geometry.resolution)) * 2**0.5
places = st.tuples(*[st.floats(-4.0, 4.0)] * 2)


@given(
    eye=st.tuples(*[st.floats(-5.0, 5.0)] * 2, st.floats(0.3, 3.0)), points=st.lists(places, min_size=1, max_size=30)
)
def test_embree_sees_what_is_in_sight(rocks, embree, eye, points):
    """Hidden points lie behind a hit; over free ones the ground rises by hardly more than the tolerance."""
    eye = np.array([*eye[:2], eye[2] + float(height_at(rocks, *eye[:2]))])
    xy = np.array(points)
    above = np.column_stack([xy, height_at(rocks, xy[:, 0], xy[:, 1]) + TOLERANCE])
    free = in_sight(rocks, eye, above)
    hits = embree.first_hits(eye, above - eye)
    blocked = (hits.body >= 0) & (hits.distance < 1.0)
    assert blocked[~free].all()
    deep = np.array([_depth(rocks, eye, point) for point in above])
    assert (deep[~free] > TOLERANCE).all()
    assert (deep[free] < TOLERANCE + 0.05).all()


def _depth(dem, eye, point) -> float:
    """By how much the ground rises over a line of sight at most [m], looked at a hundred times as often."""
    t = np.linspace(0.0, 1.0, 50_000)[:, None]
    line = eye + t * (point - eye)
    return float(np.nanmax(height_at(dem, line[:, 0], line[:, 1]) - line[:, 2]))


@pytest.fixture(scope="module")
def embree(rocks):
    return RayScene([triangulate(rocks)])


def test_unknown_ground_hides_nothing():
    heights = np.zeros((41, 41))
    heights[:, 20] = 3.0
    wall, gap = from_heights(heights, 0.1, -2.0, -2.0), heights.copy()
    gap[:, 19:22] = np.nan
    eye, behind = (-1.5, 0.0, 1.0), np.array([[1.5, 0.0, 0.0], [1.5, 0.3, 4.0]])
    assert in_sight(wall, eye, behind).tolist() == [False, False]
    assert in_sight(from_heights(gap, 0.1, -2.0, -2.0), eye, behind).tolist() == [True, True]
    assert in_sight(wall, eye, np.array([[-0.2, 0.0, 0.1]])).tolist() == [True]


@given(center=st.tuples(*[st.floats(-1.9, 1.9)] * 2), spacing=st.floats(0.2, 2.0), reach=st.floats(0.5, 3.9))
def test_a_grid_lies_on_the_ground_at_whole_multiples(rocks, center, spacing, reach):
    lines = draped_grid(rocks, center, reach, spacing)
    for line in lines:
        assert np.array_equal(line[:, 2], height_at(rocks, line[:, 0], line[:, 1]), equal_nan=True)
        assert np.abs(line[:, :2] - center).max() <= reach + 1e-9
        (fixed,) = (column[0] for column in line.T[:2] if np.ptp(column) == 0)
        assert abs(fixed / spacing - round(fixed / spacing)) < 1e-6
    low, high = np.array(center) - reach, np.array(center) + reach
    assert len(lines) == (np.floor(high / spacing) - np.ceil(low / spacing) + 1).sum()


def test_a_grid_ends_where_the_ground_does():
    heights = np.zeros((21, 21))
    heights[:, 10:] = np.nan
    lines = draped_grid(from_heights(heights, 0.1, -1.0, -1.0), (0.0, 0.0), 5.0)
    assert all(np.abs(line[:, :2]).max() <= 1.0 for line in lines)
    for line in lines:
        assert np.array_equal(np.isnan(line[:, 2]), line[:, 0] > -0.1 + 1e-6)
    for spacing, reach in ((0.0, 1.0), (0.5, 0.0), (0.5, np.inf), (-1.0, 1.0)):
        with pytest.raises(InvalidInput):
            draped_grid(plane(), (0.0, 0.0), reach, spacing)


@given(x=st.floats(-2, 2), y=st.floats(-2, 2), heading=st.floats(-3, 3), down=st.floats(0.3, 1.4))
def test_what_is_drawn_is_what_the_pixels_show(x, y, heading, down):
    """Back from the image: rays of the drawn pixels meet the ground on a line of the grid."""
    T = looking(x, y, float(height_at(WAVES, x, y)) + 1.5, heading, down)
    drawn = seen_lines(WAVES, CAMERA, T, draped_grid(WAVES, (x, y), 6.0))
    assert drawn
    for line in drawn:
        assert len(line) >= 2
        assert in_image(CAMERA, line).all()
        for u, v in line[[0, len(line) // 2, -1]]:
            direction = T[:3, :3] @ sight(CAMERA, u, v)
            closing = -direction[2] / np.hypot(*direction[:2]) - STEEPEST
            point = pick(WAVES, T[:3, 3], direction)
            if point is None or closing < 0.1:
                continue  # the far rim of the map, or a ray that all but grazes
            # a line may be seen through ground that is higher by the tolerance
            assert np.abs(point[:2] - 0.5 * np.round(point[:2] / 0.5)).min() < TOLERANCE / closing + 1e-6


def test_a_line_is_cut_where_something_stands_before_it():
    flat = plane()
    T = looking(-1.0, 0.0, 1.5, 0.0, 0.7)
    line = np.column_stack([np.full(81, 0.8), np.linspace(-2.0, 2.0, 81), np.zeros(81)])
    (whole,) = seen_lines(flat, CAMERA, T, [line])
    assert np.ptp(whole[:, 1]) < 0.01  # it runs across the image
    covered = np.zeros((240, 320), bool)
    covered[:, 100:140] = True
    halves = sorted(seen_lines(flat, CAMERA, T, [line], covered), key=lambda one: one[0, 0])
    assert [half[:, 0].min() < 100 for half in halves] == [True, False]
    assert all(((half[:, 0] < 99.6) | (half[:, 0] > 139.4)).all() for half in halves)
    assert seen_lines(flat, CAMERA, T, []) == []
    pixels, visible = seen(flat, CAMERA, T, np.array([[-3.0, 0.0, 1.0], [np.nan, 0.0, 0.0], [0.5, 0.0, -0.2]]))
    assert visible.tolist() == [False, False, False]  # behind the lens, nowhere, under the ground
    assert np.isnan(pixels[:2]).all()
