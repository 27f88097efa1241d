"""A planned route: a line over the ground, or a mark at the place where the way ends."""

from itertools import pairwise

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.planning.route.problem import RouteResult
from footfall.session.live import LiveSession
from footfall.session.products.kinds import ROUTE
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from footfall_ui.scene.any_robot import size
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

COLOR, CUT_OFF = (190, 140, 255), (255, 90, 90)
OVER_GROUND, STEP = 0.06, 0.2
"""Height of the line, and between its points [m], of ATHLETE."""
SIZE = 0.4
"""Half the length of the arms of a mark [m], of ATHLETE."""
LINE, LABEL = "/route/line", "/route/text"
CROSS = SIZE * np.array([[[-1, -1], [1, 1]], [[-1, 1], [1, -1]]])


def on_ground(dem: Dem, xy: NDArray[np.float64], large: float = 1.0) -> NDArray[np.float64]:
    """Points (n, 2) a little over the ground, (n, 3) [m]; over unknown ground as high as the one before, or at 0.

    large: beside ATHLETE's.
    """
    heights = np.asarray(height_at(dem, xy[:, 0], xy[:, 1]), float)
    last = np.maximum.accumulate(np.where(np.isfinite(heights), np.arange(len(xy)), 0))
    return np.column_stack([xy, np.nan_to_num(heights[last]) + large * OVER_GROUND])


def route_line(dem: Dem, points: NDArray[np.float64], large: float = 1.0) -> NDArray[np.float64]:
    """Short pieces (n, 2, 3) [m] that follow the ground along points (m, 2); large: beside ATHLETE's."""
    way = [points[:1]]
    for a, b in pairwise(points):
        count = max(int(np.ceil(np.linalg.norm(b - a) / (large * STEP))), 1)
        way.append(a + (b - a) * np.arange(1, count + 1)[:, None] / count)
    line = on_ground(dem, np.concatenate(way), large)
    return np.stack([line[:-1], line[1:]], axis=1)


class RouteDrawing:
    """The latest route; on other ground than it was planned over it is not drawn."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of = ""

    def draw(self, live: LiveSession) -> None:
        """Made anew where the route or the ground is another."""
        newest = live.state.newest(ROUTE)
        result = None if newest is None else live.get(newest)
        dem = None if live.state.dem is None else live.get(live.state.dem)
        if (
            not isinstance(result, RouteResult)
            or not isinstance(dem, Dem)
            or result.provenance.parents["dem"] != dem.digest
            or (result.plan is None and not result.cut_off)
        ):
            self._of = ""
            self._drawn.clear()
        elif self._of != result.digest:
            self._of = ""
            self._show(result, dem, size(live.any_robot))
            self._of = result.digest

    def _show(self, result: RouteResult, dem: Dem, large: float) -> None:
        if result.plan is not None:
            segments, color = route_line(dem, result.plan.points, large), COLOR
            text = f"route: {result.plan.length:z.1f} m"
            end = segments[-1, 1]
        else:
            end = on_ground(dem, np.array([result.cut_off]), large)[0]
            segments = end + large * np.pad(CROSS, [(0, 0), (0, 0), (0, 1)])
            color, text = CUT_OFF, "✕ the route ends here"
        local, middle = near(segments)
        scene = self._server.scene
        self._drawn.add(
            scene.add_line_segments, LINE, local, color, thickness=4.0, thickness_units="screen", position=middle
        )
        self._drawn.add(scene.add_label, LABEL, text, position=end)
