"""What the rover stands on: the support polygon of its contacts and the centre of mass above it."""

import numpy as np
import viser

from footfall.balance.support import conservative_polygon, support_polygon
from footfall.core.frames import apply
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState

PLAIN = (90, 200, 255)
CONSERVATIVE = (255, 255, 255)


class SupportDrawing:
    """Polygon outlines at the mean height of the contacts; a plumb line from the centre of mass."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._handles: list[viser.SceneNodeHandle] = []
        self._drawn: str | None = None

    def show(self, robot: Robot, state: RobotState) -> None:
        if state.digest == self._drawn:
            return
        self.hide()
        self._drawn = state.digest
        contacts = np.array([contact_point(robot, state.posture, leg, state.T_site_base) for leg in robot.legs])
        com = apply(state.T_site_base, center_of_mass(robot, state.posture))
        z = float(contacts[:, 2].mean()) + 0.03
        for name, corners, color in (
            ("plain", support_polygon(contacts[:, :2]), PLAIN),
            ("conservative", conservative_polygon(contacts[:, :2]), CONSERVATIVE),
        ):
            if len(corners) < 2:
                continue
            ring = np.column_stack([corners, np.full(len(corners), z)])
            self._add(name, np.stack([ring, np.roll(ring, -1, axis=0)], axis=1), color)
        foot = np.array([com[0], com[1], z])
        cross = np.array([[[-0.1, 0, 0], [0.1, 0, 0]], [[0, -0.1, 0], [0, 0.1, 0]]]) + foot
        self._add("com", np.concatenate([cross, [[com, foot]]]), (255, 120, 120))

    def _add(self, name: str, segments: np.ndarray, color: tuple[int, int, int]) -> None:
        self._handles.append(
            self._server.scene.add_line_segments(
                f"/support/{name}", segments, color, thickness=2.5, thickness_units="screen"
            )
        )

    def hide(self) -> None:
        for handle in self._handles:
            handle.remove()
        self._handles = []
        self._drawn = None
