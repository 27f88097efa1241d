"""The planned way of the wheel: its centre at every waypoint, one colour for each phase."""

import numpy as np
import viser

from footfall.core.frames import apply
from footfall.planning.step.problem import StepPlan
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

COLORS = {"lift": (255, 190, 60), "swing": (90, 200, 255), "lower": (200, 130, 255)}


class PathDrawing:
    """Line segments from waypoint to waypoint, made anew for another plan."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of = ""

    def show(self, robot: Robot, plan: StepPlan) -> None:
        if self._of == plan.digest:
            return
        centers = np.array([wheel_centers(robot, posture)[plan.leg] for posture in plan.waypoints])
        points = apply(plan.T_site_base, centers)
        colors = np.array([COLORS[phase] for phase in plan.phases[1:]], np.uint8)
        local, middle = near(np.stack([points[:-1], points[1:]], axis=1))
        self._drawn.add(
            self._server.scene.add_line_segments,
            "/plan/path",
            local,
            np.repeat(colors[:, None, :], 2, axis=1),
            thickness=3.0,
            thickness_units="screen",
            position=middle,
        )
        self._of = plan.digest

    def hide(self) -> None:
        self._of = ""
        self._drawn.clear()
