"""Scans become cells: against scipy and plain loops, on grounds whose heights are known."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.stats import binned_statistic_2d

from footfall.core.errors import InvalidTerrain
from footfall.core.frames import rotation, transform
from footfall.terrain.gridding import gridded, natural_resolution, placed, terrain_of_scan
from footfall.terrain.ground.surface import height_at
from footfall.terrain.scan import Scan, ScanSettings

PLAIN = ScanSettings(resolution=0.1, outliers=False, least_share=0.0)


def cloud(rng, n, height, noise=0.005, size=4.0):
    xy = rng.uniform(0, size, (n, 2))
    return np.column_stack([xy, height(xy[:, 0], xy[:, 1]) + noise * rng.normal(size=n)])


def waves(x, y):
    return 0.2 * np.sin(x) + 0.1 * np.cos(2 * y)


def test_means_counts_and_variances_are_those_of_scipy(rng):
    points = cloud(rng, 20_000, waves, noise=0.01)
    dem = gridded(points, ScanSettings(resolution=0.1, outliers=False, gap=10.0, deviation=1e3), "cloud")
    assert dem.count is not None
    assert dem.variance is not None
    grid = dem.geometry
    edges: Any = [np.append(axis - 0.05, axis[-1] + 0.05) for axis in (grid.ys, grid.xs)]
    for statistic, found, tolerance in (("mean", dem.heights, 1e-6), ("count", dem.count, 0)):
        told = binned_statistic_2d(points[:, 1], points[:, 0], points[:, 2], statistic, bins=edges).statistic
        np.testing.assert_allclose(found, told, atol=tolerance)
    # so unsure a return that the scatter does not count
    np.testing.assert_allclose(dem.variance, 1e6 / dem.count, rtol=1e-5)


def by_hand(points, settings):
    """The same in plain loops."""
    cells: dict[tuple[int, int], list[float]] = {}
    for x, y, z in points:
        key = (int(np.floor(y / settings.resolution + 0.5)), int(np.floor(x / settings.resolution + 0.5)))
        cells.setdefault(key, []).append(z)
    out = {}
    for key, found in cells.items():
        z = sorted(found)
        parts, part = [], [z[0]]
        for before, one in pairwise(z):
            if one - before > settings.gap:
                parts.append(part)
                part = []
            part.append(one)
        parts.append(part)
        enough = [p for p in parts if len(p) >= max(2.0 if len(z) >= 4 else 1.0, settings.least_share * len(z))] or [z]
        chosen = np.array(enough[0] if settings.vegetation else enough[-1])
        middle = np.median(chosen)
        spread = max(1.4826 * np.median(np.abs(chosen - middle)), settings.deviation)
        used = chosen[np.abs(chosen - middle) <= 3.5 * spread]
        scatter = used.var(ddof=1) if len(used) > 1 else 0.0
        out[key] = (used.mean(), max(scatter, settings.deviation**2) / len(used), len(used))
    return out


@pytest.mark.parametrize("vegetation", [False, True])
def test_cells_with_two_surfaces_are_as_plain_loops_have_them(rng, vegetation):
    points = np.vstack([
        cloud(rng, 4000, waves, noise=0.02),
        cloud(rng, 1500, lambda x, y: waves(x, y) + 0.4, noise=0.05),
        cloud(rng, 60, lambda x, y: rng.uniform(-3, 3, len(x))),
    ])  # fmt: skip
    settings = ScanSettings(resolution=0.2, outliers=False, vegetation=vegetation)
    told = by_hand(points, settings)
    # without the filter by neighbours, which the loops do not have
    from footfall.terrain.gridding_kernel import by_cell, surfaces

    begin, heights = by_cell(points, 0.0, 0.0, 0.2, 21, 21)
    found = [a.reshape(21, 21) for a in surfaces(begin, heights, 0.1, 0.1, 1, 0.01, vegetation)]
    assert len(told) == np.isfinite(found[0]).sum()
    for (row, col), (height, variance, count) in told.items():
        assert found[0][row, col] == pytest.approx(height, abs=1e-9)
        assert found[1][row, col] == pytest.approx(variance, rel=1e-6)
        assert found[2][row, col] == count


def test_the_order_of_the_points_does_not_matter(rng):
    points = cloud(rng, 5000, waves)
    one, other = (gridded(p, ScanSettings(resolution=0.1), "cloud") for p in (points, rng.permutation(points)))
    assert one.digest == other.digest


def test_outliers_above_and_below_are_left_out(rng):
    ground = cloud(rng, 60_000, waves)
    flying = np.column_stack([rng.uniform(0, 4, (300, 2)), rng.uniform(-2, 3, 300)])
    # and some where nothing else is
    ground = ground[np.hypot(ground[:, 0] - 2, ground[:, 1] - 2) > 0.3]
    alone = np.array([[2.0, 2.0, 2.5]])
    points = np.vstack([ground, flying, alone])
    kept = gridded(points, ScanSettings(resolution=0.05, outliers=False), "kept")
    dem = gridded(points, ScanSettings(resolution=0.05), "cloud")
    off = [np.nanmax(np.abs(d.heights - waves(*np.moveaxis(d.geometry.centers(), -1, 0)))) for d in (kept, dem)]
    assert off[0] > 1.0
    known = np.isfinite(dem.heights)
    x, y = np.moveaxis(dem.geometry.centers(), -1, 0)
    assert not (known & (np.abs(dem.heights - waves(x, y)) > 0.25)).any()
    assert known.mean() > 0.93


def test_a_rock_and_a_step_are_no_outliers(rng):
    def ground(x, y):
        return np.where(x > 2.0, 0.3, 0.0) + np.where(np.hypot(x - 1, y - 1) < 0.15, 0.25, 0.0)

    points = cloud(rng, 200_000, ground)
    for settings in (ScanSettings(resolution=0.05), ScanSettings(resolution=0.05, vegetation=True)):
        dem = gridded(points, settings, "rock")
        x, y = np.moveaxis(dem.geometry.centers(), -1, 0)
        inside = np.hypot(x - 1, y - 1) < 0.08
        assert dem.heights[inside] == pytest.approx(0.25, abs=0.02)
        assert np.isfinite(dem.heights[np.abs(x - 2.0) > 0.08]).mean() > 0.98
        assert dem.heights[x > 2.06] == pytest.approx(0.3, abs=0.02)


def test_grass_is_left_out_where_that_is_asked(rng):
    ground = cloud(rng, 40_000, waves)
    blades = cloud(rng, 6_000, lambda x, y: waves(x, y) + rng.uniform(0.2, 0.5, len(x)))
    points = np.vstack([ground, blades])
    x, y = np.moveaxis(gridded(points, PLAIN, "g").geometry.centers(), -1, 0)
    high = [
        np.nanmean(np.abs(gridded(points, ScanSettings(resolution=0.1, vegetation=v), "g").heights - waves(x, y)) > 0.1)
        for v in (False, True)
    ]
    assert high[0] > 0.5
    assert high[1] < 0.005


def test_the_dem_remembers(rng):
    dem = gridded(cloud(rng, 20_000, waves), ScanSettings(resolution=0.1, time=7.0), "lidar.las")
    assert dem.remembers
    assert dem.sources == ("lidar.las",)
    known = np.isfinite(dem.heights)
    assert dem.time is not None
    assert dem.count is not None
    assert (dem.time[known] == 7.0).all()
    assert (dem.count[~known] == 0).all()
    x, y = np.moveaxis(dem.geometry.centers(), -1, 0)
    assert dem.heights == pytest.approx(waves(x, y), abs=0.03)
    assert height_at(dem, 2.0, 2.0) == pytest.approx(waves(2.0, 2.0), abs=0.01)


def test_what_a_scan_does_not_say_is_asked(rng):
    scan = Scan(cloud(rng, 100, waves), "a.pcd")
    with pytest.raises(InvalidTerrain, match=r"--unit.*--up.*--unit m --up z"):
        terrain_of_scan(scan)
    with pytest.raises(InvalidTerrain, match=r"such as --up z\)"):
        terrain_of_scan(scan, unit="m")
    with pytest.raises(InvalidTerrain, match="--pose"):
        terrain_of_scan(Scan(scan.points, "depth.npz", unit="m", camera=True))
    with pytest.raises(InvalidTerrain, match="'furlong'"):
        terrain_of_scan(scan, unit="furlong", up="z")
    with pytest.raises(InvalidTerrain, match="'up'"):
        terrain_of_scan(scan, unit="m", up="up")


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_the_axis_that_points_up_becomes_z_without_mirroring(up, rng):
    points = rng.normal(size=(3, 3))
    scan = Scan(points, "a.pcd")
    turned = placed(scan, "mm", up, None) / 0.001
    sign, axis = (-1 if up[0] == "-" else 1), "xyz".index(up[-1])
    assert turned[:, 2] == pytest.approx(sign * points[:, axis])
    assert np.linalg.det(turned) == pytest.approx(np.linalg.det(points))
    assert turned @ turned.T == pytest.approx(points @ points.T)


def test_a_sensor_that_looks_down_sees_the_ground_where_it_is(rng):
    T = transform(rotation("z", 0.7) @ rotation("x", 2.0), (5.0, -3.0, 1.5))
    ground = cloud(rng, 30_000, waves)
    seen = (ground - T[:3, 3]) @ T[:3, :3]
    dem = terrain_of_scan(Scan(seen / 0.3048, "lidar.pcd"), ScanSettings(resolution=0.1), unit="ft", T_site_sensor=T)
    assert height_at(dem, 2.0, 1.0) == pytest.approx(waves(2.0, 1.0), abs=0.02)


def test_classes_of_a_file_are_heeded(rng):
    ground, tree = cloud(rng, 5000, waves), cloud(rng, 5000, lambda x, y: 3 + 0 * x)
    classes = np.repeat([2, 5], 5000).astype(np.uint8)
    scan = Scan(np.vstack([ground, tree]), "a.las", unit="m", up="z", classes=classes)
    high, low = (terrain_of_scan(scan, ScanSettings(resolution=0.2, vegetation=v)) for v in (False, True))
    assert np.nanmean(high.heights) > 2.5
    assert np.nanmax(low.heights) < 0.4


def test_cells_are_as_large_as_the_points_are_sparse():
    assert natural_resolution(10**7, 10.0, 10.0) == 0.02
    assert natural_resolution(10_000, 100.0, 100.0) == 2.0
    assert natural_resolution(9_000, 100.0, 100.0) == 5.0
    assert natural_resolution(1, 0.0, 0.0) == pytest.approx(0.05)
