"""The ghost: where the moving leg will be at a moment of the plan."""

import numpy as np
import viser

from footfall.planning.step.problem import StepPlan
from footfall.robot.model import Robot
from footfall_ui.scene.robot import GHOST, RobotDrawing, leg_links


class GhostDrawing:
    """A see-through copy of one leg, created once for each leg."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._drawing: RobotDrawing | None = None
        self._leg: int | None = None

    def show(self, robot: Robot, plan: StepPlan, moment: float) -> None:
        """moment: 0…1 along the plan; between waypoints the joints move in straight lines."""
        if self._drawing is None or self._leg != plan.leg:
            self.hide()
            links = leg_links(robot, plan.leg)
            self._drawing = RobotDrawing(self._server, robot, "ghost", links, GHOST, opacity=0.55)
            self._leg = plan.leg
        self._drawing.place(posture_at(plan, moment), plan.T_site_base)

    def hide(self) -> None:
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None


def posture_at(plan: StepPlan, moment: float) -> np.ndarray:
    """Posture at 0…1 of the plan, measured by the largest joint's travel (as long commands take longer)."""
    travel = np.abs(np.diff(plan.waypoints, axis=0)).max(axis=1)
    along = np.concatenate([[0.0], np.cumsum(travel)])
    at = np.clip(moment, 0, 1) * along[-1]
    return np.array([np.interp(at, along, joint) for joint in plan.waypoints.T])
