"""The whole rover as it would stand after a shift of its chassis, see-through, beside how it does stand."""

import viser

from footfall.telemetry.state import RobotState
from footfall_ui.scene.any_robot import AnyRobot, DrawnRobot, drawn_robot
from footfall_ui.scene.robot import GHOST


class WhatIfDrawing:
    """A see-through copy of the rover, made when first needed and hidden outside a what-if."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawing: DrawnRobot | None = None

    def show(self, robot: AnyRobot, state: RobotState) -> None:
        if self._drawing is None:
            self._drawing = drawn_robot(self._server, robot, "what-if", color=GHOST, opacity=0.35)
        self._drawing.place(state.posture, state.T_site_base)

    def hide(self) -> None:
        if self._drawing is not None:
            self._drawing.hide()

    def remove(self) -> None:
        """Forget the copy: another robot may come."""
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None
