# What is optional is there by construction; where it is not, the test fails on its own.
# pyright: reportArgumentType=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportOperatorIssue=false
# pyright: reportOptionalMemberAccess=false
# pyright: reportOptionalOperand=false
# pyright: reportOptionalSubscript=false

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance, flatten, unflatten
from footfall.io.artifacts import decode, encode
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.memory import drifted, merge
from footfall.terrain.fusion.visibility import DepthView, seen_through
from footfall.terrain.terrain_settings import TerrainSettings

STILL = TerrainSettings(drift_per_hour=0.0, drift_per_metre=0.0)
CELL = 0.02


def seen(heights, variance=1e-4, time=100.0, x=0.0, y=0.0, source="left", viewpoint=(0.0, 0.0, 1.0)) -> Dem:
    """A terrain as a snapshot leaves it; NaN = not seen."""

    heights = np.asarray(heights, np.float32)
    known = np.isfinite(heights)
    return Dem(
        heights,
        GridGeometry(x, y, CELL, *heights.shape),
        "seen",
        Provenance({}),
        texture=np.where(known, 100, 0).astype(np.uint8),
        variance=np.where(known, variance, np.nan).astype(np.float32),
        count=known.astype(np.uint16),
        time=np.where(known, time, np.nan),
        source=known.astype(np.uint8),
        sources=(source,),
        viewpoint=viewpoint,
    )


def patchy(rng, shape=(12, 15), share=0.7):
    heights = rng.normal(0.0, 0.01, shape)
    heights[rng.random(shape) > share] = np.nan
    return heights


def from_above(depth, height=2.0, f=100.0, size=41) -> DepthView:
    """A camera ``height`` above (0.1, 0.1) that looks straight down and sees ``depth`` [m] everywhere."""
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    T[:3, 3] = 0.1, 0.1, height
    inverse = np.full((size, size), 1.0 / depth, np.float32) if np.isscalar(depth) else (1.0 / depth).astype(np.float32)
    return DepthView(inverse, (f, f, (size - 1) / 2, (size - 1) / 2), T, np.full_like(inverse, 0.0005))


def test_the_same_again_halves_the_variance_and_keeps_the_height(rng):
    dem = seen(patchy(rng))
    twice = merge(dem, dem, STILL)
    assert np.array_equal(twice.heights, dem.heights, equal_nan=True)
    assert np.allclose(twice.variance, dem.variance / 2, rtol=1e-6, equal_nan=True)
    assert np.array_equal(twice.count, 2 * dem.count)
    assert np.array_equal(twice.texture, dem.texture)
    assert twice.geometry.digest == dem.geometry.digest


def test_order_does_not_matter_where_all_agree(rng):
    truth = patchy(rng)
    views = [
        seen(truth + rng.normal(0, 0.005, truth.shape), variance=v, time=t, source=s)
        for v, t, s in ((1e-4, 5.0, "a"), (4e-4, 2.0, "b"), (2e-4, 9.0, "c"))
    ]
    results = []
    for order in ((0, 1, 2), (2, 0, 1), (1, 2, 0)):
        first, second, third = (views[i] for i in order)
        results.append(merge(merge(first, second, STILL), third, STILL))
    information = sum(1 / v.variance.astype(float) for v in views)
    expected = sum(v.heights / v.variance.astype(float) for v in views) / information
    for result in results:
        assert np.allclose(result.heights, expected, atol=1e-6, equal_nan=True)
        assert np.allclose(result.variance, 1 / information, rtol=1e-5, equal_nan=True)
        known = np.isfinite(result.heights)
        assert (result.time[known] == 9.0).all()
        assert {result.sources[i - 1] for i in result.source[known]} == {"c"}


def test_what_is_not_seen_again_persists_with_its_age():
    heights = np.zeros((6, 6))
    half = heights.copy()
    half[:, :3] = np.nan
    merged = merge(seen(heights, time=100.0), seen(half, time=500.0, source="right"), STILL)
    assert (merged.heights == 0).all()
    assert (merged.time[:, :3] == 100.0).all()
    assert (merged.time[:, 3:] == 500.0).all()
    assert {merged.sources[i - 1] for i in np.unique(merged.source[:, :3])} == {"left"}
    assert {merged.sources[i - 1] for i in np.unique(merged.source[:, 3:])} == {"right"}


def test_a_new_obstacle_stays():
    rock = np.zeros((12, 12))
    rock[4:8, 4:8] = 0.3
    merged = merge(seen(np.zeros((12, 12)), variance=1e-6, time=1.0), seen(rock, time=2.0), STILL)
    assert np.allclose(merged.heights[4:8, 4:8], 0.3)
    assert (merged.count[4:8, 4:8] == 1).all()
    assert (merged.time[4:8, 4:8] == 2.0).all()
    # and it is not diluted by what was there before
    again = merge(merged, seen(rock, time=3.0), STILL)
    assert np.allclose(again.heights[4:8, 4:8], 0.3)


def test_what_is_seen_badly_does_not_overrule_the_map_but_makes_it_unknown():
    flat, rock = seen(np.zeros((9, 9)), variance=1e-5), np.zeros((9, 9))
    rock[3:6, 3:6] = 0.6
    merged = merge(flat, seen(rock, variance=0.01), STILL)
    assert np.array_equal(np.isnan(merged.heights), rock > 0)
    assert np.nanmax(np.abs(merged.heights)) == 0
    assert (merged.count[rock > 0] == 0).all()
    lonely = np.full((9, 9), np.nan)
    lonely[4, 4] = 0.6
    assert np.array_equal(np.isnan(merge(flat, seen(lonely), STILL).heights), np.isfinite(lonely))
    # so unsure that it contradicts nothing
    assert np.isfinite(merge(flat, seen(rock, variance=0.1), STILL).heights).all()


def test_a_phantom_goes_and_hidden_ground_stays():
    old = np.zeros((11, 11))
    old[5, 5] = 0.5
    nothing = np.full((11, 11), np.nan)
    nothing[0, 0] = 0.0
    merged = merge(seen(old), seen(nothing, time=200.0), STILL, (from_above(2.0),))
    assert np.isnan(merged.heights[5, 5])
    assert merged.count[5, 5] == 0
    assert merged.texture[5, 5] == 0
    assert np.isnan(merged.time[5, 5])
    assert np.isfinite(np.delete(merged.heights.ravel(), 60)).all()
    # without a view, or with a leg in its way, nothing is known against it
    assert merge(seen(old), seen(nothing), STILL).heights[5, 5] == 0.5
    hidden = from_above(np.full((41, 41), np.nan))
    assert merge(seen(old), seen(nothing), STILL, (hidden,)).heights[5, 5] == 0.5


def test_ground_itself_is_never_seen_through(rng):
    heights = rng.normal(0, 0.01, (11, 11)).astype(np.float32)
    dem = seen(heights)
    assert not seen_through(dem.heights, dem.geometry, (from_above(2.0),), 0.08).any()
    assert seen_through(dem.heights + 0.5, dem.geometry, (from_above(2.0),), 0.08).all()
    assert seen_through(dem.heights + 0.5, dem.geometry, (from_above(np.full((41, 41), np.inf)),), 0.08).all()
    behind = from_above(2.0, height=-1.0)
    assert not seen_through(dem.heights, dem.geometry, (behind,), 0.08).any()


def test_a_pixel_beside_an_edge_proves_nothing():
    depth = np.full((41, 41), 2.0)
    depth[:, 20:] = 0.9
    dem = seen(np.full((11, 11), 0.5))
    through = seen_through(dem.heights, dem.geometry, (from_above(depth),), 0.08)
    assert through[5, 0]
    assert not through[:, 5:].any()
    # 1 px of 100 px focal length, 1.5 m away, is 1.5 cm
    assert not through[5, 4]


@given(st.integers(-30, 30), st.integers(-30, 30))
def test_the_map_grows_on_its_lattice_up_to_the_limit(rows, cols):
    dem = seen(np.zeros((10, 12)))
    moved = seen(
        np.zeros((10, 12)), x=cols * CELL, y=rows * CELL, viewpoint=(cols * CELL + 0.1, rows * CELL + 0.1, 1.0)
    )
    limit = 0.3
    settings = TerrainSettings(half_size=limit, memory_half_size=limit, drift_per_hour=0.0, drift_per_metre=0.0)
    merged = merge(dem, moved, settings)
    west, south, east, north = merged.geometry.bounds
    x, y, _ = moved.viewpoint
    assert max(x - west, east - x, y - south, north - y) <= limit + CELL
    for start in (merged.geometry.x0, merged.geometry.y0):
        assert start / CELL == pytest.approx(round(start / CELL), abs=1e-6)
    row, col = merged.geometry.cell(*np.meshgrid(moved.geometry.xs, moved.geometry.ys))
    assert (merged.heights[row, col] == 0).all()
    back = merged.geometry.contains(*np.meshgrid(dem.geometry.xs, dem.geometry.ys))
    near = np.maximum(*np.abs(np.meshgrid(dem.geometry.xs - x, dem.geometry.ys - y))) < limit - CELL
    assert back[near].all()


def test_drift_grows_with_time_and_way_and_does_not_depend_on_the_parts():
    settings = TerrainSettings(drift_per_hour=0.006, drift_per_metre=0.002)
    dem = seen(np.zeros((5, 5)), time=0.0)
    there = seen(np.zeros((5, 5)), time=7200.0, viewpoint=(3.0, 0.0, 1.0))
    halfway = seen(np.zeros((5, 5)), time=3600.0, viewpoint=(1.5, 0.0, 1.0))
    grown = drifted(dem, there, settings).variance
    assert np.allclose(grown, 1e-4 + 2 * 0.006**2 + 3 * 0.002**2, rtol=1e-6)
    steps = replace(drifted(dem, halfway, settings), time=halfway.time, viewpoint=halfway.viewpoint)
    assert np.allclose(drifted(steps, there, settings).variance, grown, rtol=1e-6)
    assert np.array_equal(drifted(there, dem, TerrainSettings(drift_per_metre=0.0)).variance, there.variance)


def test_merging_changes_neither_input_and_is_deterministic(rng):
    one, two = seen(patchy(rng)), seen(patchy(rng), time=200.0)
    before = one.digest, two.digest
    first, second = merge(one, two), merge(one, two)
    assert first.digest == second.digest
    assert (replace(one).digest, replace(two).digest) == before
    assert dict(first.provenance.parents) == {"map": one.digest, "new": two.digest}


def test_what_can_not_be_merged_is_refused():
    dem = seen(np.zeros((5, 5)))
    bare = Dem(dem.heights, dem.geometry, "loaded", Provenance({}))
    assert dem.remembers
    assert not bare.remembers
    with pytest.raises(InvalidTerrain, match="how sure"):
        merge(bare, dem)
    with pytest.raises(InvalidTerrain, match="one resolution"):
        merge(dem, replace(dem, geometry=GridGeometry(0.0, 0.0, 0.05, 5, 5)))
    with pytest.raises(InvalidTerrain, match="cells apart"):
        merge(dem, replace(dem, geometry=GridGeometry(0.007, 0.0, CELL, 5, 5)))


@pytest.mark.parametrize(
    "wrong",
    [
        {"variance": np.zeros((5, 5), np.float32)},
        {"variance": np.ones((5, 5), np.float64)},
        {"variance": np.full((5, 5), np.inf, np.float32)},
        {"count": np.ones((4, 5), np.uint16)},
        {"time": np.full((5, 5), np.nan)},
        {"source": np.full((5, 5), 2, np.uint8)},
        {"sources": tuple(f"camera {i}" for i in range(256))},
        {"viewpoint": (0.0, np.nan, 0.0)},
        {"correction": np.zeros((4, 4))},
    ],
)
def test_memory_layers_that_do_not_fit_are_refused(wrong):
    dem = seen(np.zeros((5, 5)))
    with pytest.raises(Exception, match=r"variance|count|time|source|viewpoint|correction"):
        replace(dem, **wrong)


def test_terrain_files_keep_the_layers_and_those_without_still_load(rng):
    dem = seen(patchy(rng))
    again = decode(encode(dem))
    assert again.digest == dem.digest
    assert np.array_equal(again.variance, dem.variance, equal_nan=True)
    assert again.sources == dem.sources
    # as an earlier version wrote it: without the fields that came later
    structure, arrays = flatten(Dem(dem.heights, dem.geometry, "old", Provenance({}), dem.texture))
    old = json.loads(json.dumps(structure))
    old["of"] = {name: old["of"][name] for name in ("heights", "geometry", "name", "provenance", "texture")}
    loaded = unflatten(old, arrays)
    assert loaded.variance is None
    assert np.array_equal(loaded.heights, dem.heights, equal_nan=True)
