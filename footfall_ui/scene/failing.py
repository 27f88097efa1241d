"""The posture at which a gait fails: the rover in red, with the step and the check that fails said beside it."""

import viser

from footfall.planning.gait.problem import GaitFailure, GaitResult
from footfall.robot.model import Robot
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.robot import RobotDrawing

COLOR, OPACITY = (235, 40, 40), 0.6
LABEL = "/failing-text"


def failing_text(failure: GaitFailure) -> str:
    """What is said at the chassis; it begins with a sign, as not everybody sees red."""
    return f"✕ {failure.text}"


class FailingDrawing:
    """A red copy of the rover, made when first needed."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._drawing: RobotDrawing | None = None
        self._of = ""

    def show(self, robot: Robot, result: GaitResult) -> None:
        """Of a gait that fails; nothing of one that does not, or that never came to a posture."""
        failure = result.failure
        if failure is None or failure.posture is None or failure.T_site_base is None:
            self.hide()
            return
        if self._of == result.digest:
            return
        self._of = ""
        if self._drawing is None:
            self._drawing = RobotDrawing(self._server, robot, "failing", color=COLOR, opacity=OPACITY)
        self._drawing.place(failure.posture, failure.T_site_base)
        at = failure.T_site_base[:3, 3]
        self._drawn.add(self._server.scene.add_label, LABEL, failing_text(failure), position=at)
        self._of = result.digest

    def hide(self) -> None:
        """Also forgets the copy: another robot may come."""
        self._of = ""
        self._drawn.clear()
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None
