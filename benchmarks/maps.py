"""Maps for one leg, and the stability margins that they rest on."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import ConvexHull

import footfall
from benchmarks.scenes import robot, rocks, standing
from benchmarks.timing import SEED, Figure, paired, seconds
from footfall.balance.support import margins_for_candidates
from footfall.maps.layers import MapSettings


def figures(quick: bool) -> Iterator[Figure]:
    n = 3 if quick else 10
    for name, settings in (("plain", MapSettings()), ("conservative", MapSettings(conservative=True))):
        yield Figure(
            f"maps.leg_400x400_{name}",
            seconds(lambda s=settings: footfall.compute_maps(robot(), rocks(), standing(), 2, s), n),
            "s",
        )
    rng = np.random.default_rng(SEED)
    angle = np.arange(5) * np.pi / 3
    fixed = 2.3 * np.column_stack([np.cos(angle), np.sin(angle)])
    candidates = rng.uniform(-3, 3, (1000, 2))
    com = np.zeros(2)

    def hulls() -> None:
        for candidate in candidates:
            (ConvexHull(np.vstack([fixed, candidate])).equations @ np.array([0.0, 0.0, 1.0])).max()

    yield paired(
        "maps.margins_over_qhull_1000_candidates",
        lambda: margins_for_candidates(fixed, candidates, com, False),
        hulls,
        n,
    )
    many = rng.uniform(-3, 3, (100_000, 2))
    yield Figure(
        "maps.conservative_margin_100k_candidates",
        seconds(lambda: margins_for_candidates(fixed, many, com, True), n),
        "s",
    )
