"""The goal of a walk: a flag on the ground where the chassis is to be."""

import numpy as np
import viser

from footfall.session.live import LiveSession
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from footfall_ui.scene.any_robot import size
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

COLOR = (255, 110, 220)
POLE, CLOTH = 1.0, 0.35
"""Height of the pole, and length of the cloth [m], of ATHLETE."""
FLAG, LABEL = "/goal/flag", "/goal/text"
SEGMENTS = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, POLE]],
        [[0.0, 0.0, POLE], [CLOTH, 0.0, POLE - 0.15]],
        [[CLOTH, 0.0, POLE - 0.15], [0.0, 0.0, POLE - 0.3]],
    ]
)
"""(n, 2, 3): the pole and the cloth's rim over its foot [m]."""


class GoalDrawing:
    """The flag stands on the ground; where that is not known, at the height 0 of the site frame."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of: tuple[str | None, tuple[float, float]] | None = None

    def draw(self, live: LiveSession) -> None:
        """As the view has it; made anew where goal or ground are others."""
        goal = live.choices.view.goal
        if goal is None:
            self._of = None
            self._drawn.clear()
            return
        if self._of == (live.state.dem, goal):
            return
        self._of = None
        ground = None if live.state.dem is None else live.get(live.state.dem)
        z = float(height_at(ground, *goal)) if isinstance(ground, Dem) else 0.0
        foot = np.array([*goal, z if np.isfinite(z) else 0.0])
        segments = size(live.any_robot) * SEGMENTS
        local, middle = near(segments + foot)
        scene = self._server.scene
        self._drawn.add(
            scene.add_line_segments, FLAG, local, COLOR, thickness=4.0, thickness_units="screen", position=middle
        )
        self._drawn.add(scene.add_label, LABEL, "goal of the walk", position=foot + segments[0, 1])
        self._of = (live.state.dem, goal)
