"""Made terrain: shapes, laws and refusals."""

import numpy as np
import pytest

from footfall.core.errors import InvalidTerrain
from footfall.terrain.generate import fractal, plane, rock_field, slope, step
from footfall.terrain.ground.surface import height_at
from footfall.terrain.rocks import add_rocks, covered_fraction, draw_rocks, rocks_per_area


@pytest.mark.parametrize("make", [plane, slope, step, fractal, rock_field])
def test_maps_are_centred_and_repeatable(make):
    dem = make((6.0, 4.0), 0.1)
    assert dem.heights.shape == (41, 61)
    np.testing.assert_allclose(dem.geometry.bounds, (-3, -2, 3, 2), atol=1e-9)
    assert np.isfinite(dem.heights).all()
    assert make((6.0, 4.0), 0.1).digest == dem.digest


def test_slope_and_step_have_the_stated_shape():
    assert height_at(slope(4.0, 0.1, angle=0.2, uphill=np.pi / 2), 1.0, 1.5) == pytest.approx(
        1.5 * np.tan(0.2), abs=1e-6
    )
    stepped = step(4.0, 0.1, height=0.4, edge=0.5)
    np.testing.assert_allclose(height_at(stepped, [0.39, 0.51], 0.0), [0.0, 0.4], atol=1e-6)


@pytest.mark.parametrize("hurst", [0.3, 0.8])
def test_fractal_height_differences_grow_as_distance_to_the_hurst(hurst):
    lags = np.array([2, 4, 8, 16])
    growth = []
    for seed in range(12):
        z = fractal(25.6, 0.1, roughness=0.5, hurst=hurst, seed=seed).heights.astype(float)
        assert z.std() == pytest.approx(0.5, rel=1e-4)
        assert z.mean() == pytest.approx(0.0, abs=1e-6)
        growth.append([np.mean((z[:, n:] - z[:, :-n]) ** 2) + np.mean((z[n:] - z[:-n]) ** 2) for n in lags])
    exponent = np.polyfit(np.log(lags), np.log(np.mean(growth, axis=0)), 1)[0] / 2
    assert exponent == pytest.approx(hurst, abs=0.12)


def test_seeds_give_different_ground():
    assert fractal(4.0, 0.1, seed=1).digest != fractal(4.0, 0.1, seed=2).digest
    assert rock_field(4.0, 0.1, seed=1).digest != rock_field(4.0, 0.1, seed=2).digest
    assert rock_field(4.0, 0.1, seed=1).provenance.seed == 1


@pytest.mark.parametrize("abundance", [0.05, 0.2])
def test_rock_sizes_follow_golombek_and_rapp(abundance, rng):
    side, smallest, largest = 150.0, 0.1, 3.0
    rocks = draw_rocks((0, 0, side, side), abundance, smallest, largest, rng)
    diameter = rocks[:, 2]
    assert diameter.min() >= smallest
    assert diameter.max() <= largest
    for bigger_than in (0.1, 0.2, 0.4, 0.8):
        seen = diameter[diameter >= bigger_than]
        # the ground under rocks is the law itself; its spread is that of a compound Poisson sum
        areas = np.pi / 4 * seen**2
        expected = (covered_fraction(bigger_than, abundance) - covered_fraction(largest, abundance)) * side**2
        assert abs(areas.sum() - expected) < 4 * np.sqrt(np.sum(areas**2)) + 1e-9
        count = rocks_per_area(bigger_than, largest, abundance) * side**2
        assert abs(len(seen) - count) < 4 * np.sqrt(count)
    assert abs(rocks[:, :2].mean() - side / 2) < 4 * side / np.sqrt(12 * 2 * len(rocks))


def test_covered_fraction_at_known_points():
    # q(0.1) = 1.79 + 1.52 = 3.31
    assert covered_fraction(0.0, 0.1) == pytest.approx(0.1)
    assert covered_fraction(1.0, 0.1) == pytest.approx(0.1 * np.exp(-3.31))


def test_a_rock_is_a_half_ellipsoid_on_the_ground():
    dem = add_rocks(slope(4.0, 0.02, angle=0.1), [[0.5, -0.4, 1.0, 0.6], [0.5, -0.4, 0.2, 0.1]])
    ground = np.tan(0.1)
    assert height_at(dem, 0.5, -0.4) == pytest.approx(0.6 + 0.5 * ground, abs=1e-3)
    x = 0.5 + 0.3
    assert height_at(dem, x, -0.4) == pytest.approx(x * ground + 0.6 * np.sqrt(1 - 0.6**2), abs=1e-3)
    assert height_at(dem, 1.2, -0.4) == pytest.approx(1.2 * ground, abs=1e-5)
    assert "dem" in dem.provenance.parents


@pytest.mark.parametrize(
    "make",
    [
        lambda: plane(-1.0, 0.1),
        lambda: plane(1.0, 0.0),
        lambda: plane(1e5, 0.01),
        lambda: slope(4.0, 0.1, angle=2.0),
        lambda: fractal(4.0, 0.1, hurst=1.5),
        lambda: rock_field(4.0, 0.1, abundance=0.0),
        lambda: rock_field(4.0, 0.1, smallest=1.0, largest=0.5),
        lambda: rock_field(400.0, 1.0, abundance=0.5, smallest=1e-3),
        lambda: add_rocks(plane(2.0, 0.1), [[0, 0, -1, 1]]),
    ],
)
def test_impossible_ground_is_refused(make):
    with pytest.raises(InvalidTerrain):
        make()
