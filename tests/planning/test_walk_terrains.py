"""The benchmark of walks: what its families of ground promise, and how attempts are counted."""

import numpy as np
import pytest

from benchmarks.walks.summary import Attempt, summary
from benchmarks.walks.terrains import (
    FALL,
    FAMILIES,
    LARGEST,
    REPORTED,
    ROCKS,
    SIZES,
    SMALLEST,
    TRAINING,
    lunar_rocks,
    slopes,
    start_of,
    terrain,
)
from footfall.terrain.generate import plane
from footfall.terrain.ground.surface import normal_at

SEEDS = (REPORTED[0], REPORTED[7], TRAINING[3])


def test_seeds_of_training_are_never_reported():
    assert not set(TRAINING) & set(REPORTED)


@pytest.mark.parametrize("family", ["smooth", "steep", "very steep"])
@pytest.mark.parametrize("seed", SEEDS)
def test_ground_is_as_steep_as_its_family(family, seed):
    steepest = FAMILIES[family].steepest
    assert steepest is not None
    found = slopes(terrain(family, seed))
    low, high = np.rad2deg(steepest)
    # heights are kept as float32
    assert low - 0.01 <= found.p95 <= high + 0.01
    assert found.median < found.p95 < found.most


def test_slopes_are_those_of_planes_under_wheels_by_least_squares(athlete):
    """Second method: normals at some places, and their percentiles by sorting."""
    dem = terrain("steep", SEEDS[0])
    grid, radius = dem.geometry, athlete.wheel_radius
    found = []
    for y in grid.ys[3:-3]:
        found += [float(np.arccos(normal_at(dem, x, y, radius)[2])) for x in grid.xs[3:-3:4]]
    assert slopes(dem).p95 == pytest.approx(np.rad2deg(np.sort(found)[int(0.95 * len(found))]), abs=1.5)


@pytest.mark.parametrize("family", FAMILIES)
def test_equal_seeds_give_equal_ground_and_others_do_not(family):
    one = terrain(family, 5)
    assert one.digest == terrain(family, 5).digest
    # a slope that is turned to stand ends in edges that are not those of its grid
    known = np.isfinite(one.heights)
    assert known.all() if family != "rappel" else known.mean() > 0.5
    same = np.array_equal(one.heights, terrain(family, 6).heights, equal_nan=True)
    assert same == (family == "flat")


@pytest.mark.parametrize("metres", SIZES)
def test_there_is_ground_around_the_whole_walk(metres):
    west, south, east, north = terrain("smooth", 1, metres).geometry.bounds
    x, y = start_of(metres)
    assert x - west >= 4.5
    assert east - (x + metres) >= 4.5
    assert min(y - south, north - y) >= 4.0


def test_rocks_are_as_many_as_the_law_says():
    """Of every size: counted on 100 × 100 m, within four standard deviations of a Poisson number."""
    ground = plane(100.0, 1.0)
    rocks = lunar_rocks(ground, np.random.default_rng(7))
    assert rocks[:, 2].min() >= SMALLEST
    assert rocks[:, 2].max() <= LARGEST
    for diameter in (0.1, 0.2, 0.4, 0.7):
        wanted = 1e4 * ROCKS * (diameter**-FALL - LARGEST**-FALL)
        assert abs((rocks[:, 2] >= diameter).sum() - wanted) <= 4 * np.sqrt(wanted)


def test_starts_that_are_refused_count_as_not_solved():
    fast = [Attempt("smooth", one, 0, "found", wall=1.0, foot_moves=20) for one in range(97)]
    refused = [Attempt("smooth", 97 + one, 0, "no start", "no ground") for one in range(3)]
    row = summary([*fast, *refused], 2.75)
    assert row["solved"] == pytest.approx(0.97)
    assert row["unsolved"] == {"no start": 3}
    assert row["wanted"] == {"median 2 s": True, "p95 6 s": True, "solved 98%": False}
    assert row["foot_moves"]["median"] == 20
    assert "wanted" not in summary(fast, 20.0)


def test_slow_walks_and_refused_rechecks_are_told():
    slow = [Attempt("steep", one, 0, "found", wall=16.0, failed=("contact",) if one < 2 else ()) for one in range(4)]
    none = [Attempt("steep", 4, 0, "time_limit", wall=60.0)]
    row = summary([*slow, *none], 2.75)
    assert row["wanted"] == {"median 5 s": False, "p95 15 s": False, "solved 90%": False}
    assert (row["rechecked"], row["recheck_failed"]) == (4, 2)
    assert row["wall"]["most"] == 16.0
    assert row["unsolved_wall"] == 60.0
    nothing = summary(none, 2.75)
    assert nothing["wall"]["median"] is None
    assert not any(nothing["wanted"].values())
