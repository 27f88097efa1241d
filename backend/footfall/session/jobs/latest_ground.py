"""Feasible traversability of the map that a route was looked for on last: that of the next map is made of it."""

from footfall.core.progress import Progress, no_progress
from footfall.planning.route.feasible import FeasibleGround, feasible_ground, updated
from footfall.planning.route.problem import RouteSettings
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem

MOST_KEPT = 1 << 22
"""Cells of a map of which it is kept for the next route: some 100 MB."""


class LatestGround:
    """What one process keeps between routes: of the latest robot, map and settings alone."""

    def __init__(self) -> None:
        self._kept: FeasibleGround | None = None

    def look(self, robot: Robot, dem: Dem, settings: RouteSettings, progress: Progress = no_progress) -> FeasibleGround:
        """As ``feasible_ground``, to the digest; only what changed since it was last asked, where that is little."""
        kept = self._kept
        if kept is None or not _is_of(kept, robot, settings):
            found = feasible_ground(robot, dem, settings, progress)
        else:
            found = updated(robot, dem, kept, progress)
        self._kept = found if found.forbidden.size <= MOST_KEPT else None
        return found


def _is_of(found: FeasibleGround, robot: Robot, settings: RouteSettings) -> bool:
    of = found.provenance
    return of.parents["robot"] == robot.digest and of.settings is not None and of.settings.digest == settings.digest


LATEST_GROUND = LatestGround()
"""Of this process, a worker's or one that replays."""
