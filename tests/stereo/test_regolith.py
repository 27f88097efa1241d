import numpy as np

from footfall.sim.regolith import SIZE, TEXEL, grain


def test_grain_depends_on_the_point_alone(rng):
    points = rng.uniform(-20, 20, (500, 3))
    footprint = rng.uniform(0.002, 0.05, 500)
    whole = grain(points, footprint)
    order = rng.permutation(500)
    assert np.array_equal(grain(points[order], footprint[order]), whole[order])
    assert np.array_equal(grain(points[:77], footprint[:77]), whole[:77])
    assert not np.allclose(grain(points, footprint, seed=1), whole)


def test_grain_has_zero_mean_and_unit_deviation(rng):
    points = rng.uniform(0, SIZE * TEXEL, (20000, 3))
    values = grain(points, np.full(20000, TEXEL))
    assert abs(values.mean()) < 0.05
    assert 0.8 < values.std() < 1.1


def test_wide_pixels_see_only_long_waves(rng):
    points = rng.uniform(0, 10, (4000, 3))
    step = np.array([0.02, 0.0, 0.0])
    change = []
    for width in (0.005, 0.02, 0.08):
        footprint = np.full(len(points), width)
        change.append(np.abs(grain(points + step, footprint) - grain(points, footprint)).mean())
    assert change[0] > 1.5 * change[1] > 3.0 * change[2]


def test_grain_changes_continuously_between_resolutions(rng):
    points = rng.uniform(0, 10, (1000, 3))
    below, above = (grain(points, np.full(1000, TEXEL * 2 * factor)) for factor in (1 - 1e-9, 1 + 1e-9))
    assert np.abs(below - above).max() < 1e-6


def test_vertical_faces_are_not_smeared(rng):
    """Going straight up or along any face changes the grain as much as going sideways."""
    points = rng.uniform(0, 10, (4000, 3))
    footprint = np.full(len(points), TEXEL)
    steps = rng.normal(size=(12, 3))
    steps = np.vstack([np.eye(3), steps / np.linalg.norm(steps, axis=1)[:, None]]) * 0.05
    change = [np.abs(grain(points + step, footprint) - grain(points, footprint)).mean() for step in steps]
    assert min(change) > 0.35 * max(change)
