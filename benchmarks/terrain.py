"""Images to terrain: the nine simulated pairs of a snapshot, against the ground they were rendered from."""

from collections.abc import Iterator

import numpy as np

from benchmarks.scenes import robot, rocks, standing
from benchmarks.timing import SEED, Figure, paired, seconds
from footfall.sim.render import render_snapshot
from footfall.terrain.build import build_terrain
from footfall.terrain.settings import TerrainSettings
from footfall.terrain.stereo import disparity
from footfall.terrain.surface import height_at, pick
from footfall.terrain.triangulate import triangulate


def figures(quick: bool) -> Iterator[Figure]:
    n = 2 if quick else 5
    snapshot = render_snapshot(robot(), standing(), rocks(), seed=SEED)
    for matcher in ("hh", "3way"):
        settings = TerrainSettings(matcher=matcher)
        yield Figure(
            f"terrain.nine_pairs_{matcher}", seconds(lambda s=settings: build_terrain(robot(), snapshot, s), n), "s"
        )
    settings = TerrainSettings()
    yield paired(
        "terrain.build_over_matching_alone",
        lambda: build_terrain(robot(), snapshot, settings),
        lambda: [disparity(pair, settings) for pair in snapshot.pairs],
        n,
    )
    built = build_terrain(robot(), snapshot, settings)
    x, y = np.moveaxis(built.geometry.centers(), -1, 0)
    error = np.abs(built.heights - height_at(rocks(), x, y))[np.isfinite(built.heights)]
    error = error[np.isfinite(error)]
    yield Figure("terrain.height_error", tuple(error), "m")
    yield Figure("terrain.triangulate_400x400", seconds(lambda: triangulate(rocks()), 5 * n), "s")
    yield Figure(
        "terrain.pick",
        seconds(lambda: pick(rocks(), np.array([-4.0, -4.0, 4.0]), np.array([1.0, 1.0, -0.9])), 20 * n),
        "s",
    )
