"""The measuring tape: two points on the ground, how far apart they are and how much higher the second is."""

import numpy as np
import viser

from footfall.session.view import Points
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

COLOR = (255, 240, 120)
TICK = 0.15
"""Height of the mark at each point [m], of ATHLETE."""
LINES, LABEL = "/tape/lines", "/tape/text"


def tape_text(points: Points) -> str:
    """What the label says; of one point, what to do next."""
    if len(points) < 2:
        return "click on the other end"
    along = np.subtract(points[1], points[0])
    level = float(np.hypot(along[0], along[1]))
    return f"{np.linalg.norm(along):z.3f} m, level {level:z.3f} m, height {along[2]:+z.3f} m"


class TapeDrawing:
    """A tick at each point and a line between their tops."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of: Points = ()

    def show(self, points: Points, size: float = 1.0) -> None:
        """points: one or two, site frame [m]; none: nothing is drawn. size: see :func:`.any_robot.size`."""
        if not points:
            self.hide()
            return
        if points == self._of:
            return
        self._of = ()
        ends, up = np.array(points), np.array([0.0, 0.0, TICK * size])
        segments = np.stack([ends, ends + up], axis=1)
        if len(ends) == 2:
            segments = np.concatenate([segments, (ends + up)[None]])
        local, middle = near(segments)
        scene = self._server.scene
        self._drawn.add(
            scene.add_line_segments, LINES, local, COLOR, thickness=4.0, thickness_units="screen", position=middle
        )
        self._drawn.add(scene.add_label, LABEL, tape_text(points), position=ends.mean(axis=0) + up)
        self._of = points

    def hide(self) -> None:
        self._of = ()
        self._drawn.clear()
