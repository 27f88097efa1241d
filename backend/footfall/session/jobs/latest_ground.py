"""Traversability of the map that a route was looked for on last: that of the next map is made of it."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress
from footfall.maps.layers import MapSettings
from footfall.maps.traversability import Traversability, traversability, updated_traversability
from footfall.planning.route.feasible import FeasibleGround, feasible_ground, updated
from footfall.planning.route.problem import RouteSettings
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem

MOST_KEPT = 1 << 22
"""Cells of a map of which it is kept for the next route: some 100 MB, and 160 MB of fitted planes."""


class LatestGround:
    """What one process keeps between routes: of the latest robot, map and settings alone."""

    def __init__(self) -> None:
        self._kept: FeasibleGround | None = None
        self._planes: tuple[MapSettings, GridGeometry, NDArray[np.float32], Traversability] | None = None

    def look(self, robot: Robot, dem: Dem, settings: RouteSettings, progress: Progress = no_progress) -> FeasibleGround:
        """As ``feasible_ground``, to the digest; only what changed since it was last asked, where that is little."""
        kept = self._kept
        if kept is None or not _is_of(kept, robot, settings):
            found = feasible_ground(robot, dem, settings, progress)
        else:
            found = updated(robot, dem, kept, progress)
        self._kept = found if found.forbidden.size <= MOST_KEPT else None
        return found

    def fit(self, dem: Dem, settings: MapSettings, progress: Progress = no_progress) -> Traversability:
        """As ``traversability``, to the digest; only tiles near what changed since it was last asked."""
        kept = self._planes
        if kept is None or kept[0].digest != settings.digest or kept[1].digest != dem.geometry.digest:
            found = traversability(dem, settings, progress)
        else:
            found = updated_traversability(dem, settings, kept[3], kept[2], progress)
        small = dem.heights.size <= MOST_KEPT
        self._planes = (settings, dem.geometry, dem.heights, found) if small else None
        return found


def _is_of(found: FeasibleGround, robot: Robot, settings: RouteSettings) -> bool:
    of = found.provenance
    return of.parents["robot"] == robot.digest and of.settings is not None and of.settings.digest == settings.digest


LATEST_GROUND = LatestGround()
"""Of this process, a worker's or one that replays."""
