"""A step as the sagging rover is predicted to make it: the whole rover, the way of its wheel, and where that lands."""

import numpy as np
import viser

from footfall.core.frames import apply
from footfall.planning.between_rows import at
from footfall.planning.execution.problem import Execution
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near
from footfall_ui.scene.robot import RobotDrawing

SAG = (110, 225, 190)
ARM = 0.12
"""Of the cross at the touch-down [m]."""
UP = np.array([0.0, 0.0, ARM])


class SagDrawing:
    """A see-through copy of the rover, and lines that are made anew for another execution."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawing: RobotDrawing | None = None
        self._lines = Drawn(server)
        self._of = ""

    def show(self, robot: Robot, done: Execution, moment: float | None) -> None:
        """moment: 0…1 along the execution, where the rover is drawn; None: its wheel's way only."""
        if self._of != done.digest:
            self._draw_lines(robot, done)
        if moment is None:
            if self._drawing is not None:
                self._drawing.hide()
            return
        if self._drawing is None:
            self._drawing = RobotDrawing(self._server, robot, "sag", color=SAG, opacity=0.35)
        self._drawing.place(*at(done.motion, moment))

    def hide(self) -> None:
        self._of = ""
        self._lines.clear()
        if self._drawing is not None:
            self._drawing.hide()

    def remove(self) -> None:
        """Forget the copy: another robot may come."""
        self.hide()
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None

    def _draw_lines(self, robot: Robot, done: Execution) -> None:
        self.hide()
        hubs = np.array(
            [
                apply(T_site_base, wheel_centers(robot, posture)[done.leg])
                for posture, T_site_base in zip(done.predicted, done.Ts_site_base, strict=True)
            ]
        )
        segments = [np.stack([hubs[:-1], hubs[1:]], axis=1)]
        scene = self._server.scene
        if np.isfinite(done.touch_down).all():  # else the wheel never touches
            arms = np.array([[1, 1, 0], [-1, -1, 0], [1, -1, 0], [-1, 1, 0]]) * ARM
            segments.append((done.touch_down + arms).reshape(2, 2, 3))
            segments.append(np.array([[done.plan.contact, done.touch_down]]))
            text = f"touch-down, {done.touch_down_offset:z.3f} m off"
            self._lines.add(scene.add_label, "/execution/text", text, position=done.touch_down + UP)
        local, middle = near(np.concatenate(segments))
        self._lines.add(
            scene.add_line_segments,
            "/execution/way",
            local,
            SAG,
            thickness=2.0,
            thickness_units="screen",
            position=middle,
        )
        self._of = done.digest
