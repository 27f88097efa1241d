"""Contour lines: every piece lies on the ground, and together they part what is above from what is below."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal
from footfall.terrain.ground.contours import MOST_LEVELS, contour_step, contours
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate


def with_holes(seed):
    dem = fractal(size=2.0, resolution=0.1, roughness=0.05, seed=seed)
    heights = dem.heights.copy()
    heights[np.random.default_rng(seed).random(heights.shape) < 0.05] = np.nan
    return from_heights(heights, 0.1, -1.0, -1.0, "holes")


@given(st.integers(0, 30), st.sampled_from([0.01, 0.03, 0.1]))
def test_every_piece_lies_on_the_ground_at_a_whole_level(seed, step):
    dem = with_holes(seed)
    pieces = contours(dem, step)
    assert np.abs(pieces[..., 2] / step - np.rint(pieces[..., 2] / step)).max(initial=0.0) < 1e-9
    assert np.array_equal(pieces[:, 0, 2], pieces[:, 1, 2])
    # the middle of a piece is inside its triangle, not on an edge
    middle = pieces.mean(axis=1)
    off = height_at(dem, middle[:, 0], middle[:, 1]) - middle[:, 2]
    assert np.abs(off).max(initial=0.0) < 1e-5


@given(st.integers(0, 30))
def test_an_edge_is_crossed_as_often_as_levels_lie_between_its_ends(seed):
    """Counted along the triangles' edges, without cutting anything: two crossings make a piece."""
    step, dem = 0.02, with_holes(seed)
    mesh = triangulate(dem)
    heights = np.asarray(mesh.vertices, float)[:, 2][mesh.triangles]
    below = np.floor((heights + 1e-12) / step)
    crossings = sum(np.abs(below[:, i] - below[:, (i + 1) % 3]).sum() for i in range(3))
    assert crossings == 2 * len(contours(dem, step))


def test_a_cone_has_circles():
    xs = np.linspace(-1.0, 1.0, 201)
    x, y = np.meshgrid(xs, xs)
    dem = from_heights((1.5 - np.hypot(x, y)).astype(np.float32), 0.01, -1.0, -1.0, "cone")
    pieces = contours(dem, 0.5)
    own = pieces[np.abs(pieces[:, 0, 2] - 1.0) < 1e-6]
    assert np.abs(np.linalg.norm(own[..., :2], axis=2) - 0.5).max() < 0.001
    length = np.linalg.norm(own[:, 1] - own[:, 0], axis=1).sum()
    assert length == pytest.approx(2 * np.pi * 0.5, rel=0.01)


def test_level_ground_has_no_line_even_at_a_level():
    assert contours(from_heights(np.full((5, 5), 0.2, np.float32), 0.1, 0.0, 0.0, "level"), 0.1).shape == (0, 2, 3)


@pytest.mark.parametrize(
    ("relief", "step"), [(0.05, 0.1), (1.9, 0.1), (2.1, 0.2), (9.0, 0.5), (19.0, 1.0), (300.0, 20.0)]
)
def test_the_step_is_round_and_gives_few_lines(relief, step):
    dem = from_heights(np.array([[0.0, 0.0], [relief, relief]], np.float32), 1.0, 0.0, 0.0, "ramp")
    assert contour_step(dem) == pytest.approx(step)
    assert relief / contour_step(dem) <= MOST_LEVELS + 1e-6


@pytest.mark.parametrize("step", [0.0, -1.0, float("nan"), float("inf")])
def test_no_step_is_refused(step):
    with pytest.raises(InvalidInput, match="positive step"):
        contours(with_holes(0), step)
