"""Where one leg can stand: how soon a first picture and the whole answer come, and a search that may contradict it.

Everything is warm: compiled, and the stance's collision scene and certificate built, as they are once a stance.
"""

import tracemalloc
from collections.abc import Iterator
from functools import cache

import numpy as np

from benchmarks.numeric_ik import chain, reachable
from benchmarks.scenes import robot, rocks, standing
from benchmarks.timing import SEED, Figure, seconds
from footfall.core.frames import apply, inverse
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps.leg_collisions import LegCollisions
from footfall.maps.reach import reach
from footfall.maps.reach_classes import UNSURE
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

LEG = 2
STRIDE = 4
"""Of the first picture: every fourth cell both ways."""
GROWTH = (10_000, 100_000, 1_000_000)
"""Cells on the square that the leg can reach."""


def figures(quick: bool) -> Iterator[Figure]:
    n = 3 if quick else 10
    checked = collisions()
    yield Figure("reach.scene", seconds(collisions.__wrapped__, n), "s")
    yield Figure(
        "reach.first_picture",
        seconds(lambda: reach(robot(), rocks(), standing(), LEG, collisions=checked, stride=STRIDE), n),
        "s",
        0.15,
    )
    yield Figure("reach.kinematics_one_leg", seconds(lambda: reach(robot(), rocks(), standing(), LEG), n), "s")
    yield Figure(
        "reach.complete_one_leg",
        seconds(lambda: reach(robot(), rocks(), standing(), LEG, collisions=checked), n),
        "s",
        1.0,
    )
    whole = reach(robot(), rocks(), standing(), LEG, collisions=checked)
    yield Figure("reach.cells", (float(len(whole.rows)),), "cells")
    yield Figure("reach.mesh_checks", (float(whole.checks),), "checks")
    yield Figure("reach.unsure_cells", (float((whole.reason == UNSURE).sum()),), "cells", 0.0)
    yield from _searched(100 if quick else 2000)
    if not quick:
        yield from _growth()


@cache
def collisions() -> LegCollisions:
    """Of the shared scene, built once."""
    return LegCollisions(robot(), standing(), LEG, rocks()).with_certificate()


def _searched(cells: int) -> Iterator[Figure]:
    """Cells where the search contradicts the map: it finds what the map denies, or not what the map says."""
    rng = np.random.default_rng(SEED)
    found = reach(robot(), rocks(), standing(), LEG)
    # what is within 1e-4 rad of a limit is for rounding to decide
    some = rng.permutation(np.flatnonzero(~(np.abs(found.limit_margin) < 1e-4)))[:cells]
    leg, T_base_site = chain(robot(), LEG), inverse(standing().T_site_base)
    contacts, directions = apply(T_base_site, found.contacts[some]), -found.normals[some] @ T_base_site[:3, :3].T
    says = found.solutions[some] > 0
    searched = reachable(leg, contacts, directions, rng)
    yield Figure("reach.numeric_ik_false_no", (float((searched & ~says).sum()),), "cells", 0.0)
    # a start leads to a solution only near it, and twenty may all be far from the only one: these get more
    missed = says & ~searched
    yield Figure("reach.numeric_ik_20_starts_too_few", (float(missed.sum()),), "cells")
    left = ~reachable(leg, contacts[missed], directions[missed], rng, starts=300)
    yield Figure("reach.numeric_ik_false_yes", (float(left.sum()),), "cells", 0.0)


def _growth() -> Iterator[Figure]:
    """Time and memory of the kinematics on ever finer cells of the same ground."""
    for cells in GROWTH:
        ground = finer(cells)
        name = f"reach.kinematics_{cells}_cells"
        yield Figure(name, seconds(lambda g=ground: reach(robot(), g, standing(), LEG), 3), "s")
        tracemalloc.start()
        reach(robot(), ground, standing(), LEG)
        yield Figure(f"{name}_memory", (tracemalloc.get_traced_memory()[1] / 1e9,), "GB")
        tracemalloc.stop()


def finer(cells: int) -> Dem:
    """The ground about the leg's hip, sampled anew so that the square it may reach holds about that many cells."""
    hip = apply(standing().T_site_base, robot().description.legs[LEG].T_base_hip[:3, 3])
    side = int(np.sqrt(cells))
    half = 2.4
    resolution = 2 * half / side
    geometry = GridGeometry(float(hip[0]) - half, float(hip[1]) - half, resolution, side, side)
    x, y = np.moveaxis(geometry.centers(), -1, 0)
    return Dem(height_at(rocks(), x, y).astype(np.float32), geometry, f"{cells} cells", Provenance({}, seed=SEED))
