"""The chosen footfall: a ring on the ground, its normal, and whether the answer was yes or no."""

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.frames import rotation_from_z
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

YES = (40, 200, 90)
NO = (235, 70, 60)
OPEN = (245, 245, 245)
OVER, POLE, LABEL = 0.02, 0.5, 0.55
"""Of ring, end of the normal and text over the ground [m], of ATHLETE."""


class FootfallDrawing:
    """A ring with the radius of wheel or sole; a cross through it means that the footfall was refused."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)

    def show(
        self,
        point: NDArray[np.float64],
        normal: NDArray[np.float64],
        radius: float,
        accepted: bool | None,
        text: str,
        size: float = 1.0,
    ) -> None:
        """point, normal: site frame, (3,); radius [m]; accepted: None while nothing was decided; size: see
        :func:`.any_robot.size`.
        """
        color = OPEN if accepted is None else YES if accepted else NO
        R = rotation_from_z(normal, (1.0, 0.0, 0.0))
        angle, over = np.linspace(0, 2 * np.pi, 33), OVER * size * R[:, 2]
        ring = point + (np.column_stack([np.cos(angle), np.sin(angle), np.zeros(33)]) * radius) @ R.T + over
        segments = [np.stack([ring[:-1], ring[1:]], axis=1)]
        if accepted is False:
            arms = np.array([[1, 1, 0], [-1, -1, 0], [1, -1, 0], [-1, 1, 0]]) * radius * 0.7
            segments.append((point + arms @ R.T + over).reshape(2, 2, 3))
        segments.append(np.array([[point, point + POLE * size * R[:, 2]]]))
        scene = self._server.scene
        local, middle = near(np.concatenate(segments))
        self._drawn.add(
            scene.add_line_segments,
            "/footfall/mark",
            local,
            color,
            thickness=4.0,
            thickness_units="screen",
            position=middle,
        )
        self._drawn.add(scene.add_label, "/footfall/text", text, position=point + LABEL * size * R[:, 2])

    def hide(self) -> None:
        self._drawn.clear()
